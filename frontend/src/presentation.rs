//! What is shown of a program: what debuggers, displays and editors ask about its names and its text, so that they need
//! to know no language.

use crate::common::Accessed;

/// What is shown of a checked program. Each language implements it in the folder `presentation` of its own.
pub trait Presentation {
    /// The name of a variable that a statement has accessed, as traces spell it. `None` for internal state without
    /// a name, such as the last clock of a flip-flop.
    fn name(&self, accessed: Accessed) -> Option<String>;

    /// What a name means, to compare it with what statements access: a variable, an element, or a whole array. `None` if
    /// no access is told by that name.
    fn accessed(&self, name: &str) -> Option<Accessed>;

    /// Whether a variable does not lie in the process image: its value is state of the executive.
    fn is_outside_image(&self, accessed: Accessed) -> bool;

    /// Whether a text can be nothing but a name, although a part of it would be an expression.
    fn is_only_a_name(&self, _text: &str) -> bool {
        false
    }

    /// The names of the bits of a word whose bits have names of their own, the lowest first.
    fn bit_names(&self, _name: &str) -> Vec<String> {
        vec![]
    }

    /// Variables that are shown among those of the program although it declares and names none of them.
    fn further_names(&self) -> Vec<String> {
        vec![]
    }
}
