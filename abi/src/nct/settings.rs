//! What a particular machine has and is set to.

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

/// The type of control; it says how often module :002 runs (NCT 1.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum NctControl {
    Nct98,
    Nct99,
    Nct2000,
    Nct990,
    Nct100,
    Nct115,
    Nct101,
    #[default]
    Nct104,
}

impl NctControl {
    /// Every type.
    pub const ALL: [Self; 8] = [
        Self::Nct98,
        Self::Nct99,
        Self::Nct2000,
        Self::Nct990,
        Self::Nct100,
        Self::Nct115,
        Self::Nct101,
        Self::Nct104,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nct98 => "nct98",
            Self::Nct99 => "nct99",
            Self::Nct2000 => "nct2000",
            Self::Nct990 => "nct990",
            Self::Nct100 => "nct100",
            Self::Nct115 => "nct115",
            Self::Nct101 => "nct101",
            Self::Nct104 => "nct104",
        }
    }

    /// Finds a type by its name, in letters of any case.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|control| control.name().eq_ignore_ascii_case(name))
    }

    /// Milliseconds between two runs of module :002.
    pub fn period_ms(self) -> u64 {
        match self {
            Self::Nct98 | Self::Nct99 | Self::Nct2000 => 5,
            Self::Nct990 | Self::Nct100 | Self::Nct115 => 2,
            Self::Nct101 | Self::Nct104 => 1,
        }
    }
}

/// The first content of one place of the tool magazine (NCT 2.3.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ToolPot {
    /// The pot; 0 is the spindle.
    pub pot: u16,
    /// The tool in it, 0 to 16383, 0 where there is none.
    pub tool: u16,
    /// How many pots a tool there needs: 1, 3, 5 or 7.
    pub width: u8,
}

impl ToolPot {
    /// The pot's word in the table: the tool's number below, the width's code in bits 14 and 15.
    pub fn word(self) -> u16 {
        let code = (self.width.saturating_sub(1) / 2) & 3;
        (self.tool & 0x3FFF) | (u16::from(code) << 14)
    }
}

/// What a machine is set to: the machine file's, with the command line's over it. Where a number
/// is there twice, the last counts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NctSettings {
    /// The type of control.
    pub control: NctControl,
    /// How many interface boards there are, where it is said.
    pub boards: Option<u8>,
    /// NC parameters by number (61 MAGAZINE, 62 PLC_TAB); the others are 0.
    pub parameters: Vec<(u16, i64)>,
    /// PLC constants by number, 1 to 40; the others are 0.
    pub constants: Vec<(u16, u16)>,
    /// Macro variables by number; the others are vacant.
    pub macros: Vec<(u16, f64)>,
    /// The tool pot table's first content.
    pub tool_pots: Vec<ToolPot>,
}
