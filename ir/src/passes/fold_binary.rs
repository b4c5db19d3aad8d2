//! Simplifies operations on two integers.

use super::fold::{Fold, Simpler};
use super::known::mask;
use crate::{BinaryOp, InstData, Type, UnaryOp, Value, eval};

impl Fold<'_> {
    pub(super) fn binary(&mut self, op: BinaryOp, ty: Type, [a, b]: [Value; 2]) -> Option<Simpler> {
        match (self.func.constant(a), self.func.constant(b)) {
            (Some(x), Some(y)) => {
                let result = eval::binary(op, ty, x, y);
                eval::is_foldable(ty, result).then_some(Simpler::Const(result))
            }
            (Some(_), None) if op.is_commutative() => Some(Simpler::binary(op, b, a)),
            (None, Some(y)) if ty.is_int() => self.with_const(op, ty, [a, b], y),
            _ if op.is_float() => None,
            _ if a == b => same_operands(op, a),
            _ => self.gate(op, ty, [a, b]),
        }
    }

    /// A constant on the right.
    fn with_const(
        &mut self,
        op: BinaryOp,
        ty: Type,
        [a, b]: [Value; 2],
        c: i64,
    ) -> Option<Simpler> {
        use BinaryOp as B;
        let all = ty.wrap(-1);
        let bits = c as u64 & mask(ty);
        match (op, c) {
            (B::Add | B::Sub | B::Or | B::Xor | B::Shl | B::Lshr | B::Ashr | B::Umax, 0) => {
                return Some(Simpler::Same(a));
            }
            (B::And | B::Mul | B::Sdiv | B::Udiv | B::Srem | B::Urem | B::Umin, 0) => {
                return Some(Simpler::Const(0));
            }
            (B::Xor, c) if c == all => return Some(Simpler::not(a)),
            (B::Or | B::Umax, c) if c == all => return Some(Simpler::Const(all)),
            (B::And | B::Umin, c) if c == all => return Some(Simpler::Same(a)),
            (B::Mul | B::Sdiv | B::Udiv, 1) => return Some(Simpler::Same(a)),
            (B::Mul, -1) => return Some(Simpler::unary(UnaryOp::Neg, a)),
            (B::Srem, 1 | -1) | (B::Urem, 1) => return Some(Simpler::Const(0)),
            (B::Shl | B::Lshr, _) if bits >= u64::from(ty.bits()) => {
                return Some(Simpler::Const(0));
            }
            _ => {}
        }
        let ones = self.known.ones(a);
        match op {
            B::Sub => {
                let opposite = self.insert_const(ty, c.wrapping_neg())?;
                Some(Simpler::binary(B::Add, a, opposite))
            }
            B::And if ones & !bits == 0 => Some(Simpler::Same(a)),
            B::And if ones & bits == 0 => Some(Simpler::Const(0)),
            B::And => self.mask_of(a, b, bits).or_else(|| self.chain(op, ty, a, c)),
            B::Lshr if ones >> bits == 0 => Some(Simpler::Const(0)),
            B::Udiv if ones < bits => Some(Simpler::Const(0)),
            B::Urem if ones < bits => Some(Simpler::Same(a)),
            B::Udiv if bits.is_power_of_two() => {
                let by = self.insert_const(ty, i64::from(bits.trailing_zeros()))?;
                Some(Simpler::binary(B::Lshr, a, by))
            }
            B::Urem if bits.is_power_of_two() => {
                let rest = self.insert_const(ty, (bits - 1) as i64)?;
                Some(Simpler::binary(B::And, a, rest))
            }
            B::Add | B::Or | B::Xor | B::Mul => self.chain(op, ty, a, c),
            B::Shl | B::Lshr => {
                let [inner, by] = self.operands(a, op)?;
                let first = self.func.constant(by).filter(|&by| by >= 0)?;
                if first + c >= i64::from(ty.bits()) {
                    return Some(Simpler::Const(0));
                }
                let sum = self.insert_const(ty, first + c)?;
                Some(Simpler::binary(op, inner, sum))
            }
            _ => None,
        }
    }

    /// The same operation with a constant twice.
    fn chain(&mut self, op: BinaryOp, ty: Type, a: Value, c: i64) -> Option<Simpler> {
        let [inner, first] = self.operands(a, op)?;
        let both = eval::binary(op, ty, self.func.constant(first)?, c);
        let both = self.insert_const(ty, both)?;
        Some(Simpler::binary(op, inner, both))
    }

    /// Bits of an OR, of which one side may have none of those wanted.
    fn mask_of(&mut self, a: Value, c: Value, bits: u64) -> Option<Simpler> {
        let [x, y] = self.operands(a, BinaryOp::Or)?;
        if self.known.ones(y) & bits == 0 {
            return Some(Simpler::binary(BinaryOp::And, x, c));
        }
        if self.known.ones(x) & bits == 0 {
            return Some(Simpler::binary(BinaryOp::And, y, c));
        }
        None
    }

    /// AND, OR, XOR and differences of two unknowns.
    fn gate(&mut self, op: BinaryOp, ty: Type, [a, b]: [Value; 2]) -> Option<Simpler> {
        let (not_a, not_b) = (self.not_of(a), self.not_of(b));
        let all = ty.wrap(-1);
        if not_a == Some(b) || not_b == Some(a) {
            match op {
                BinaryOp::And => return Some(Simpler::Const(0)),
                BinaryOp::Or | BinaryOp::Xor => return Some(Simpler::Const(all)),
                _ => {}
            }
        }
        match op {
            BinaryOp::And | BinaryOp::Or => {
                let dual = if op == BinaryOp::And { BinaryOp::Or } else { BinaryOp::And };
                // `a & (a | x)` and `a | (a & x)` are `a`.
                let within = |this: &Self, x, y| {
                    this.operands(y, dual).is_some_and(|args| args.contains(&x))
                };
                if within(self, a, b) {
                    return Some(Simpler::Same(a));
                }
                if within(self, b, a) {
                    return Some(Simpler::Same(b));
                }
                let (x, y) = (not_a?, not_b?);
                if self.is_single(a) && self.is_single(b) {
                    let joined = self.insert(InstData::Binary { op: dual, args: [x, y] })?;
                    return Some(Simpler::not(joined));
                }
                None
            }
            BinaryOp::Xor => match (not_a, not_b) {
                (Some(x), Some(y)) => Some(Simpler::binary(op, x, y)),
                _ => None,
            },
            _ => None,
        }
    }
}

/// An operation of a value with itself.
fn same_operands(op: BinaryOp, a: Value) -> Option<Simpler> {
    match op {
        BinaryOp::And
        | BinaryOp::Or
        | BinaryOp::Smin
        | BinaryOp::Smax
        | BinaryOp::Umin
        | BinaryOp::Umax => Some(Simpler::Same(a)),
        BinaryOp::Xor | BinaryOp::Sub | BinaryOp::Srem | BinaryOp::Urem => Some(Simpler::Const(0)),
        _ => None,
    }
}
