//! Rules for comparisons of integers: of constants, of values whose range decides the result, and
//! of values that were widened, shifted or subtracted only to be compared.
//!
//! ```text
//! v1: i32 = zext v0                           (v0 is an i8)
//! v2: i1 = icmp eq v1, 7     ==>    v2: i1 = icmp eq v0, 7
//! v3: i1 = icmp ult v1, 300  ==>    v3: i1 = iconst 1
//! ```

use super::fold::{Fold, Rewrite};
use super::value_range::mask;
use crate::InstBuilder;
use crate::{BinaryOp, ConvertOp, InstData, IntCond, Type, Value, eval};

impl Fold<'_> {
    /// What a comparison of two integers can be replaced by.
    pub(super) fn fold_icmp(&mut self, cond: IntCond, [a, b]: [Value; 2]) -> Option<Rewrite> {
        let ty = self.func.ty(a);
        match (self.func.constant(a), self.func.constant(b)) {
            (Some(x), Some(y)) => Some(Rewrite::truth(eval::icmp(cond, ty, x, y))),
            (Some(_), None) => Some(Rewrite::icmp(cond.swapped(), b, a)),
            (None, Some(c)) => self.compare_const(cond, ty, a, c),
            (None, None) if a == b => Some(Rewrite::truth(matches!(
                cond,
                IntCond::Eq | IntCond::Sle | IntCond::Sge | IntCond::Ule | IntCond::Uge
            ))),
            (None, None) if ty == Type::I1 => match cond {
                IntCond::Ne => Some(Rewrite::binary(BinaryOp::Xor, a, b)),
                _ => None,
            },
            (None, None) => self.compare_both_extended(cond, a, b),
        }
    }

    /// A comparison of a value with a constant.
    fn compare_const(&mut self, cond: IntCond, ty: Type, a: Value, c: i64) -> Option<Rewrite> {
        if ty == Type::I1 {
            let same = (cond == IntCond::Eq) == (c != 0);
            return Some(if same { Rewrite::Value(a) } else { Rewrite::not(a) });
        }
        let possible_ones = self.ranges.possible_ones(a);
        if let Some(truth) = decided_by_range(cond, possible_ones, c, ty) {
            return Some(Rewrite::truth(truth));
        }
        let equality = matches!(cond, IntCond::Eq | IntCond::Ne);
        let simpler = match self.func.def_inst(a).copied() {
            Some(InstData::Convert {
                op: op @ (ConvertOp::Zext | ConvertOp::Sext), arg, ..
            }) => self.compare_extended(cond, op, ty, arg, c),
            Some(InstData::Binary { op: BinaryOp::Xor | BinaryOp::Sub, args: [x, y] })
                if equality && c == 0 =>
            {
                Some(Rewrite::icmp(cond, x, y))
            }
            // All bits of the field are 0. The mask stays until the next run even if the word has no other bits: by it
            // `thread-tests` knows the field that other tests compare.
            Some(InstData::Extract { op: _, arg, field })
                if equality && c == 0 && self.is_used_once(a) =>
            {
                let masked = self.binary_imm(BinaryOp::And, arg, field.mask() as i64);
                let zero = self.constant(ty, 0);
                Some(Rewrite::icmp(cond, masked, zero))
            }
            _ => None,
        };
        if simpler.is_some() || possible_ones != 1 || !equality {
            return simpler;
        }
        let bit = self.bit(a, 0);
        let same = (cond == IntCond::Eq) == (c != 0);
        Some(if same { Rewrite::Value(bit) } else { Rewrite::not(bit) })
    }

    /// A comparison of a widened value with a constant becomes one of the value before.
    fn compare_extended(
        &mut self,
        cond: IntCond,
        op: ConvertOp,
        ty: Type,
        arg: Value,
        c: i64,
    ) -> Option<Rewrite> {
        let from = self.func.ty(arg);
        if from == Type::I1 {
            let high = eval::convert(op, Type::I1, ty, 1);
            return Some(match (eval::icmp(cond, ty, 0, c), eval::icmp(cond, ty, high, c)) {
                (false, true) => Rewrite::Value(arg),
                (true, false) => Rewrite::not(arg),
                (truth, _) => Rewrite::truth(truth),
            });
        }
        let narrow = from.wrap(c);
        let fits = eval::convert(op, from, ty, narrow) == c;
        let cond = before_extension(cond, op).filter(|_| fits)?;
        let narrow = self.constant(from, narrow);
        Some(Rewrite::icmp(cond, arg, narrow))
    }

    /// A comparison of two values that were widened in the same way becomes one of the values
    /// before.
    fn compare_both_extended(&mut self, cond: IntCond, a: Value, b: Value) -> Option<Rewrite> {
        let (Some(&InstData::Convert { op, to: _, arg: x }), Some(second)) =
            (self.func.def_inst(a), self.func.def_inst(b))
        else {
            return None;
        };
        let &InstData::Convert { op: other, to: _, arg: y } = second else { return None };
        let from = self.func.ty(x);
        if op != other || from != self.func.ty(y) {
            return None;
        }
        let cond = before_extension(cond, op)?;
        if from == Type::I1 && !matches!(cond, IntCond::Eq | IntCond::Ne) {
            return None;
        }
        Some(Rewrite::icmp(cond, x, y))
    }
}

/// The comparison that gives the same result on two values before they are widened by `op`; `None`
/// if there is none.
fn before_extension(cond: IntCond, op: ConvertOp) -> Option<IntCond> {
    match (op, cond) {
        (ConvertOp::Zext | ConvertOp::Sext, IntCond::Eq | IntCond::Ne) => Some(cond),
        (ConvertOp::Zext, IntCond::Slt | IntCond::Ult) => Some(IntCond::Ult),
        (ConvertOp::Zext, IntCond::Sle | IntCond::Ule) => Some(IntCond::Ule),
        (ConvertOp::Zext, IntCond::Sgt | IntCond::Ugt) => Some(IntCond::Ugt),
        (ConvertOp::Zext, IntCond::Sge | IntCond::Uge) => Some(IntCond::Uge),
        (ConvertOp::Sext, IntCond::Slt | IntCond::Sle | IntCond::Sgt | IntCond::Sge) => Some(cond),
        _ => None,
    }
}

/// The result of a comparison of a value with the constant `c`, if the bits of the value that may
/// be 1 decide it.
fn decided_by_range(cond: IntCond, possible_ones: u64, c: i64, ty: Type) -> Option<bool> {
    let all = mask(ty);
    let bound = c as u64 & all;
    let sign = 1u64 << (ty.bits() - 1);
    match cond {
        IntCond::Eq if bound & !possible_ones != 0 => Some(false),
        IntCond::Ne if bound & !possible_ones != 0 => Some(true),
        IntCond::Ult if bound == 0 => Some(false),
        IntCond::Uge if bound == 0 => Some(true),
        IntCond::Ult if possible_ones < bound => Some(true),
        IntCond::Uge if possible_ones < bound => Some(false),
        IntCond::Ule if possible_ones <= bound => Some(true),
        IntCond::Ugt if possible_ones <= bound => Some(false),
        // Not negative: it compares as an unsigned number does.
        IntCond::Slt if possible_ones & sign == 0 && (c <= 0 || possible_ones < bound) => {
            Some(c > 0)
        }
        IntCond::Sge if possible_ones & sign == 0 && (c <= 0 || possible_ones < bound) => {
            Some(c <= 0)
        }
        IntCond::Sle if possible_ones & sign == 0 && (c < 0 || possible_ones <= bound) => {
            Some(c >= 0)
        }
        IntCond::Sgt if possible_ones & sign == 0 && (c < 0 || possible_ones <= bound) => {
            Some(c < 0)
        }
        _ => None,
    }
}
