//! What an executive knows of a program: [`Program`], a list of files, regions and tasks, and the
//! [`Tables`] of its language.

use alloc::{string::String, vec::Vec};

use serde::{Deserialize, Serialize};

use crate::{nct::NctTables, pmac::PmacTables, pmi::PmiTables};

/// Writes [`Dialect`] and [`Tables`] from one list of the languages, so that none can be in one and
/// not in the other.
macro_rules! dialects {
    ($($(#[$doc:meta])* $variant:ident, $name:literal, $tables:ty;)*) => {
        /// A language, and with it the control that runs its programs.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
        #[serde(rename_all = "lowercase")]
        pub enum Dialect {
            $($(#[$doc])* $variant,)*
        }

        impl Dialect {
            /// Every language, in the order of the list.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// The name on the command line and in dumps, in small letters.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }

        /// The part of a program that only the executive of its language understands.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        pub enum Tables {
            $($(#[$doc])* $variant($tables),)*
        }

        impl Tables {
            /// The language that the tables belong to.
            pub fn dialect(&self) -> Dialect {
                match self {
                    $(Self::$variant(_) => Dialect::$variant,)*
                }
            }
        }
    };
}

dialects! {
    /// Sieb & Meyer SERIES 8.
    Pmi, "pmi", PmiTables;
    /// NCT.
    Nct, "nct", NctTables;
    /// Delta Tau PMAC and Turbo PMAC.
    Pmac, "pmac", PmacTables;
}

/// A part of the process image that holds one kind of state. Regions do not overlap.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Region {
    /// Its name, a word of letters, digits and `_`.
    pub name: String,
    /// Offset in the image; a multiple of 8.
    pub offset: u32,
    /// Length in bytes.
    pub size: u32,
    /// Whether every byte of it is 0 or 1, and is read and written as such only.
    pub bits: bool,
}

/// A unit of a program that is scanned by itself: what an executive has an engine call.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Task {
    /// Its name as users know it: `scan`, `:001`, `PLC3`.
    pub name: String,
    /// The number of the label at which it starts.
    pub entry: u32,
    /// The numbers of the labels at which a suspended scan of it goes on, in the source's order:
    /// the label of [`ResumePoint(n)`](crate::ResumePoint) is the n-th.
    pub resume_points: Vec<u32>,
}

/// A program without its code: all that an executive needs apart from an [`Engine`](crate::Engine).
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

impl Program {
    /// The program's dialect.
    pub fn dialect(&self) -> Dialect {
        self.tables.dialect()
    }

    /// The region with a name; `None` if there is none.
    pub fn region(&self, name: &str) -> Option<&Region> {
        self.regions.iter().find(|region| region.name == name)
    }
}
