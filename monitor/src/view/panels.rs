//! Panels, displays and tables of the control that the program works with: push-buttons with lamps, touch windows,
//! registers of the control's own screens (PMI 3.4; NCT 1, 2, 6.5, 6.6; PMAC guide, Executive Program).

use serde::{Deserialize, Serialize};

use super::Active;

/// All panels of the program's control.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PanelsView {
    /// The panels. Those of whose variables the program has none are left out.
    pub panels: Vec<Panel>,
    /// Of which moment the values are, for people, where that is not the end of the tick that is shown.
    pub moment: Option<String>,
}

/// What an operator sees: what is announced, and the keys, lamps and overrides that the program uses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OperatorView {
    /// Faults and messages that are on.
    pub active: Vec<Active>,
    /// Overrides and other percentages.
    pub overrides: Vec<PanelCell>,
    /// Push-buttons and lamps.
    pub keys: Vec<PanelCell>,
}

/// A panel: cells in rows from the upper left.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Panel {
    /// Its title.
    pub title: String,
    /// How many cells a row has.
    pub columns: usize,
    /// The cells, row by row.
    pub cells: Vec<PanelCell>,
    /// What should be known of it.
    pub note: Option<String>,
}

/// A push-button, a lamp, or a value.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PanelCell {
    /// What it is called; empty for a place without anything.
    pub label: String,
    /// Its value or text.
    pub value: Option<String>,
    /// Whether its lamp is on; `None` if it has none.
    pub light: Option<bool>,
    /// Whether its push-button is pressed; `None` if it is none.
    pub pressed: Option<bool>,
    /// The variable that a press, or a new value, sets. `None` if nothing can be set.
    pub variable: Option<String>,
    /// Whether the value is not in use, so that it is shown less clearly.
    pub dim: bool,
    /// What a press sets once, and to what: a command, which has no state. `None` while the past is shown, where none is given.
    pub command: Option<(String, String)>,
}

impl PanelCell {
    /// What a press sets, and to what: a push-button that is pressed is released. `None` if the cell can't be pressed.
    pub fn press(&self) -> Option<(String, String)> {
        let pressed = || Some((self.variable.clone()?, self.pressed?));
        let button = || pressed().map(|(name, on)| (name, if on { "0" } else { "1" }.to_owned()));
        self.command.clone().or_else(button)
    }
}
