//! What is shown of a program: what debuggers, displays and editors ask about its names and its text, so that they need
//! to know no language.
//!
//! [`Presentation`] is what they ask; the other files hold what they get, and what the languages make it with.

pub mod lines;
mod places;
mod text;
pub mod tokens;

use plcc_diag::SourceMap;

use crate::common::Accessed;

pub use places::{StatementPlace, StatementPlaces};
pub use text::{Block, Piece, Role, Row, rows};

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

    /// The text of the program as the manual has it shown. `sources` are those that the program was read from, `places`
    /// says where its statements stand in them.
    fn text(&self, sources: &SourceMap, places: &StatementPlaces) -> Vec<Row>;

    /// Whether a variable that a statement accessed (`accessed`, as [`name`](Self::name) gives it) is the one that a
    /// [piece](Piece::name) of its text names.
    fn is_written_as(&self, accessed: &str, piece: &str) -> bool {
        accessed == piece
    }

    /// The row in which a task waits to users, if it was suspended after a statement in a row: a PMAC waits at the WHILE
    /// of the loop.
    fn waits_in(&self, _rows: &[Row], row: usize) -> usize {
        row
    }

    /// The name of the task that a row belongs to, where the text says so. `None` where its statements have to be executed
    /// to know.
    fn task_of(&self, _rows: &[Row], _row: usize) -> Option<String> {
        None
    }
}
