//! Inputs and outputs.

/// An input or output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IoPoint {
    /// The variable.
    pub name: String,
    /// Where its lines are: port and bits, board and connection point, address.
    pub place: String,
    /// Whether it is an output.
    pub output: bool,
    /// Whether it can be 0 or 1 only.
    pub bit: bool,
    /// The names of its lines, the lowest first, where they can be read apart from the variable.
    pub lines: Vec<String>,
}
