//! What PMAC's executive knows of a program.

use serde::{Deserialize, Serialize};

/// The tables of a PMAC download.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PmacTables {}
