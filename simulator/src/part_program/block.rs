//! A block: what its words say.

use plcc_abi::pmi::DeclaredCode;

use crate::arc::{Given, Plane};

/// How the axes of a block move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) enum Motion {
    /// G0.
    Rapid,
    /// G1.
    Line,
    /// G2.
    Clockwise,
    /// G3.
    Counterclockwise,
    /// G33: F is the way of a revolution (NCT).
    Thread,
}

/// What a block does with its axes instead of going straight to their words (NCT).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cycle {
    /// G28: to its words, and to the reference point.
    Home,
    /// G74, G84: tapping.
    Tap,
}

impl Motion {
    /// Whether it is an arc.
    pub(crate) fn is_arc(self) -> bool {
        matches!(self, Self::Clockwise | Self::Counterclockwise)
    }
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
    /// G0 to G3.
    pub(crate) motion: Option<Motion>,
    /// G28, G74, G84.
    pub(crate) cycle: Option<Cycle>,
    /// G81.1 (true), G80.
    pub(crate) chopping: Option<bool>,
    /// G17 to G19.
    pub(crate) plane: Option<Plane>,
    /// I, J and K.
    pub(crate) centre: [Option<i128>; 3],
    /// R.
    pub(crate) radius: Option<i128>,
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
    /// How its arc is given, in a plane.
    pub(crate) fn arc(&self, plane: Plane) -> Option<Given> {
        if let Some(radius) = self.radius {
            return Some(Given::Radius(radius));
        }
        self.centre.iter().any(Option::is_some).then(|| {
            let word = |at: usize| self.centre.get(at).copied().flatten().unwrap_or(0);
            Given::Centre(plane.centre().map(word))
        })
    }

    /// Whether it moves axes at all.
    pub(crate) fn moves(&self) -> bool {
        !self.axes.is_empty() || self.radius.is_some() || self.centre.iter().any(Option::is_some)
    }

    /// Whether it ends the program.
    pub(crate) fn ends_program(&self) -> bool {
        self.m.iter().any(|m| matches!(m, 2 | 30))
    }
}
