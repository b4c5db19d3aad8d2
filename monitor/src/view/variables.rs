//! The watch list and the PMAC terminal.

use serde::{Deserialize, Serialize};

use crate::Format;

/// What the machine file says of a variable (`[names]`); each text may be empty.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Said {
    /// Its other name.
    pub alias: String,
    /// What it is.
    pub text: String,
    /// The device that is wired to it.
    pub device: String,
    /// The terminal.
    pub at: String,
}

/// The watch list.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct VariablesView {
    /// The lists of this program that are kept under a name.
    pub lists: Vec<String>,
    /// The one that is shown.
    pub list: String,
    /// Its rows.
    pub rows: Vec<VariableRow>,
    /// At which moment the values were read, for people.
    pub moment: String,
}

/// A variable that is watched.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct VariableRow {
    /// The entry of the list that it belongs to: what
    /// [`Command::Unwatch`](crate::Command::Unwatch) takes. One entry may have several rows.
    pub entry: String,
    /// The variable.
    pub name: String,
    /// What it is within its entry: `delayed contact`, `timer counter`; or what it means to the control, or the name by which the
    /// entry has it.
    pub title: Option<String>,
    /// What the machine file says of it.
    pub said: Said,
    /// The value in the format that was chosen; `None` where the program has no such variable.
    pub value: Option<String>,
    /// The format.
    pub format: Format,
    /// Whether the value is 0 or 1.
    pub logical: bool,
    /// Whether it is forced.
    pub forced: bool,
    /// Whether the value is another one than when the view was made last.
    pub changed: bool,
}

/// The PMAC terminal.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TerminalView {
    /// What was typed and answered, the newest last.
    pub lines: Vec<TerminalLine>,
}

/// A line of the terminal.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TerminalLine {
    /// Whether the user has typed it.
    pub typed: bool,
    /// Its text.
    pub text: String,
}
