//! Panels, displays and tables of the control that the program works with: push-buttons with lamps, touch windows,
//! registers of the control's own screens (PMI 3.4; NCT 1, 2, 6.5, 6.6; PMAC guide, Executive Program).

use plcc_protocol::PanelCell;
use serde::{Deserialize, Serialize};

/// All panels of the program's control.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PanelsView {
    /// The panels. Those of whose variables the program has none are left out.
    pub panels: Vec<Panel>,
    /// Of which moment the values are, for people, where that is not the end of the tick that is shown.
    pub moment: Option<String>,
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
