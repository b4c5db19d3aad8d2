//! What a timer's contact or a flip-flop's output comes of.

/// A variable of which another one's value comes without a statement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// The variable, as traces spell it.
    pub name: String,
    /// Whether it holds the present value: with another value of it, alone or with others, the contact or output would be
    /// different, or would become so.
    pub holds: bool,
}
