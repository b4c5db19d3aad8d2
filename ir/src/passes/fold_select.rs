//! Rules for selects between doubles that are integers: the integer is selected and converted once, in the
//! place of a select between the bits of doubles beside one between the integers.
//!
//! ```text
//! v1: f64 = itof v0
//! v2: i64 = bitcast v1                         v2: i64 = iconst 5
//! v3: i64 = iconst 0x4014000000000000          v3: i64 = select v9, v0, v2
//! v4: i64 = select v9, v2, v3          ==>     v4: f64 = itof v3
//!                                              v5: i64 = bitcast v4
//! ```

use super::fold::{Fold, Rewrite};
use crate::InstBuilder;
use crate::{ConvertOp, InstData, Type, Value};

/// Every integer up to this magnitude is a double.
const EXACT: u64 = 1 << 53;

/// The integer that a double is, by its bits; `None` for -0 and for what is not an integer up to [`EXACT`].
fn integer_of(bits: i64) -> Option<i64> {
    let integer = f64::from_bits(bits as u64) as i64;
    let same = (integer as f64).to_bits() == bits as u64;
    (same && integer.unsigned_abs() <= EXACT).then_some(integer)
}

impl Fold<'_> {
    /// A select between two doubles, or the bits of two, of which one or both are conversions of integers
    /// and have no other use.
    pub(super) fn select_converted(
        &mut self,
        cond: Value,
        ty: Type,
        args: [Value; 2],
    ) -> Option<Rewrite> {
        let converted = args.map(|arg| self.converted_integer(arg, ty));
        let from = match converted {
            [Some(x), Some(y)] if self.func.ty(x) != self.func.ty(y) => return None,
            [Some(x), _] | [_, Some(x)] => self.func.ty(x),
            [None, None] => return None,
        };
        let constants = args.map(|arg| self.func.constant(arg).and_then(integer_of));
        let fits = |value: i64| match from {
            Type::I32 => i32::try_from(value).is_ok(),
            ty => ty == Type::I64,
        };
        let known = |at: usize| converted[at].is_some() || constants[at].is_some_and(fits);
        if !(known(0) && known(1)) {
            return None;
        }
        let mut integers = args;
        for ((integer, converted), constant) in integers.iter_mut().zip(converted).zip(constants) {
            *integer = match (converted, constant) {
                (Some(value), _) => value,
                (None, value) => self.constant(from, value?),
            };
        }
        let chosen = self.build(InstData::Select { cond, args: integers });
        let double = InstData::Convert { op: ConvertOp::IntToFloat, to: Type::F64, arg: chosen };
        if ty == Type::F64 {
            return Some(Rewrite::Inst(double));
        }
        let double = self.build(double);
        Some(Rewrite::convert(ConvertOp::Bitcast, ty, double))
    }

    /// The integer of which a value is the conversion to a double, or the bits of that, if nothing else uses
    /// the conversion.
    fn converted_integer(&self, value: Value, ty: Type) -> Option<Value> {
        let argument = |value: Value, wanted: ConvertOp| match self.func.def_inst(value) {
            Some(&InstData::Convert { op, to: _, arg }) if op == wanted => {
                self.is_used_once(value).then_some(arg)
            }
            _ => None,
        };
        let double = match ty {
            Type::F64 => value,
            Type::I64 => argument(value, ConvertOp::Bitcast)?,
            _ => return None,
        };
        argument(double, ConvertOp::IntToFloat)
    }

    /// Has a store of a double's bits store the double itself.
    pub(super) fn store_double(&self, data: &mut InstData) {
        if let InstData::Store { at: _, value } = data
            && let Some(&InstData::Convert { op: ConvertOp::Bitcast, to: Type::I64, arg }) =
                self.func.def_inst(*value)
        {
            *value = arg;
        }
    }
}
