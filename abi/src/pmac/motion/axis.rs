//! The nine axes of a coordinate system.

use serde::{Deserialize, Serialize};

/// An axis, in the order of the registers of their targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[repr(u8)]
pub enum Axis {
    /// A.
    A = 0,
    /// B.
    B,
    /// C.
    C,
    /// U.
    U,
    /// V.
    V,
    /// W.
    W,
    /// X.
    X,
    /// Y.
    Y,
    /// Z.
    Z,
}

impl Axis {
    /// All of them, in their order.
    pub const ALL: [Self; 9] =
        [Self::A, Self::B, Self::C, Self::U, Self::V, Self::W, Self::X, Self::Y, Self::Z];

    /// The axis of a letter, in any case.
    pub fn from_letter(letter: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|axis| axis.letter() == letter.to_ascii_uppercase())
    }

    /// Its letter.
    pub const fn letter(self) -> u8 {
        match self {
            Self::A => b'A',
            Self::B => b'B',
            Self::C => b'C',
            Self::U => b'U',
            Self::V => b'V',
            Self::W => b'W',
            Self::X => b'X',
            Self::Y => b'Y',
            Self::Z => b'Z',
        }
    }

    /// Which of the three scale factors of a motor is this axis's (guide, appendix E).
    pub const fn slot(self) -> usize {
        match self {
            Self::V | Self::Y => 1,
            Self::W | Self::Z => 2,
            Self::A | Self::B | Self::C | Self::U | Self::X => 0,
        }
    }
}

/// A set of axes, and of the vector R of circles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AxisSet(pub u16);

impl AxisSet {
    /// The nine axes, without R.
    pub const AXES: Self = Self(0x1FF);
    /// R alone.
    pub const R: Self = Self(1 << 9);
    /// No axis.
    pub const NONE: Self = Self(0);
    /// X, Y and Z, which make up the feedrate at power-up.
    pub const XYZ: Self = Self(0x1C0);

    /// Whether an axis is in it.
    pub const fn has(self, axis: Axis) -> bool {
        self.0 & (1 << axis as u16) != 0
    }

    /// Whether R is in it.
    pub const fn has_r(self) -> bool {
        self.0 & Self::R.0 != 0
    }

    /// The set with one axis more.
    #[must_use]
    pub const fn with(self, axis: Axis) -> Self {
        Self(self.0 | 1 << axis as u16)
    }

    /// The axes of both sets.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The axes of this set that are not in another one.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }
}

/// Which axes a motor may be assigned to together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum AxisGroup {
    /// One of A, B and C.
    Single(Axis),
    /// X, Y and Z, by their scale factors.
    Xyz,
    /// U, V and W, by their scale factors.
    Uvw,
    /// The kinematics of Turbo PMAC.
    Kinematics,
}

impl AxisGroup {
    /// The axis of one of the three scale factors; `None` where it has none.
    pub const fn axis(self, slot: usize) -> Option<Axis> {
        match (self, slot) {
            (Self::Single(axis), 0) => Some(axis),
            (Self::Xyz, 0) => Some(Axis::X),
            (Self::Xyz, 1) => Some(Axis::Y),
            (Self::Xyz, 2) => Some(Axis::Z),
            (Self::Uvw, 0) => Some(Axis::U),
            (Self::Uvw, 1) => Some(Axis::V),
            (Self::Uvw, 2) => Some(Axis::W),
            _ => None,
        }
    }
}

/// The assignment of a motor to axes: `#1->2000X`. The scale factors and the offset are in registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AxisDefinition {
    /// The coordinate system, from 1.
    pub system: u8,
    /// The axes.
    pub group: AxisGroup,
}
