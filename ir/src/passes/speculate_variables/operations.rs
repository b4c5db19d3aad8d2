//! What operations do with integers.

use plcc_abi::IntegerForm;

use super::super::float_range::FloatRange;
use crate::{BinaryOp, FuncData, InstData, UnaryOp};

/// Whether an operation is faster on integers.
pub(super) fn is_faster_on_integers(func: &FuncData, data: &InstData) -> bool {
    let InstData::HostCall { function: _, args } = data else { return false };
    match data.integer_form() {
        Some(IntegerForm::Modulo) => {
            let by = args.as_slice().get(1).and_then(|&by| func.constant(by));
            by.is_some_and(|by| is_integer(by) && f64::from_bits(by as u64) != 0.0)
        }
        Some(IntegerForm::Range) | None => false,
        Some(_) => true,
    }
}

/// Whether an operation on integers gives an integer.
pub(super) fn keeps_integers(func: &FuncData, data: &InstData) -> bool {
    match *data {
        InstData::Unary { op: UnaryOp::Fneg | UnaryOp::Fabs | UnaryOp::Ffinite, arg: _ } => true,
        InstData::Binary { op: BinaryOp::Fadd | BinaryOp::Fsub | BinaryOp::Fmul, args } => {
            args.iter().all(|&arg| func.constant(arg).is_none_or(is_integer))
        }
        _ => false,
    }
}

/// Whether the bits of a double are those of an integer.
pub(super) fn is_integer(bits: i64) -> bool {
    FloatRange::constant(bits as u64).integers().is_some()
}
