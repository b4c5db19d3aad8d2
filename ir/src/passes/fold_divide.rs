//! Divides by constants without dividing: with a product of 64 bits and a shift.
//!
//! For a dividend of `n` bits and a divisor `d`, `d <= 2^l`, the factor is `2^(n+l) / d` rounded
//! up. It is too large by less than one part in `2^n`, so the quotient is too large by less than
//! `1/d` and its integer part right; that of a negative dividend is one too small.

use super::fold::{Fold, Simpler};
use super::known::mask;
use crate::{BinaryOp, ConvertOp, InstData, Type, Value};

impl Fold<'_> {
    /// A quotient or remainder of an integer of at most 32 bits by a constant other than 0 and 1.
    pub(super) fn divide(&mut self, op: BinaryOp, ty: Type, a: Value, c: i64) -> Option<Simpler> {
        if ty.bits() > 32 {
            return None;
        }
        let sign = 1 << (ty.bits() - 1);
        let ones = self.known.ones(a);
        let signed = matches!(op, BinaryOp::Sdiv | BinaryOp::Srem) && (ones & sign != 0 || c < 0);
        let size = if signed { c.unsigned_abs() } else { c as u64 & mask(ty) };
        let quotient = if signed { self.signed(ty, a, size)? } else { self.unsigned(ty, a, size)? };
        match op {
            BinaryOp::Sdiv if c < 0 => Some(Simpler::unary(crate::UnaryOp::Neg, quotient)),
            BinaryOp::Sdiv | BinaryOp::Udiv => Some(Simpler::Same(quotient)),
            _ => {
                let product = self.with(BinaryOp::Mul, ty, quotient, size as i64)?;
                Some(Simpler::binary(BinaryOp::Sub, a, product))
            }
        }
    }

    /// The quotient of a number that is not negative.
    fn unsigned(&mut self, ty: Type, a: Value, by: u64) -> Option<Value> {
        let bits = u64::BITS - self.known.ones(a).leading_zeros();
        // One bit more, and the product may not fit.
        if bits > 31 || by < 2 {
            return None;
        }
        self.shifted(BinaryOp::Lshr, ConvertOp::Zext, ty, a, (bits, by))
    }

    /// The quotient towards 0 by a magnitude.
    fn signed(&mut self, ty: Type, a: Value, by: u64) -> Option<Value> {
        let bits = ty.bits() - 1;
        let negative = self.with(BinaryOp::Lshr, ty, a, i64::from(bits))?;
        if by.is_power_of_two() {
            if by < 2 || by.trailing_zeros() >= bits {
                return None;
            }
            let shift = i64::from(by.trailing_zeros());
            let all = self.with(BinaryOp::Ashr, ty, a, i64::from(bits))?;
            let rest = self.with(BinaryOp::Lshr, ty, all, i64::from(ty.bits()) - shift)?;
            let args = [a, rest];
            let sum = self.insert(InstData::Binary { op: BinaryOp::Add, args })?;
            return self.with(BinaryOp::Ashr, ty, sum, shift);
        }
        let below = self.shifted(BinaryOp::Ashr, ConvertOp::Sext, ty, a, (bits, by))?;
        let args = [below, negative];
        self.insert(InstData::Binary { op: BinaryOp::Add, args })
    }

    /// The product with the factor, shifted back.
    fn shifted(
        &mut self,
        op: BinaryOp,
        extend: ConvertOp,
        ty: Type,
        a: Value,
        (bits, by): (u32, u64),
    ) -> Option<Value> {
        let shift = bits + (u64::BITS - (by - 1).leading_zeros());
        let factor = (1u64 << shift).div_ceil(by);
        let wide = self.insert(InstData::Convert { op: extend, to: Type::I64, arg: a })?;
        let product = self.with(BinaryOp::Mul, Type::I64, wide, factor as i64)?;
        let quotient = self.with(op, Type::I64, product, i64::from(shift))?;
        self.insert(InstData::Convert { op: ConvertOp::Trunc, to: ty, arg: quotient })
    }
}
