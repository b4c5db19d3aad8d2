//! The rows of a watch list.

/// How many rows an entry has at most.
pub const MAX_ROWS: u32 = 1024;

/// A row of the watch list. An entry such as `A[2-5]` has several.
#[derive(Clone, Debug, PartialEq)]
pub struct WatchRow {
    /// The variable, by its name.
    pub name: String,
    /// What it is to the entry: the control contact of a timer.
    pub title: Option<&'static str>,
    /// The value, for a row that is not a variable: the delay of a timer.
    pub fixed: Option<f64>,
}

impl WatchRow {
    /// The row of a variable.
    pub fn of(name: impl Into<String>) -> Self {
        Self { name: name.into(), title: None, fixed: None }
    }

    /// The same with a title.
    pub fn titled(name: impl Into<String>, title: &'static str) -> Self {
        Self { title: Some(title), ..Self::of(name) }
    }
}
