//! Statements that put out a text.

/// A statement that puts out a text or gives a command when it is executed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextStatement {
    /// Its number among the program's statements.
    pub statement: u32,
    /// The text, as events have it.
    pub text: String,
}
