//! Which bits a variable has, so that two of them can be known to overlap.

use plcc_abi::nct::{LINE_BYTES, NctName};
use plcc_abi::place::Place;
use plcc_abi::{DialectVariable, place::Direction};

use crate::names::Names;
use crate::variable::VariableKey;

/// Where the NC's flags are thought to lie that have no place in the process image.
const NC_FLAGS: u32 = 0x8000_0000;

/// Up to 64 bits from a byte on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Bits {
    /// The byte.
    at: u32,
    mask: u64,
}

impl Bits {
    fn of_place(place: Place) -> Self {
        let width = u32::from(place.width).min(64);
        let mask = 1_u64.checked_shl(width).unwrap_or(0).wrapping_sub(1);
        Self { at: place.offset, mask: mask.checked_shl(place.bit.into()).unwrap_or(0) }
    }

    /// The bits of a flag or a word of flags of an NCT control that it sets from outside.
    fn of_flag(byte: u8, bit: Option<u8>, names: &dyn Names) -> Option<Self> {
        let first = if usize::from(byte) < LINE_BYTES {
            let name = NctName::P { byte, bit: Some(0) };
            names.properties(VariableKey(DialectVariable::Nct(name))).line?.offset
        } else {
            NC_FLAGS + u32::from(byte)
        };
        let mask = bit.map_or(0xFFFF, |bit| 1_u64.checked_shl(bit.into()).unwrap_or(0));
        Some(Self { at: first, mask })
    }

    /// The bits that are set when a variable is set; `None` where they are not known.
    pub(super) fn of(variable: VariableKey, names: &dyn Names) -> Option<Self> {
        if let DialectVariable::Nct(NctName::I { byte, bit } | NctName::P { byte, bit }) =
            variable.0
        {
            return Self::of_flag(byte, bit, names);
        }
        let properties = names.properties(variable);
        let place = match properties.direction {
            Direction::Input => properties.line.or(properties.value),
            _ => properties.value,
        };
        place.map(Self::of_place)
    }

    /// Whether two variables share a bit.
    pub(super) fn overlap(self, other: Self) -> bool {
        let shifted = |bits: Self, from: u32| {
            let distance = bits.at - from;
            if distance >= 8 { 0 } else { u128::from(bits.mask) << (distance * 8) }
        };
        let from = self.at.min(other.at);
        shifted(self, from) & shifted(other, from) != 0
    }

    /// The part of a value of these bits that another variable gets which shares some of them; `None` where it gets not all
    /// of its bits from it.
    pub(super) fn part_of(self, value: i64, other: Self) -> Option<i64> {
        let distance = other.at.checked_sub(self.at).filter(|distance| *distance < 8)?;
        let lowest = self.mask.trailing_zeros();
        let placed = u128::from(value as u64 & self.mask.checked_shr(lowest).unwrap_or(0));
        let placed = placed.checked_shl(lowest).unwrap_or(0);
        let mask = u128::from(other.mask) << (distance * 8);
        let covered = u128::from(self.mask) & mask == mask;
        let part = (placed & mask) >> (distance * 8) >> other.mask.trailing_zeros().min(63);
        covered.then_some(part as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::Bits;

    #[test]
    fn bits_overlap_where_they_share_one() {
        let bits = |at, mask| Bits { at, mask };
        assert!(bits(4, 0xFF00).overlap(bits(5, 1)));
        assert!(!bits(4, 0xFF).overlap(bits(5, 1)));
        assert!(!bits(4, 0xFF).overlap(bits(400, 0xFF)));
        assert!(bits(9, u64::MAX).overlap(bits(16, 0xFF)));
    }

    #[test]
    fn a_word_gives_its_bits_their_values() {
        let word = Bits { at: 40, mask: 0xFFFF };
        assert_eq!(word.part_of(0x0280, Bits { at: 40, mask: 0x80 }), Some(1));
        assert_eq!(word.part_of(0x0280, Bits { at: 41, mask: 0x02 }), Some(1));
        assert_eq!(word.part_of(0x0280, Bits { at: 41, mask: 0x01 }), Some(0));
        assert_eq!(Bits { at: 41, mask: 2 }.part_of(1, word), None);
        assert_eq!(Bits { at: 41, mask: 2 }.part_of(3, Bits { at: 41, mask: 2 }), Some(1));
    }
}
