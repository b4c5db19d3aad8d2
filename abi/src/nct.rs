//! What NCT's executive knows of a program.

use serde::{Deserialize, Serialize};

/// The tables of an NCT program.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NctTables {}
