//! Inputs and outputs with overrides (PMI 5.3).

use serde::{Deserialize, Serialize};

use super::Said;

/// Inputs and outputs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct IoView {
    /// The windows: outputs, inputs.
    pub windows: Vec<IoWindow>,
    /// Of which moment the values are, for people, where that is not the end of the tick that is shown.
    pub moment: Option<String>,
    /// The warning of PMI 5.3, as long as the user has not confirmed it.
    pub warning: Option<String>,
}

/// A window of inputs or of outputs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct IoWindow {
    /// Its title.
    pub title: String,
    /// Whether it has outputs.
    pub outputs: bool,
    /// The variables.
    pub rows: Vec<IoRow>,
}

/// An input or output.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct IoRow {
    /// The variable.
    pub name: String,
    /// What people call it and say of it, in one line; empty where nothing is known.
    pub text: String,
    /// The same in columns.
    pub said: Said,
    /// Where its lines are: port and bits, board and byte, address.
    pub place: String,
    /// What the program sees or assigns.
    pub logical: String,
    /// What its lines have; `None` where they can't be read apart from the variable.
    pub physical: Option<String>,
    /// The value that it is forced to.
    pub forced: Option<String>,
    /// Whether it can be 0 or 1 only.
    pub bit: bool,
    /// Whether the value is another one than when the view was made last.
    pub changed: bool,
}
