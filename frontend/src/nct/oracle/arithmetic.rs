//! Arithmetic on OP with the status flags that it writes (NCT 4.8, 4.9).

use plcc_abi::nct::arithmetic::{from_bcd, to_bcd};

use super::run::Run;
use crate::common::Observer;
use crate::nct::{
    ast::Arith,
    status_flags::{
        BCD_SIGN, CARRY, HIGH_WORD, MUL_OVERFLOW, NOT_BCD, OVERFLOW, SIGN, SYNTAX, ZERO,
    },
};

/// The 16-bit sum or difference and its carry or borrow.
pub(super) fn sum(op: Arith, a: u16, b: u16) -> (u16, bool) {
    if op == Arith::Add { a.overflowing_add(b) } else { a.overflowing_sub(b) }
}

impl<O: Observer> Run<'_, O> {
    /// Writes F0040, F0046 and F0047 of a sum or difference.
    pub(super) fn result_flags(&mut self, carry: bool, value: u16) {
        self.set(CARRY, carry);
        self.set(ZERO, value == 0);
        self.set(SIGN, value & 0x8000 != 0);
    }

    /// OP becomes `a` combined with `b`.
    pub(super) fn arith(&mut self, op: Arith, a: u16, b: u16) {
        self.op = match op {
            Arith::And => a & b,
            Arith::Or => a | b,
            Arith::Xor => a ^ b,
            Arith::Add | Arith::Sub => {
                let (value, carry) = sum(op, a, b);
                self.result_flags(carry, value);
                value
            }
            Arith::Mul => {
                let product = u32::from(a) * u32::from(b);
                let high = (product >> 16) as u16;
                self.set_word(HIGH_WORD, high);
                self.set(MUL_OVERFLOW, high != 0);
                product as u16
            }
            Arith::Div => {
                let dividend = u32::from(self.word(HIGH_WORD)) << 16 | u32::from(a);
                let divisor = u32::from(b);
                self.set(SYNTAX, divisor == 0);
                if divisor == 0 {
                    a
                } else {
                    self.set_word(HIGH_WORD, (dividend % divisor) as u16);
                    (dividend / divisor) as u16
                }
            }
        };
    }

    /// BCD to binary; the result is negative if F0087 is 1.
    pub(super) fn bin(&mut self) {
        let Some(value) = from_bcd(self.op) else { return self.set(NOT_BCD, true) };
        let value = if self.bit(BCD_SIGN) { value.wrapping_neg() } else { value };
        self.op = value;
        self.set(NOT_BCD, false);
        self.set(ZERO, value == 0);
        self.set(SIGN, value & 0x8000 != 0);
    }

    /// Binary to BCD.
    pub(super) fn bcd(&mut self) {
        let signed = self.op.cast_signed();
        let value = signed.unsigned_abs();
        self.set(OVERFLOW, value > 9999);
        if value <= 9999 {
            self.op = to_bcd(value);
            self.set(ZERO, value == 0);
            self.set(SIGN, signed < 0);
        }
    }
}
