//! Fields of integers, and how they are read.

use crate::Type;
use crate::words::words;

words! {
    /// Ways to read a field of an integer as an integer of the same type.
    ExtractOp {
        /// As an unsigned number: filled with zeros.
        Unsigned = "extract_u",
        /// As a signed number: filled with copies of the field's highest bit.
        Signed = "extract_s",
    }
}

/// A field of an integer: bits that are side by side. The verifier sees that it has at least one bit, and none beyond those
/// of the integer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Field {
    /// The number of its lowest bit, from 0 for that of the integer.
    pub first: u8,
    /// How many bits it has.
    pub width: u8,
}

impl Field {
    /// The field that consists of one bit.
    pub fn bit(number: u8) -> Self {
        Self { first: number, width: 1 }
    }

    /// All bits of a type.
    pub fn whole(ty: Type) -> Self {
        Self { first: 0, width: ty.bits() as u8 }
    }

    /// Whether integers of a type have the field.
    pub fn fits(self, ty: Type) -> bool {
        let end = u32::from(self.first) + u32::from(self.width);
        ty.is_int() && ty != Type::I1 && self.width > 0 && end <= ty.bits()
    }

    /// As many ones as the field has bits: the greatest number that it can hold.
    pub fn ones(self) -> u64 {
        u64::MAX >> 64u32.saturating_sub(self.width.into()).min(63)
    }

    /// Ones in the place of the field, and zeros elsewhere.
    pub fn mask(self) -> u64 {
        self.ones().checked_shl(self.first.into()).unwrap_or(0)
    }
}
