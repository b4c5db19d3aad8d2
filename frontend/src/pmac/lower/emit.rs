//! Operands of expressions and their operations, in IR.
//!
//! An [`Operand`] is a double, as the control computes with them. That many of them are integers is
//! no concern of the lowering: passes over IR find out where integer arithmetic gives the same
//! (`integers`), and where it pays to check whether a variable holds an integer (`speculate`).
//!
//! | PMAC | IR |
//! | --- | --- |
//! | `+ - *` | `fadd fsub fmul` |
//! | `/` | `fdiv`, and what PMAC makes of a division by 0 |
//! | `%` | host function |
//! | `& \| ^` | host function |
//!
//! Variables hold doubles that are finite and never -0; [`Operand::stored`] makes such a double of
//! any value.

use std::convert::Infallible;

use plcc_abi::HostFn;
use plcc_ir::{
    Address, BinaryOp, ConvertOp, FloatCond, FuncBuilder, InstBuilder, IntCond, Type, UnaryOp,
    Value,
};

use crate::common::BrokenInvariant;
use crate::pmac::ast::{Bin, Cmp};

/// A value of an expression.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Operand {
    /// A constant.
    Const(f64),
    /// A variable's double in the process image, which is loaded where it is used.
    Stored(Address),
    /// A double, an `f64`.
    Double(Value),
    /// A truth value, an `i1`.
    Truth(Value),
}

impl Operand {
    /// The double of an integer, which is an `i32` or `i64`.
    pub(crate) fn integer(b: &mut FuncBuilder, value: Value) -> Self {
        Self::Double(b.convert(ConvertOp::IntToFloat, Type::F64, value))
    }

    /// The operand as a double.
    pub(crate) fn float(self, b: &mut FuncBuilder) -> Value {
        match self {
            // No variable holds -0, and no operation tells it from 0.
            Self::Const(value) => b.fconst(value + 0.0),
            Self::Stored(at) => b.load(Type::F64, at),
            Self::Double(value) => value,
            Self::Truth(value) => {
                let wide = b.zextend_or_trunc(Type::I32, value);
                b.convert(ConvertOp::IntToFloat, Type::F64, wide)
            }
        }
    }

    /// The bit pattern of the operand as a double, an `i64`; `None` if it is not at hand without a
    /// computation. Only doubles that are finite and not -0 come out, so equal doubles have equal
    /// bit patterns.
    fn bit_pattern(self, b: &mut FuncBuilder) -> Option<Value> {
        match self {
            Self::Const(value) if value.is_finite() => {
                // Adding 0 turns -0 into 0.
                Some(b.constant(Type::I64, (value + 0.0).to_bits() as i64))
            }
            Self::Stored(at) => Some(b.load(Type::I64, at)),
            _ => None,
        }
    }

    /// Stores the operand in the process image as a double that is finite and not -0.
    pub(crate) fn store(self, b: &mut FuncBuilder, at: Address) {
        let value = match self {
            Self::Const(value) => {
                let value = plcc_abi::pmac::arithmetic::finite(value);
                b.constant(Type::I64, value.to_bits() as i64)
            }
            Self::Stored(from) => b.load(Type::I64, from),
            other => other.stored(b),
        };
        b.store(at, value);
    }

    /// The operand as a truth value: whether it is not 0.
    pub(crate) fn truth(self, b: &mut FuncBuilder) -> Value {
        match self {
            Self::Truth(value) => value,
            Self::Const(value) => b.constant(Type::I1, i64::from(value != 0.0)),
            other => {
                let value = other.float(b);
                let zero = b.fconst(0.0);
                b.fcmp(FloatCond::Ne, value, zero)
            }
        }
    }

    /// The operand as a double that a variable can hold: finite and not -0. An infinity becomes the
    /// largest number of its sign, NaN becomes 0.
    pub(crate) fn stored(self, b: &mut FuncBuilder) -> Value {
        match self {
            Self::Const(value) => b.fconst(plcc_abi::pmac::arithmetic::finite(value)),
            Self::Stored(_) | Self::Truth(_) => self.float(b),
            Self::Double(value) => {
                let finite = b.unary(UnaryOp::Ffinite, value);
                // Adding 0 turns -0 into 0.
                let zero = b.fconst(0.0);
                b.binary(BinaryOp::Fadd, finite, zero)
            }
        }
    }

    /// The low bits of the operand rounded to an integer, an `i32`.
    pub(crate) fn bits(self, b: &mut FuncBuilder) -> Result<Value, BrokenInvariant> {
        if let Self::Const(value) = self {
            return Ok(b.constant(Type::I32, plcc_abi::pmac::fixed::bits(value) as i64));
        }
        let value = self.float(b);
        let bits = host_value(b, HostFn::PmacBits, &[value])?;
        Ok(b.convert(ConvertOp::Trunc, Type::I32, bits))
    }
}

/// Calls a function of the host that returns a value.
pub(crate) fn host_value(
    b: &mut FuncBuilder,
    function: HostFn,
    args: &[Value],
) -> Result<Value, BrokenInvariant> {
    let value = b.host_call(function, args);
    let name = function.name();
    value.ok_or_else(|| BrokenInvariant::new(format!("the host function {name} gives no value")))
}

/// One of two values of type `ty`, by a condition. Each is computed in a block of its own, so only
/// the one that is wanted is.
fn either<E>(
    b: &mut FuncBuilder,
    cond: Value,
    ty: Type,
    then: impl FnOnce(&mut FuncBuilder) -> Result<Value, E>,
    otherwise: impl FnOnce(&mut FuncBuilder) -> Result<Value, E>,
) -> Result<Value, E> {
    let (yes, no, join) = (b.create_block(), b.create_block(), b.create_block());
    let result = b.block_param(join, ty);
    b.brif(cond, yes, no);
    b.switch_to(yes);
    let value = then(b)?;
    b.jump(join, &[value]);
    b.switch_to(no);
    let value = otherwise(b)?;
    b.jump(join, &[value]);
    b.switch_to(join);
    Ok(result)
}

/// Emits the slow side of a guard, which seldom runs: its blocks are marked as cold.
fn cold<T>(emit: impl FnOnce(&mut FuncBuilder) -> T) -> impl FnOnce(&mut FuncBuilder) -> T {
    |b| {
        let before = b.set_cold(true);
        let value = emit(b);
        b.set_cold(before);
        value
    }
}

/// `high` if a double is above 0, `low` if it is below, else 0.
fn by_sign(b: &mut FuncBuilder, value: Value, high: Value, low: Value) -> Value {
    let zero = b.fconst(0.0);
    let positive = b.fcmp(FloatCond::Gt, value, zero);
    let negative = b.fcmp(FloatCond::Lt, value, zero);
    let other = b.select(negative, low, zero);
    b.select(positive, high, other)
}

/// Unary minus.
pub(crate) fn negate(b: &mut FuncBuilder, a: Operand) -> Operand {
    match a {
        Operand::Const(value) => Operand::Const(-value),
        other => {
            let value = other.float(b);
            Operand::Double(b.unary(UnaryOp::Fneg, value))
        }
    }
}

/// The result of an operator.
pub(crate) fn binary(
    b: &mut FuncBuilder,
    op: Bin,
    left: Operand,
    right: Operand,
) -> Result<Operand, BrokenInvariant> {
    if let (Operand::Const(x), Operand::Const(y)) = (left, right) {
        return Ok(Operand::Const(plcc_abi::pmac::expression::binary(op, x, y)));
    }
    let (x, y) = (left.float(b), right.float(b));
    let value = match op {
        Bin::Add => b.binary(BinaryOp::Fadd, x, y),
        Bin::Sub => b.binary(BinaryOp::Fsub, x, y),
        Bin::Mul => b.binary(BinaryOp::Fmul, x, y),
        Bin::Div => divide(b, x, (y, right)),
        Bin::Mod => host_value(b, HostFn::PmacMod, &[x, y])?,
        Bin::And => host_value(b, HostFn::PmacAnd, &[x, y])?,
        Bin::Or => host_value(b, HostFn::PmacOr, &[x, y])?,
        Bin::Xor => host_value(b, HostFn::PmacXor, &[x, y])?,
    };
    Ok(Operand::Double(value))
}

/// A quotient; the divisor comes as a double and as an operand. Divided by 0 it is the largest
/// number of the dividend's sign, or 0 for 0.
fn divide(b: &mut FuncBuilder, a: Value, by: (Value, Operand)) -> Value {
    let quotient = b.binary(BinaryOp::Fdiv, a, by.0);
    if matches!(by.1, Operand::Const(value) if value != 0.0) {
        return quotient;
    }
    // The quotient of a division by 0 is infinite or NaN, so a finite quotient needs no further
    // check.
    let finite = is_finite(b, quotient);
    let Ok(value) = either(
        b,
        finite,
        Type::F64,
        |_| Ok::<_, Infallible>(quotient),
        cold(|b| {
            let (high, low) = (b.fconst(f64::MAX), b.fconst(-f64::MAX));
            let zero = b.fconst(0.0);
            let by_zero = b.fcmp(FloatCond::Eq, by.0, zero);
            let by_rule = by_sign(b, a, high, low);
            Ok(b.select(by_zero, by_rule, quotient))
        }),
    );
    value
}

/// Whether a double is neither infinite nor NaN, an `i1`: then its difference from itself is 0, and
/// otherwise NaN.
fn is_finite(b: &mut FuncBuilder, value: Value) -> Value {
    let nothing = b.binary(BinaryOp::Fsub, value, value);
    b.fcmp(FloatCond::Ge, nothing, nothing)
}

/// The truth value of a comparator.
pub(crate) fn compare(b: &mut FuncBuilder, cmp: Cmp, left: Operand, right: Operand) -> Operand {
    if let (Operand::Const(x), Operand::Const(y)) = (left, right) {
        let truth = plcc_abi::pmac::expression::compare(cmp, x, y);
        return Operand::Truth(b.constant(Type::I1, i64::from(truth)));
    }
    if let (Cmp::Eq | Cmp::Ne, Operand::Stored(_), _) | (Cmp::Eq | Cmp::Ne, _, Operand::Stored(_)) =
        (cmp, left, right)
        && let (Some(x), Some(y)) = (left.bit_pattern(b), right.bit_pattern(b))
    {
        let cond = if cmp == Cmp::Eq { IntCond::Eq } else { IntCond::Ne };
        return Operand::Truth(b.icmp(cond, x, y));
    }
    if let Some(truth) = compare_stored(b, cmp, left, right) {
        return Operand::Truth(truth);
    }
    let (x, y) = (left.float(b), right.float(b));
    let value = match cmp {
        Cmp::Near | Cmp::NotNear => {
            let apart = b.binary(BinaryOp::Fsub, x, y);
            let apart = b.unary(UnaryOp::Fabs, apart);
            let one = b.fconst(1.0);
            b.fcmp(FloatCond::Lt, apart, one)
        }
        Cmp::Eq => b.fcmp(FloatCond::Eq, x, y),
        Cmp::Ne => b.fcmp(FloatCond::Eq, x, y),
        Cmp::Gt | Cmp::NotGt => b.fcmp(FloatCond::Gt, x, y),
        Cmp::Lt | Cmp::NotLt => b.fcmp(FloatCond::Lt, x, y),
    };
    let negated = matches!(cmp, Cmp::Ne | Cmp::NotGt | Cmp::NotLt | Cmp::NotNear);
    let value = if negated { b.unary(UnaryOp::Not, value) } else { value };
    Operand::Truth(value)
}

/// Compares a variable with a constant by their bits as integers, which takes less code than a
/// comparison of doubles. For doubles that are finite and not -0, the order of the bits as signed
/// integers is that of the doubles if the constant is not negative; if it is, the order of the bits
/// as unsigned integers is the reverse.
fn compare_stored(b: &mut FuncBuilder, cmp: Cmp, left: Operand, right: Operand) -> Option<Value> {
    let (at, number, cmp) = match (left, right, cmp) {
        (Operand::Stored(at), Operand::Const(number), _) => (at, number, cmp),
        (Operand::Const(number), Operand::Stored(at), Cmp::Gt) => (at, number, Cmp::Lt),
        (Operand::Const(number), Operand::Stored(at), Cmp::NotGt) => (at, number, Cmp::NotLt),
        (Operand::Const(number), Operand::Stored(at), Cmp::Lt) => (at, number, Cmp::Gt),
        (Operand::Const(number), Operand::Stored(at), Cmp::NotLt) => (at, number, Cmp::NotGt),
        _ => return None,
    };
    let cond = match (cmp, number < 0.0) {
        (Cmp::Gt, false) => IntCond::Sgt,
        (Cmp::Gt, true) => IntCond::Ult,
        (Cmp::NotGt, false) => IntCond::Sle,
        (Cmp::NotGt, true) => IntCond::Uge,
        (Cmp::Lt, false) => IntCond::Slt,
        (Cmp::Lt, true) => IntCond::Ugt,
        (Cmp::NotLt, false) => IntCond::Sge,
        (Cmp::NotLt, true) => IntCond::Ule,
        _ => return None,
    };
    let number = Operand::Const(number).bit_pattern(b)?;
    let bits = b.load(Type::I64, at);
    Some(b.icmp(cond, bits, number))
}

/// The truth value of a comparator of integers. `~` holds for operands that are less than 1 apart,
/// so for integers it is the same as equality.
pub(crate) fn compare_ints(b: &mut FuncBuilder, cmp: Cmp, x: Value, y: Value) -> Value {
    let cond = match cmp {
        Cmp::Eq | Cmp::Near => IntCond::Eq,
        Cmp::Ne | Cmp::NotNear => IntCond::Ne,
        Cmp::Gt => IntCond::Sgt,
        Cmp::NotGt => IntCond::Sle,
        Cmp::Lt => IntCond::Slt,
        Cmp::NotLt => IntCond::Sge,
    };
    b.icmp(cond, x, y)
}
