//! Rules for conversions of constants and of the results of other conversions, and for bits of words, which are taken
//! directly from the value that they come from.
//!
//! ```text
//! v1: i32 = zext v0                           (v0 is an i8)
//! v2: i64 = zext v1          ==>    v2: i64 = zext v0
//! v4: i32 = shl v3, 4
//! v6: i1 = bit v4, 6         ==>    v6: i1 = bit v3, 2
//! ```

use super::fold::{Fold, Rewrite};
use super::value_range::mask;
use crate::InstBuilder;
use crate::{BinaryOp, ConvertOp, Field, InstData, Type, UnaryOp, Value, eval};

/// The origin of a bit is followed back through at most this many instructions.
const MAX_STEPS: usize = 32;

/// The origin of a bit.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum BitOrigin {
    /// It is 1, or else 0.
    Constant(bool),
    /// It is the bit with this number, from 0 for the lowest, of a value, or the opposite of that bit.
    Of(Value, u32, bool),
}

impl Fold<'_> {
    /// What a conversion can be replaced by.
    pub(super) fn fold_convert(&mut self, op: ConvertOp, to: Type, arg: Value) -> Option<Rewrite> {
        let from = self.func.ty(arg);
        if let Some(x) = self.func.constant(arg) {
            let result = eval::convert(op, from, to, x);
            return eval::may_become_constant(to, result).then_some(Rewrite::Const(result));
        }
        if op == ConvertOp::Trunc
            && let Some(&InstData::Binary { op: BinaryOp::And, args: [x, by] }) =
                self.func.def_inst(arg)
            && self.func.constant(by).is_some_and(|by| !by as u64 & mask(to) == 0)
        {
            return Some(Rewrite::convert(op, to, x));
        }
        // The bit stays where it is; it may be wanted in another place of a word.
        if op == ConvertOp::Zext
            && self.combine_bits
            && let Some(&InstData::Bit { arg: x, number }) = self.func.def_inst(arg)
            && self.func.ty(x) == to
        {
            let (x, one) = (self.moved(x, -i64::from(number)), self.constant(to, 1));
            return Some(Rewrite::binary(BinaryOp::And, x, one));
        }
        let &InstData::Convert { op: inner, to: _, arg: x } = self.func.def_inst(arg)? else {
            return None;
        };
        let first = self.func.ty(x);
        match (op, inner) {
            (ConvertOp::Zext, ConvertOp::Zext) | (ConvertOp::Sext, ConvertOp::Sext) => {
                Some(Rewrite::convert(op, to, x))
            }
            (ConvertOp::Sext, ConvertOp::Zext) => Some(Rewrite::convert(inner, to, x)),
            (ConvertOp::Trunc, ConvertOp::Trunc) => Some(Rewrite::convert(op, to, x)),
            (ConvertOp::Trunc, ConvertOp::Zext | ConvertOp::Sext) => {
                Some(match to.bits().cmp(&first.bits()) {
                    std::cmp::Ordering::Less => Rewrite::convert(op, to, x),
                    std::cmp::Ordering::Equal => Rewrite::Value(x),
                    std::cmp::Ordering::Greater => Rewrite::convert(inner, to, x),
                })
            }
            (ConvertOp::Bitcast, ConvertOp::Bitcast) => Some(Rewrite::Value(x)),
            (ConvertOp::FloatToInt, ConvertOp::IntToFloat) if first == Type::I32 => {
                Some(Rewrite::Value(x))
            }
            (ConvertOp::IsInteger | ConvertOp::IsIntegerOrNan, ConvertOp::IntToFloat)
                if first == Type::I32 =>
            {
                Some(Rewrite::truth(true))
            }
            _ => None,
        }
    }

    /// What the reading of a bit can be replaced by: the same bit of the value that it comes from.
    pub(super) fn fold_bit(&mut self, arg: Value, number: u8) -> Option<Rewrite> {
        if let Some(x) = self.func.constant(arg) {
            return Some(Rewrite::Const(eval::bit(x, number)));
        }
        let (value, bit, opposite) = match self.origin(arg, number.into()) {
            BitOrigin::Constant(bit) => return Some(Rewrite::truth(bit)),
            BitOrigin::Of(value, ..) if value == arg => return None,
            BitOrigin::Of(value, bit, opposite) => (value, bit, opposite),
        };
        let is_truth = self.func.ty(value) == Type::I1;
        let bit = InstData::Bit { arg: value, number: bit as u8 };
        Some(match (is_truth, opposite) {
            (true, true) => Rewrite::not(value),
            (true, false) => Rewrite::Value(value),
            (false, true) => Rewrite::not(self.build(bit)),
            (false, false) => Rewrite::Inst(bit),
        })
    }

    /// Where a bit of a value comes from.
    pub(super) fn origin(&self, value: Value, bit: u32) -> BitOrigin {
        let (mut value, mut bit, mut opposite) = (value, bit, false);
        for _ in 0..MAX_STEPS {
            if self.ranges.possible_ones(value) >> bit & 1 == 0 {
                return BitOrigin::Constant(opposite);
            }
            if self.func.ty(value) == Type::I1 {
                break;
            }
            let Some(data) = self.func.def_inst(value) else { break };
            match *data {
                InstData::Convert { op: ConvertOp::Zext | ConvertOp::Sext, to: _, arg } => {
                    bit = bit.min(self.func.ty(arg).bits() - 1);
                    value = arg;
                }
                InstData::Convert { op: ConvertOp::Trunc, to: _, arg } => value = arg,
                InstData::Extract { op: _, arg, field: Field { first, width } } => {
                    bit = u32::from(first) + bit.min(u32::from(width) - 1);
                    value = arg;
                }
                InstData::Binary { op: op @ (BinaryOp::Shl | BinaryOp::Lshr), args: [x, by] } => {
                    let Some(by) = self.func.constant(by).and_then(|by| u32::try_from(by).ok())
                    else {
                        break;
                    };
                    let moved = match op {
                        BinaryOp::Shl => bit.checked_sub(by),
                        _ => bit.checked_add(by),
                    };
                    let Some(moved) = moved.filter(|&b| b < self.func.ty(x).bits()) else { break };
                    bit = moved;
                    value = x;
                }
                InstData::Binary { op: BinaryOp::And, args: [x, by] } => {
                    if self.func.constant(by).is_none() {
                        break;
                    }
                    value = x;
                }
                InstData::Binary { op: BinaryOp::Xor, args: [x, by] }
                    if let Some(by) = self.func.constant(by) =>
                {
                    opposite ^= by >> bit & 1 == 1;
                    value = x;
                }
                InstData::Binary { op: BinaryOp::Or | BinaryOp::Xor, args: [x, y] } => {
                    if self.ranges.possible_ones(y) >> bit & 1 == 0 {
                        value = x;
                    } else if self.ranges.possible_ones(x) >> bit & 1 == 0 {
                        value = y;
                    } else {
                        break;
                    }
                }
                InstData::Unary { op: UnaryOp::Not, arg } => {
                    opposite = !opposite;
                    value = arg;
                }
                _ => break,
            }
        }
        BitOrigin::Of(value, bit, opposite)
    }
}
