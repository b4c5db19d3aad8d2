//! What a statement accesses, as observers are told: bits, words of bits, and registers. Each of the letters in front of a
//! name has an area. Bit `b` of byte `n` is the place `8 * n + b`, a word is the 16 bits from its byte on.

use plcc_abi::nct::NctName;

use super::ast::{Bit, Variable};
use super::tables;
use crate::common::Accessed;

/// The bits of a word.
const WORD: u32 = 16;

/// The area of the bits of V, which say that an input has changed since the module ran before. They have no place of
/// their own in the image.
const CHANGES: u32 = 12;
/// The area of the values of OP that brackets keep.
const SLOTS: u32 = 13;

/// The place of a bit that a condition tests.
pub(super) fn accessed_bit(bit: Bit) -> Accessed {
    match tables::name(Variable::Bit(bit)) {
        Some(name) => accessed(name),
        None => Accessed::one(CHANGES, u32::from(bit.byte) * 8 + u32::from(bit.bit)),
    }
}

/// The bit of I whose changes a place tells of; `None` for all places but those of V.
pub(super) fn changed_bit(accessed: Accessed) -> Option<NctName> {
    let Accessed { area, first, .. } = accessed;
    let byte = u8::try_from(first / 8).ok().filter(|_| area == CHANGES)?;
    Some(NctName::I { byte, bit: Some((first % 8) as u8) })
}

/// The value of OP that brackets keep in a slot.
pub(super) fn slot(slot: u16) -> Accessed {
    Accessed::one(SLOTS, slot.into())
}

/// Whether a place holds what one statement hands to the next: OP, and its values that brackets keep.
pub(super) fn is_handed_on(accessed: Accessed) -> bool {
    accessed.area == SLOTS || matches!(name(accessed), Some(NctName::Op(_)))
}

/// The place of a variable.
pub(super) fn accessed(name: NctName) -> Accessed {
    let bits = |area: u32, byte: u32, bit: Option<u8>| match bit {
        Some(bit) => Accessed::one(area, byte * 8 + u32::from(bit)),
        None => Accessed { area, first: byte * 8, count: WORD },
    };
    match name {
        NctName::I { byte, bit } => bits(0, byte.into(), bit),
        NctName::Y { byte, bit } => bits(1, byte.into(), bit),
        NctName::P { byte, bit } => bits(2, byte.into(), bit),
        NctName::O { byte, bit } => bits(3, byte.into(), bit),
        NctName::F { byte, bit } => bits(4, byte.into(), bit),
        NctName::Rh(number) => Accessed::one(5, number.into()),
        NctName::Q(number) => Accessed::one(6, number.into()),
        NctName::T(number) => Accessed::one(7, number.into()),
        NctName::H(number) => Accessed::one(8, number.into()),
        NctName::M(number) => Accessed::one(9, number.into()),
        NctName::Rp(number) => Accessed::one(10, number.into()),
        NctName::Op(module) => Accessed::one(11, module.into()),
    }
}

/// The variable at a place; `None` if there is none.
pub(super) fn name(accessed: Accessed) -> Option<NctName> {
    let Accessed { area, first, count } = accessed;
    let bit = if count == 1 { Some((first % 8) as u8) } else { None };
    let byte = u8::try_from(first / 8);
    let number = u8::try_from(first);
    Some(match area {
        0 => NctName::I { byte: byte.ok()?, bit },
        1 => NctName::Y { byte: byte.ok()?, bit },
        2 => NctName::P { byte: byte.ok()?, bit },
        3 => NctName::O { byte: byte.ok()?, bit },
        4 => NctName::F { byte: u16::try_from(first / 8).ok()?, bit },
        5 => NctName::Rh(u16::try_from(first).ok()?),
        6 => NctName::Q(number.ok()?),
        7 => NctName::T(number.ok()?),
        8 => NctName::H(number.ok()?),
        9 => NctName::M(number.ok()?),
        10 => NctName::Rp(number.ok()?),
        11 => NctName::Op(number.ok()?),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Accessed {
        accessed(text.parse().unwrap())
    }

    #[test]
    fn a_word_meets_its_bits() {
        let concerns = |one: &str, other: &str| of(one).meets(of(other));
        assert!(concerns("F0203", "F020"));
        assert!(concerns("F0213", "F020"));
        assert!(concerns("F020", "F0207"));
        assert!(!concerns("F0223", "F020"));
        assert!(!concerns("Y012", "I012"));
        assert!(concerns("RH060", "RH060") && !concerns("RH060", "RH061"));
    }

    #[test]
    fn places_have_the_names_that_they_are_of() {
        for text in
            ["I012", "I01", "Y997", "P00", "O397", "F9990", "F020", "RH199", "Q31", "T49", "OP2"]
        {
            assert_eq!(name(of(text)).unwrap().to_string(), text);
        }
    }
}
