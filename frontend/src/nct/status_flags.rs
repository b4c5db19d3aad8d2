//! The status flags, and the word in F, that arithmetic statements write (NCT 2.3.1).

use crate::nct::ast::{Bit, Space, Word};

/// A bit of F by its four digits.
const fn flag(digits: u16) -> Bit {
    Bit { space: Space::F, byte: digits / 10, bit: (digits % 10) as u8 }
}

/// F0040: carry of an addition, borrow of a subtraction.
pub(crate) const CARRY: Bit = flag(40);
/// F0046: the result is zero.
pub(crate) const ZERO: Bit = flag(46);
/// F0047: the result is negative.
pub(crate) const SIGN: Bit = flag(47);
/// F0053: the result does not fit.
pub(crate) const OVERFLOW: Bit = flag(53);
/// F0080: the statement was not done, since its operand is not valid.
pub(crate) const SYNTAX: Bit = flag(80);
/// F0081: a search has not found its item.
pub(crate) const NOT_FOUND: Bit = flag(81);
/// F0082: a digit is not decimal.
pub(crate) const NOT_BCD: Bit = flag(82);
/// F0083: a product does not fit in 16 bits; its high word is not 0.
pub(crate) const MUL_OVERFLOW: Bit = flag(83);
/// F0087: the sign of the number that BIN converts.
pub(crate) const BCD_SIGN: Bit = flag(87);

/// The bytes of F that hold these flags.
pub(crate) const STATUS_BYTES: [u16; 3] = [CARRY.byte, OVERFLOW.byte, SYNTAX.byte];

/// F000 and F001: the high word of a product or of a dividend. A division leaves its remainder
/// there.
pub(crate) const HIGH_WORD: Word = Word::Bytes { space: Space::F, byte: 0 };
