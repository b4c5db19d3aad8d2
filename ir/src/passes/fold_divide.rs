//! Divides by constants without a division.
//!
//! The quotient of integers of at most 32 bits becomes a product with a factor of up to 33 bits, in
//! 64 bits (in 32 bits if it fits), that is shifted right by `n + l`. Here `n` is the number of bits of the
//! dividend (without its sign), `d` is the divisor, and `l` is the least number with `d <= 2^l`:
//!
//! - *Rounded towards 0* (`sdiv`, `srem`, `udiv`, `urem`): the factor is `2^(n+l) / d` rounded up.
//!   It is too large by less than one part in `2^n`, so the quotient is too large by less than
//!   `1/d`. The shift rounds it down. For a dividend that is not negative that is the right result;
//!   for a negative one it is one too small, and 1 is added.
//! - *Rounded down* (`smod`): where the dividend is never negative, that is the same. Otherwise
//!   the factor `f` is `2^(n+l) / d` rounded to the nearest integer, and half of `2^(n+l) / d`,
//!   rounded down, is added to the product. `f` is off by at most `1/2`, so the product is off by
//!   at most `2^(n-1)`, which is no more than what was added and, as `d` is not a power of two, less
//!   than the other half. So the shift gives the quotient of the dividend rounded down, whatever
//!   the dividend's sign. A dividend of little more than 32 bits, such as the sum of an `i32` and a
//!   constant, is treated in the same way if there is a shift with which the product fits into 64
//!   bits and is off by no more than what was added.
//!
//! If there is none, a multiple of the divisor that makes every dividend positive is added to it, which does not
//! change the remainder. The quotient of that sum `x` is the upper half of its product with `2^64 / d` rounded up,
//! 128 bits long (`umulh`). The factor is too large by `e / d`, with `e` less than `d`, so that the quotient is too
//! large by less than `1/d` if `x * e` is less than `2^64`.
//!
//! A quotient of doubles becomes a product with the reciprocal if the divisor is a power of two
//! whose reciprocal is a normal number. Then the exact quotient and the exact product are the same
//! number, so both are rounded to the same double.
//!
//! ```text
//! v2: i32 = smod v0, 10        v3: i64 = sext v0
//!                              v4: i64 = mul v3, 3435973837
//!                              v5: i64 = add v4, 1717986918
//!                        ==>   v6: i64 = ashr v5, 35
//!                              v7: i32 = trunc v6
//!                              v8: i32 = mul v7, 10
//!                              v2: i32 = sub v0, v8
//! ```

use super::fold::{Fold, Rewrite};
use super::value_range::mask;
use crate::InstBuilder;
use crate::{BinaryOp, ConvertOp, InstData, Type, Value};

/// `2^shift / by` rounded to the nearest integer, and half of it rounded down. `shift` is from 1 to 62.
fn factor_and_half(shift: u32, by: i64) -> (i64, i64) {
    (((1 << shift) + by / 2) / by, (1 << (shift - 1)) / by)
}

/// The least shift with which the quotient by a constant is rounded down rightly for every dividend of
/// at most this magnitude, and no product exceeds 64 bits; `None` if there is no such shift.
fn shift_for_long_dividend(magnitude: u64, by: i64) -> Option<u32> {
    (i64::BITS - by.leading_zeros()..=62).find(|&shift| {
        let (factor, half) = factor_and_half(shift, by);
        let (magnitude, by) = (i128::from(magnitude), i128::from(by));
        let (factor, half) = (i128::from(factor), i128::from(half));
        // How far the factor is off, times the divisor.
        let off = (factor * by - (1i128 << shift)).abs();
        magnitude * off <= half * by && magnitude * factor + half <= i128::from(i64::MAX)
    })
}

impl Fold<'_> {
    /// A quotient or remainder of an integer of at most 32 bits by a constant other than 0 and 1.
    pub(super) fn divide(&mut self, op: BinaryOp, ty: Type, a: Value, c: i64) -> Option<Rewrite> {
        if ty.bits() > 32 {
            return None;
        }
        let sign = 1 << (ty.bits() - 1);
        let possible_ones = self.ranges.possible_ones(a);
        let signed =
            matches!(op, BinaryOp::Sdiv | BinaryOp::Srem) && (possible_ones & sign != 0 || c < 0);
        let size = if signed { c.unsigned_abs() } else { c as u64 & mask(ty) };
        if signed
            && op == BinaryOp::Srem
            && let Some(sum) = self.rounded_towards_zero(ty, a, size)
        {
            // The dividend less what of it the divisor divides.
            let whole = self.binary_imm(BinaryOp::And, sum, -(size as i64));
            return Some(Rewrite::binary(BinaryOp::Sub, a, whole));
        }
        let quotient = if signed {
            self.quotient_towards_zero(ty, a, size)?
        } else {
            self.quotient_of_non_negative(ty, a, possible_ones, size)?
        };
        match op {
            BinaryOp::Sdiv if c < 0 => Some(Rewrite::unary(crate::UnaryOp::Neg, quotient)),
            BinaryOp::Sdiv | BinaryOp::Udiv => Some(Rewrite::Value(quotient)),
            _ => Some(self.remainder(a, quotient, size as i64)),
        }
    }

    /// The remainder (`smod`) of the quotient rounded down by a constant other than 0 and 1.
    pub(super) fn modulo(&mut self, ty: Type, a: Value, c: i64) -> Option<Rewrite> {
        let (low, high) = self.ranges.bounds(a, ty);
        if c <= 0 {
            return None;
        }
        if low >= 0 && high < c {
            return Some(Rewrite::Value(a));
        }
        if c & (c - 1) == 0 {
            let below = self.constant(ty, c - 1);
            return Some(Rewrite::binary(BinaryOp::And, a, below));
        }
        let quotient = if low >= 0 {
            self.quotient_of_non_negative(ty, a, high as u64, c as u64)
        } else {
            self.quotient_rounded_down(ty, a, (low, high), c)
        };
        match quotient {
            Some(quotient) => Some(self.remainder(a, quotient, c)),
            None => self.modulo_of_long_dividend(ty, a, (low, high), c),
        }
    }

    /// The remainder: the dividend less the product of quotient and divisor.
    fn remainder(&mut self, a: Value, quotient: Value, by: i64) -> Rewrite {
        let product = self.binary_imm(BinaryOp::Mul, quotient, by);
        Rewrite::binary(BinaryOp::Sub, a, product)
    }

    /// The remainder (`smod`) by a constant that is not a power of two, of a dividend for which no product fits
    /// into 64 bits.
    fn modulo_of_long_dividend(
        &mut self,
        ty: Type,
        a: Value,
        (low, high): (i64, i64),
        by: i64,
    ) -> Option<Rewrite> {
        // The least multiple of the divisor that makes every dividend positive.
        let moved_by = match low {
            0.. => 0,
            _ => by.checked_mul((low.checked_neg()? - 1) / by + 1)?,
        };
        let most = high.checked_add(moved_by)?;
        let factor = (1u128 << 64).div_ceil(by as u128);
        let too_large = factor * by as u128 - (1 << 64);
        if too_large * most as u128 >= 1 << 64 {
            return None;
        }
        let mut dividend = self.extended_to_i64(ConvertOp::Sext, a);
        if moved_by > 0 {
            dividend = self.binary_imm(BinaryOp::Add, dividend, moved_by);
        }
        let quotient = self.binary_imm(BinaryOp::Umulh, dividend, factor as u64 as i64);
        let product = self.binary_imm(BinaryOp::Mul, quotient, by);
        let args = [dividend, product];
        let rest = self.build(InstData::Binary { op: BinaryOp::Sub, args });
        Some(Rewrite::Value(self.truncated_from_i64(ty, rest)))
    }

    /// The quotient rounded down by a positive constant that is not a power of two.
    fn quotient_rounded_down(
        &mut self,
        ty: Type,
        a: Value,
        (low, high): (i64, i64),
        by: i64,
    ) -> Option<Value> {
        let bits = i64::BITS - (low ^ (low >> 63)).max(high ^ (high >> 63)).leading_zeros();
        let shift = if bits > 31 {
            shift_for_long_dividend(low.unsigned_abs().max(high.unsigned_abs()), by)?
        } else {
            bits + (i64::BITS - (by - 1).leading_zeros())
        };
        if shift > 62 {
            return None;
        }
        let (factor, half) = factor_and_half(shift, by);
        let wide = self.extended_to_i64(ConvertOp::Sext, a);
        let product = self.binary_imm(BinaryOp::Mul, wide, factor);
        let sum = self.binary_imm(BinaryOp::Add, product, half);
        let quotient = self.binary_imm(BinaryOp::Ashr, sum, i64::from(shift));
        Some(self.truncated_from_i64(ty, quotient))
    }

    /// The quotient of a number that is not negative, and at most `most`, by a constant.
    fn quotient_of_non_negative(
        &mut self,
        ty: Type,
        a: Value,
        most: u64,
        by: u64,
    ) -> Option<Value> {
        let bits = u64::BITS - most.leading_zeros();
        // With one bit more the product might not fit into 64 bits.
        if bits > 31 || by < 2 {
            return None;
        }
        self.multiply_and_shift(BinaryOp::Lshr, ConvertOp::Zext, ty, a, (bits, by))
    }

    /// The quotient, rounded towards 0, by a positive constant.
    fn quotient_towards_zero(&mut self, ty: Type, a: Value, by: u64) -> Option<Value> {
        let bits = ty.bits() - 1;
        if by.is_power_of_two() {
            let sum = self.rounded_towards_zero(ty, a, by)?;
            return Some(self.binary_imm(BinaryOp::Ashr, sum, by.trailing_zeros().into()));
        }
        let negative = self.binary_imm(BinaryOp::Lshr, a, i64::from(bits));
        // A number of 16 bits, for example, that was extended with its sign has fewer bits than its type.
        let (low, high) = self.ranges.bounds(a, ty);
        let bits = u64::BITS - ((low ^ low >> 63) | (high ^ high >> 63)).leading_zeros();
        let below = self.multiply_and_shift(BinaryOp::Ashr, ConvertOp::Sext, ty, a, (bits, by))?;
        Some(self.binary(BinaryOp::Add, below, negative))
    }

    /// A dividend, plus the divisor less 1 if it is negative. The divisor is a power of two; where its bits
    /// are then cleared or shifted out, the result is rounded towards 0. `None` for other divisors.
    fn rounded_towards_zero(&mut self, ty: Type, a: Value, by: u64) -> Option<Value> {
        let shift = by.trailing_zeros();
        if !by.is_power_of_two() || shift == 0 || shift >= ty.bits() - 1 {
            return None;
        }
        // The bits that are added are copies of the sign. The highest ones of the dividend are, too, if
        // it is known to be small.
        let (low, high) = self.ranges.bounds(a, ty);
        let limit = 1i64 << (ty.bits() - shift);
        let copies = match -limit <= low && high < limit {
            true => a,
            false => self.binary_imm(BinaryOp::Ashr, a, i64::from(ty.bits() - 1)),
        };
        let less = self.binary_imm(BinaryOp::Lshr, copies, (ty.bits() - shift).into());
        Some(self.binary(BinaryOp::Add, a, less))
    }

    /// The product with the factor, shifted right by `op`. The dividend is extended by `extend` and
    /// has `bits` bits; `by` is the divisor.
    fn multiply_and_shift(
        &mut self,
        op: BinaryOp,
        extend: ConvertOp,
        ty: Type,
        a: Value,
        (bits, by): (u32, u64),
    ) -> Option<Value> {
        let shift = bits + (u64::BITS - (by - 1).leading_zeros());
        if shift > 62 {
            return None;
        }
        let factor = (1u64 << shift).div_ceil(by);
        // The greatest product that 32 bits hold, as a signed number if the dividend may be negative.
        let most = if op == BinaryOp::Ashr { i32::MAX as u64 } else { u64::from(u32::MAX) };
        if ty == Type::I32 && shift < 32 && factor <= most >> bits {
            let product = self.binary_imm(BinaryOp::Mul, a, ty.wrap(factor as i64));
            return Some(self.binary_imm(op, product, i64::from(shift)));
        }
        let wide = self.extended_to_i64(extend, a);
        let product = self.binary_imm(BinaryOp::Mul, wide, factor as i64);
        let quotient = self.binary_imm(op, product, i64::from(shift));
        Some(self.truncated_from_i64(ty, quotient))
    }

    /// An integer of a type as an `i64`.
    fn extended_to_i64(&mut self, extend: ConvertOp, arg: Value) -> Value {
        match self.func.ty(arg) {
            Type::I64 => arg,
            _ => self.convert(extend, Type::I64, arg),
        }
    }

    /// An `i64` cut to a type.
    fn truncated_from_i64(&mut self, ty: Type, arg: Value) -> Value {
        match ty {
            Type::I64 => arg,
            _ => self.convert(ConvertOp::Trunc, ty, arg),
        }
    }

    /// A quotient of doubles by a constant, as a product with its reciprocal.
    pub(super) fn divide_double(&mut self, a: Value, by: u64) -> Option<Rewrite> {
        const FRACTION: u64 = (1 << 52) - 1;
        let by = f64::from_bits(by);
        let reciprocal = 1.0 / by;
        let is_power_of_two = by.is_normal() && by.to_bits() & FRACTION == 0;
        if !is_power_of_two || !reciprocal.is_normal() {
            return None;
        }
        let factor = self.constant(Type::F64, reciprocal.to_bits() as i64);
        Some(Rewrite::binary(BinaryOp::Fmul, a, factor))
    }
}
