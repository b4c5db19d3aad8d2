//! A block: what its words say.

use plcc_abi::pmi::DeclaredCode;

/// How the axes of a block move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) enum Motion {
    /// G0.
    Rapid,
    /// G1.
    Line,
}

/// A speed in nanometres a minute.
pub(crate) type Feed = i128;

/// What G61 to G66 give an auxiliary axis (PMI 3.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AuxMove {
    /// The number of the axis, from 0.
    pub(crate) axis: u8,
    /// X, in nanometres.
    pub(crate) position: Option<i128>,
    /// F.
    pub(crate) feed: Option<Feed>,
}

impl AuxMove {
    /// Whether a declared code is the one that gives it.
    pub(crate) fn is_of(&self, code: &DeclaredCode) -> bool {
        code.letter == 'G' && code.number == 61 + u16::from(self.axis)
    }
}

/// A block.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Block {
    /// Its line, from 1; of an entered block its number.
    pub(crate) line: u32,
    /// The number of `/n`, 0 without.
    pub(crate) skip: u8,
    /// G0 or G1.
    pub(crate) motion: Option<Motion>,
    /// G90 (true) or G91.
    pub(crate) absolute: Option<bool>,
    /// The axes that are named, each with its word in nanometres.
    pub(crate) axes: Vec<(usize, i128)>,
    /// F.
    pub(crate) feed: Option<Feed>,
    /// G4: the time in nanoseconds.
    pub(crate) dwell: Option<u64>,
    /// M codes in the order written.
    pub(crate) m: Vec<u16>,
    /// S.
    pub(crate) s: Option<u32>,
    /// T.
    pub(crate) t: Option<u32>,
    /// The functions A, B and C.
    pub(crate) functions: [Option<u32>; 3],
    /// The codes that the program declares, by their numbers in its list, M before G.
    pub(crate) codes: Vec<u16>,
    /// G61 to G66.
    pub(crate) aux: Option<AuxMove>,
}

impl Block {
    /// Whether it ends the program.
    pub(crate) fn ends_program(&self) -> bool {
        self.m.iter().any(|m| matches!(m, 2 | 30))
    }
}
