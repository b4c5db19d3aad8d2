//! What is said of a control beside its tasks.

/// Something that is shown of a control.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fact {
    /// What it is.
    pub title: String,
    /// Its value.
    pub value: String,
}
