//! What an executive knows of a program: [`Program`], a list of files, regions and tasks, and the
//! [`Tables`] of its language.

use alloc::{string::String, vec::Vec};

use serde::{Deserialize, Serialize};

use crate::{BitField, GivenName, ImageSymbol, nct::NctTables, pmac::PmacTables, pmi::PmiTables};

/// What the tables of every language say.
pub trait DialectTables {
    /// A variable, an array or an element of one, as the names of the language mean it.
    type Variable;

    /// Whether the number at the end of a name counts bits of bytes, so that 8 and 9 are not last digits: `I007` is followed by
    /// `I010`.
    const NAMES_END_IN_BITS: bool = false;

    /// As [`Tables::symbols`].
    fn symbols(&self) -> Vec<ImageSymbol>;

    /// As [`Tables::bit_fields`].
    fn bit_fields(&self) -> Vec<BitField> {
        Vec::new()
    }
}

/// A name of the simulator, which takes the machine's place with `--simulate`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum SimulatorVariable {
    /// `SIM.LINE`: the line of the block that is executed.
    Line,
    /// `SIM.name`: the device with this number.
    Device(u32),
    /// `KEY.name`: the key with this number.
    Key(u32),
}

/// Writes [`Dialect`], [`Tables`], [`DialectVariable`] and `for_tables!` from one list of the languages, so that none can be in one and
/// not in the others.
macro_rules! dialects {
    ($d:tt $($(#[$doc:meta])* $variant:ident, $name:literal, $tables:ty;)*) => {
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

            /// As [`DialectTables::NAMES_END_IN_BITS`].
            pub fn names_end_in_bits(self) -> bool {
                match self {
                    $(Self::$variant => <$tables as DialectTables>::NAMES_END_IN_BITS,)*
                }
            }
        }

        /// The part of a program that only the executive of its language understands.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        pub enum Tables {
            $($(#[$doc])* $variant($tables),)*
        }

        /// A variable of a program, as its language means it.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
        pub enum DialectVariable {
            $($(#[$doc])* $variant(<$tables as DialectTables>::Variable),)*
            /// None of the program's: a name of the other side (`--simulate`).
            Simulator(SimulatorVariable),
        }

        impl Tables {
            /// The language that the tables belong to.
            pub fn dialect(&self) -> Dialect {
                match self {
                    $(Self::$variant(_) => Dialect::$variant,)*
                }
            }
        }

        /// Does the same with the tables of whichever language: `for_tables!(tables, own => own.symbols())`.
        #[macro_export]
        macro_rules! for_tables {
            ($d tables:expr, $d own:ident => $d result:expr) => {
                match $d tables {
                    $($crate::Tables::$variant($d own) => $d result,)*
                }
            };
        }
    };
}

dialects! { $
    /// Sieb & Meyer SERIES 8.
    Pmi, "pmi", PmiTables;
    /// NCT.
    Nct, "nct", NctTables;
    /// Delta Tau PMAC and Turbo PMAC.
    Pmac, "pmac", PmacTables;
}

impl Tables {
    /// The variables of a program that are parts of words, as they are when the program is loaded:
    /// PMAC's M and L whose definition names bits of a word that lies in the image, unless it reads the
    /// bits as decimal digits. The program may define an M-variable anew while it runs.
    pub fn bit_fields(&self) -> Vec<BitField> {
        for_tables!(self, own => own.bit_fields())
    }

    /// The variables of a program that lie in its image, in the order of its tables. Variables
    /// whose place may change while the program runs (PMAC's M and L) are not among them.
    pub fn symbols(&self) -> Vec<ImageSymbol> {
        for_tables!(self, own => own.symbols())
    }
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
    /// What people call the variables and say of them. Of two with one alias, or for one variable, the first counts.
    pub names: Vec<GivenName>,
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
