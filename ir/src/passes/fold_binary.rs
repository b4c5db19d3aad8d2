//! Rules for operations on two integers or truth values: algebraic identities, a constant as second
//! operand, the same operation twice in a row, and AND, OR, XOR and NOT of truth values.
//!
//! ```text
//! v1: i32 = add v0, 3
//! v2: i32 = add v1, 4      ==>    v2: i32 = add v0, 7
//! v5: i1 = not v3
//! v6: i1 = not v4
//! v7: i1 = and v5, v6      ==>    v8: i1 = or v3, v4
//!                                 v7: i1 = not v8
//! ```
//!
//! If a rule needs a second instruction in place of one, it applies only where some other
//! instruction becomes dead, so that code does not grow.

use super::fold::{Fold, Rewrite};
use super::value_range::mask;
use crate::InstBuilder;
use crate::{BinaryOp, ConvertOp, InstData, Operands, Type, UnaryOp, Value, eval};

impl Fold<'_> {
    /// What an operation on two operands can be replaced by.
    pub(super) fn fold_binary(
        &mut self,
        op: BinaryOp,
        ty: Type,
        [a, b]: [Value; 2],
    ) -> Option<Rewrite> {
        match (self.func.constant(a), self.func.constant(b)) {
            (Some(x), Some(y)) => {
                let result = eval::binary(op, ty, x, y);
                eval::may_become_constant(ty, result).then_some(Rewrite::Const(result))
            }
            (Some(_), None) if op.is_commutative() => Some(Rewrite::binary(op, b, a)),
            (Some(x), None) if op == BinaryOp::Sub => self.subtract_without_borrow(ty, [a, b], x),
            (None, Some(y)) if ty.is_int() => self.with_const(op, ty, [a, b], y),
            (None, Some(y)) if op == BinaryOp::Fdiv => self.divide_double(a, y as u64),
            _ if op.operands() == Operands::Double => None,
            _ if a == b => same_operands(op, a),
            _ => self.without_const(op, ty, [a, b]),
        }
    }

    /// The truth value of which an integer is the zero extension.
    fn truth_value_of(&self, value: Value) -> Option<Value> {
        match *self.func.def_inst(value)? {
            InstData::Convert { op: ConvertOp::Zext, to: _, arg }
                if self.func.ty(arg) == Type::I1 =>
            {
                Some(arg)
            }
            _ => None,
        }
    }

    /// A product with an extended truth value becomes a select between the other factor and 0.
    fn product_with_truth(&mut self, ty: Type, [a, b]: [Value; 2]) -> Option<Rewrite> {
        let (cond, other) = match (self.truth_value_of(a), self.truth_value_of(b)) {
            (Some(cond), _) => (cond, b),
            (None, Some(cond)) => (cond, a),
            (None, None) => return None,
        };
        let zero = self.constant(ty, 0);
        Some(Rewrite::Inst(InstData::Select { cond, args: [other, zero] }))
    }

    /// A sum of two selects by the same condition, one of which is always 0, becomes one select.
    fn sum_of_selects(&mut self, [a, b]: [Value; 2]) -> Option<Rewrite> {
        let choice = |value| match *self.func.def_inst(value)? {
            InstData::Select { cond, args: [x, y] } => {
                let opposite = self.not_of(cond);
                let (x, y) = if opposite.is_some() { (y, x) } else { (x, y) };
                Some((opposite.unwrap_or(cond), x, y))
            }
            _ => None,
        };
        let ((cond, a, b), (other, x, y)) = (choice(a)?, choice(b)?);
        let zero = |value| self.func.constant(value) == Some(0);
        if cond != other {
            return None;
        }
        let args = if zero(a) && zero(y) {
            [x, b]
        } else if zero(b) && zero(x) {
            [a, y]
        } else {
            return None;
        };
        Some(Rewrite::Inst(InstData::Select { cond, args }))
    }

    /// Rules for a constant as second operand.
    fn with_const(
        &mut self,
        op: BinaryOp,
        ty: Type,
        [a, b]: [Value; 2],
        c: i64,
    ) -> Option<Rewrite> {
        use BinaryOp as B;
        let all = ty.wrap(-1);
        let bits = c as u64 & mask(ty);
        match (op, c) {
            (B::Add | B::Sub | B::Or | B::Xor | B::Shl | B::Lshr | B::Ashr | B::Umax, 0) => {
                return Some(Rewrite::Value(a));
            }
            (
                B::And
                | B::Mul
                | B::Umulh
                | B::Sdiv
                | B::Udiv
                | B::Srem
                | B::Smod
                | B::Urem
                | B::Umin,
                0,
            ) => {
                return Some(Rewrite::Const(0));
            }
            (B::Xor, c) if c == all => return Some(Rewrite::not(a)),
            (B::Or | B::Umax, c) if c == all => return Some(Rewrite::Const(all)),
            (B::And | B::Umin, c) if c == all => return Some(Rewrite::Value(a)),
            (B::Mul | B::Sdiv | B::Udiv, 1) => return Some(Rewrite::Value(a)),
            (B::Mul | B::Sdiv, -1) => return Some(Rewrite::unary(UnaryOp::Neg, a)),
            (B::Srem | B::Smod, 1 | -1) | (B::Urem, 1) => return Some(Rewrite::Const(0)),
            (B::Shl | B::Lshr, _) if bits >= u64::from(ty.bits()) => {
                return Some(Rewrite::Const(0));
            }
            _ => {}
        }
        let possible_ones = self.ranges.possible_ones(a);
        match op {
            B::Sub => {
                let opposite = self.constant(ty, c.wrapping_neg());
                Some(Rewrite::binary(B::Add, a, opposite))
            }
            B::And if possible_ones & !bits == 0 => Some(Rewrite::Value(a)),
            B::And if possible_ones & bits == 0 => Some(Rewrite::Const(0)),
            B::And => self.mask_of_or(a, b, bits).or_else(|| self.combine_consts(op, ty, a, c)),
            B::Lshr if possible_ones >> bits == 0 => Some(Rewrite::Const(0)),
            B::Udiv if possible_ones < bits => Some(Rewrite::Const(0)),
            B::Urem if possible_ones < bits => Some(Rewrite::Value(a)),
            B::Udiv if bits.is_power_of_two() => {
                let by = self.constant(ty, i64::from(bits.trailing_zeros()));
                Some(Rewrite::binary(B::Lshr, a, by))
            }
            B::Urem if bits.is_power_of_two() => {
                let rest = self.constant(ty, (bits - 1) as i64);
                Some(Rewrite::binary(B::And, a, rest))
            }
            B::Sdiv | B::Srem | B::Udiv | B::Urem => self.divide(op, ty, a, c),
            B::Smod => self.modulo(ty, a, c),
            B::Mul => {
                self.combine_consts(op, ty, a, c).or_else(|| self.product_with_truth(ty, [a, b]))
            }
            B::Or if let Some(x) = self.cleared_where_set(ty, a, bits) => {
                Some(Rewrite::binary(op, x, b))
            }
            B::Add | B::Or | B::Xor => self.combine_consts(op, ty, a, c),
            B::Ashr | B::Lshr if let Some(field) = self.shifted_both_ways(op, ty, a, c) => {
                Some(field)
            }
            B::Shl if let Some(simpler) = self.shift_lowest_bit(ty, a, c) => Some(simpler),
            B::Shl | B::Lshr => {
                let [inner, by] = self.operands(a, op)?;
                let first = self.func.constant(by).filter(|&by| by >= 0)?;
                if first + c >= i64::from(ty.bits()) {
                    return Some(Rewrite::Const(0));
                }
                let sum = self.constant(ty, first + c);
                Some(Rewrite::binary(op, inner, sum))
            }
            _ => None,
        }
    }

    /// The same operation twice in a row, with constants: the constants are combined into one.
    fn combine_consts(&mut self, op: BinaryOp, ty: Type, a: Value, c: i64) -> Option<Rewrite> {
        let [inner, first] = self.operands(a, op)?;
        let both = eval::binary(op, ty, self.func.constant(first)?, c);
        let both = self.constant(ty, both);
        Some(Rewrite::binary(op, inner, both))
    }

    /// `(x | y) & c` becomes `x & c` if no bit of `c` can be 1 in `y`; likewise for `x`. `bits` are
    /// the bits of `c`.
    fn mask_of_or(&mut self, a: Value, c: Value, bits: u64) -> Option<Rewrite> {
        let [x, y] = self.operands(a, BinaryOp::Or)?;
        if self.ranges.possible_ones(y) & bits == 0 {
            return Some(Rewrite::binary(BinaryOp::And, x, c));
        }
        if self.ranges.possible_ones(x) & bits == 0 {
            return Some(Rewrite::binary(BinaryOp::And, y, c));
        }
        None
    }

    /// If a value is `x & c`, and all bits that are 0 in `c` are 0 in `x` or set afterwards (they are among
    /// `bits`): `x`.
    fn cleared_where_set(&self, ty: Type, a: Value, bits: u64) -> Option<Value> {
        let [x, kept] = self.operands(a, BinaryOp::And)?;
        let kept = self.func.constant(kept)? as u64;
        let possible = self.ranges.possible_ones(x) & mask(ty);
        (possible & !(kept | bits) == 0).then_some(x)
    }

    /// `(x & c) op (y & c)` becomes `(x op y) & c`, for AND, OR and XOR.
    fn common_mask(&mut self, op: BinaryOp, [a, b]: [Value; 2]) -> Option<Rewrite> {
        let ([x, mask], [y, other]) =
            (self.operands(a, BinaryOp::And)?, self.operands(b, BinaryOp::And)?);
        let same = self.func.constant(mask)? == self.func.constant(other)?;
        if !same || !self.is_used_once(a) || !self.is_used_once(b) {
            return None;
        }
        let both = self.binary(op, x, y);
        Some(Rewrite::binary(BinaryOp::And, both, mask))
    }

    /// `(x & !y) | (!x & y)` becomes `x ^ y`, in any order of the operands.
    fn exclusive_or(&mut self, [a, b]: [Value; 2]) -> Option<Rewrite> {
        let one_without_other = |value| {
            let [p, q] = self.operands(value, BinaryOp::And)?;
            match (self.not_of(p), self.not_of(q)) {
                (None, Some(y)) => Some((p, y)),
                (Some(y), None) => Some((q, y)),
                _ => None,
            }
        };
        let ((x, y), (z, w)) = (one_without_other(a)?, one_without_other(b)?);
        let is_same = (x, y) == (w, z) && self.is_used_once(a) && self.is_used_once(b);
        is_same.then(|| Rewrite::binary(BinaryOp::Xor, x, y))
    }

    /// Rules for two different operands that are not constants.
    fn without_const(&mut self, op: BinaryOp, ty: Type, [a, b]: [Value; 2]) -> Option<Rewrite> {
        let (not_a, not_b) = (self.not_of(a), self.not_of(b));
        let all = ty.wrap(-1);
        if not_a == Some(b) || not_b == Some(a) {
            match op {
                BinaryOp::And => return Some(Rewrite::Const(0)),
                BinaryOp::Or | BinaryOp::Xor => return Some(Rewrite::Const(all)),
                _ => {}
            }
        }
        if ty != Type::I1
            && matches!(op, BinaryOp::Add | BinaryOp::Or | BinaryOp::Xor)
            && let Some(simpler) = self.sum_of_selects([a, b])
        {
            return Some(simpler);
        }
        match op {
            BinaryOp::Mul => self.product_with_truth(ty, [a, b]),
            BinaryOp::And | BinaryOp::Or | BinaryOp::Xor
                if let Some(simpler) = self.common_mask(op, [a, b]) =>
            {
                Some(simpler)
            }
            BinaryOp::And | BinaryOp::Or | BinaryOp::Xor
                if ty == Type::I1
                    && self.combine_bits
                    && let Some(simpler) = self.combine_bits(op, [a, b]) =>
            {
                Some(simpler)
            }
            BinaryOp::And | BinaryOp::Or => {
                let dual = if op == BinaryOp::And { BinaryOp::Or } else { BinaryOp::And };
                // `a & (a | x)` and `a | (a & x)` are `a`.
                let within = |this: &Self, x, y| {
                    this.operands(y, dual).is_some_and(|args| args.contains(&x))
                };
                if within(self, a, b) {
                    return Some(Rewrite::Value(a));
                }
                if within(self, b, a) {
                    return Some(Rewrite::Value(b));
                }
                if op == BinaryOp::Or
                    && let Some(simpler) = self.exclusive_or([a, b])
                {
                    return Some(simpler);
                }
                if op == BinaryOp::Or
                    && let Some(simpler) = self.toggled_bits(ty, [a, b])
                {
                    return Some(simpler);
                }
                self.de_morgan(op, dual, (a, not_a), (b, not_b))
            }
            BinaryOp::Xor => match (not_a, not_b) {
                (Some(x), Some(y)) => Some(Rewrite::binary(op, x, y)),
                _ => None,
            },
            _ => None,
        }
    }
}

impl Fold<'_> {
    /// De Morgan's laws, where they save a NOT: `!x & !y` becomes `!(x | y)`, and `p & !x & !y`
    /// becomes `p & !(x | y)`, in any order of the operands. The same holds with AND and OR
    /// exchanged; `dual` is the other one of the two.
    fn de_morgan(
        &mut self,
        op: BinaryOp,
        dual: BinaryOp,
        (a, not_a): (Value, Option<Value>),
        (b, not_b): (Value, Option<Value>),
    ) -> Option<Rewrite> {
        if let (Some(x), Some(y)) = (not_a, not_b) {
            if !self.is_used_once(a) || !self.is_used_once(b) {
                return None;
            }
            let joined = self.binary(dual, x, y);
            return Some(Rewrite::not(joined));
        }
        let (negated, y, nested) = match (not_a, not_b) {
            (Some(y), None) => (a, y, b),
            (None, Some(y)) => (b, y, a),
            _ => return None,
        };
        let [p, q] = self.operands(nested, op)?;
        let (rest, nested_negated) = if self.not_of(q).is_some() { (p, q) } else { (q, p) };
        let x = self.not_of(nested_negated)?;
        if ![negated, nested, nested_negated].into_iter().all(|value| self.is_used_once(value)) {
            return None;
        }
        let joined = self.binary(dual, x, y);
        let neither = self.not(joined);
        Some(Rewrite::binary(op, rest, neither))
    }
}

/// An operation whose two operands are the same value.
fn same_operands(op: BinaryOp, a: Value) -> Option<Rewrite> {
    match op {
        BinaryOp::And
        | BinaryOp::Or
        | BinaryOp::Smin
        | BinaryOp::Smax
        | BinaryOp::Umin
        | BinaryOp::Umax => Some(Rewrite::Value(a)),
        BinaryOp::Xor | BinaryOp::Sub | BinaryOp::Srem | BinaryOp::Smod | BinaryOp::Urem => {
            Some(Rewrite::Const(0))
        }
        _ => None,
    }
}
