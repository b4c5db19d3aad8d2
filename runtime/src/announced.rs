//! The faults and messages that are on.

/// A fault or message that is on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Announced {
    /// Whether it is a fault.
    pub is_fault: bool,
    /// The variable or flag.
    pub name: String,
    /// Its text with the present values.
    pub text: String,
}
