//! What an executive knows of a program.

use alloc::{string::String, vec::Vec};

use serde::{Deserialize, Serialize};

use crate::{nct::NctTables, pmac::PmacTables, pmi::PmiTables};

/// A language, and with it a control.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Dialect {
    /// Sieb & Meyer SERIES 8.
    Pmi,
    /// NCT.
    Nct,
    /// Delta Tau PMAC and Turbo PMAC.
    Pmac,
}

impl Dialect {
    /// The name on the command line and in dumps.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pmi => "pmi",
            Self::Nct => "nct",
            Self::Pmac => "pmac",
        }
    }
}

/// A stretch of the process image that holds one kind of state. Accesses to different regions
/// never touch the same byte.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Region {
    /// Its name, a word of letters, digits and `_`.
    pub name: String,
    /// Offset in the image; a multiple of 8.
    pub offset: u32,
    /// Length in bytes.
    pub size: u32,
    /// Every byte of it is 0 or 1 and is accessed as such only.
    pub bits: bool,
}

/// Something an executive can call.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Task {
    /// Its name as users know it: `scan`, `:001`, `PLC3`.
    pub name: String,
    /// The label at which it starts.
    pub entry: u32,
}

/// A program without its code: all that an executive needs besides an [`Engine`](crate::Engine).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Program {
    /// The sources' names as given, the first being the program's.
    pub files: Vec<String>,
    /// Length of the process image in bytes.
    pub image_size: u32,
    /// What the image consists of, by rising offset.
    pub regions: Vec<Region>,
    /// What can be called; engines know tasks by their index here.
    pub tasks: Vec<Task>,
    /// What only the dialect's executive understands.
    pub tables: Tables,
}

/// The part of a program that only its dialect's executive understands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Tables {
    /// For PMI's executive.
    Pmi(PmiTables),
    /// For NCT's executive.
    Nct(NctTables),
    /// For PMAC's executive.
    Pmac(PmacTables),
}

impl Program {
    /// The program's dialect.
    pub fn dialect(&self) -> Dialect {
        match self.tables {
            Tables::Pmi(_) => Dialect::Pmi,
            Tables::Nct(_) => Dialect::Nct,
            Tables::Pmac(_) => Dialect::Pmac,
        }
    }

    /// The region of a name.
    pub fn region(&self, name: &str) -> Option<&Region> {
        self.regions.iter().find(|region| region.name == name)
    }
}
