//! Operands of expressions and their operations, in IR.
//!
//! An [`Operand`] is a value together with what [range analysis](super::range_analysis) knows of
//! it. Each operation chooses by that how it is computed: with integers where both operands are
//! integers and the result is exact, otherwise with doubles as the control does.
//!
//! | PMAC | integers | doubles |
//! | --- | --- | --- |
//! | `+ - *` | `add sub mul` | `fadd fsub fmul` |
//! | `/` | never: the quotient may have a fraction | `fdiv`, and what PMAC makes of a division by 0 |
//! | `%` | `smod` by a constant | host function |
//! | `& \| ^` | `and or xor` | `and or xor` behind an integrality check, else host function |
//!
//! Variables hold doubles that are finite and never -0; [`Operand::stored`] makes such a double of
//! any value.

use std::convert::Infallible;

use plcc_abi::HostFn;
use plcc_ir::{
    Address, BinaryOp, ConvertOp, FloatCond, FuncBuilder, IntCond, Type, UnaryOp, Value,
};

use super::range_analysis::Bounds;
use crate::common::InternalError;
use crate::pmac::ast::{Bin, Cmp};

/// A value with what is known of it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Operand {
    /// A constant.
    Const(f64),
    /// A variable's double in the process image, which is loaded where it is used.
    Stored(Address),
    /// A value of IR: an integer that has room for its [`Bounds::Int`], an `f64` for
    /// [`Bounds::Real`], an `i1` for [`Bounds::Truth`].
    Value(Value, Bounds),
}

impl Operand {
    pub(crate) fn bounds(self) -> Bounds {
        match self {
            Self::Const(value) => Bounds::constant(value),
            Self::Stored(_) => Bounds::FINITE,
            Self::Value(_, bounds) => bounds,
        }
    }

    /// The operand as a double.
    pub(crate) fn float(self, b: &mut FuncBuilder) -> Value {
        match self {
            // Its bounds are those of an integer, which knows no -0.
            Self::Const(value) => b.fconst(value + 0.0),
            Self::Stored(at) => b.load(Type::F64, at),
            Self::Value(value, Bounds::Int(..)) => {
                b.convert(ConvertOp::IntToFloat, Type::F64, value)
            }
            Self::Value(value, Bounds::Real { .. }) => value,
            Self::Value(value, Bounds::Truth) => {
                let wide = b.zextend_or_trunc(Type::I64, value);
                b.convert(ConvertOp::IntToFloat, Type::F64, wide)
            }
        }
    }

    /// The low bits of the operand as an integer of a type; `None` if it is not known to be an
    /// integer.
    pub(crate) fn int(self, b: &mut FuncBuilder, ty: Type) -> Option<Value> {
        match self {
            Self::Const(value) => self.bounds().is_int().then(|| b.iconst(ty, value as i64)),
            Self::Value(value, Bounds::Int(..)) => Some(b.sextend_or_trunc(ty, value)),
            Self::Value(..) | Self::Stored(_) => None,
        }
    }

    /// The bit pattern of the operand as a double, an `i64`; `None` if it is not at hand without a
    /// computation. Only doubles that are finite and not -0 come out, so equal doubles have equal
    /// bit patterns.
    fn bit_pattern(self, b: &mut FuncBuilder) -> Option<Value> {
        match self {
            Self::Const(value) if value.is_finite() => {
                // Adding 0 turns -0 into 0.
                Some(b.iconst(Type::I64, (value + 0.0).to_bits() as i64))
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
                b.iconst(Type::I64, value.to_bits() as i64)
            }
            Self::Stored(from) => b.load(Type::I64, from),
            other => other.stored(b),
        };
        b.store(at, value);
    }

    /// The operand as a truth value: whether it is not 0.
    pub(crate) fn truth(self, b: &mut FuncBuilder) -> Value {
        match self {
            Self::Value(value, Bounds::Truth) => value,
            Self::Const(value) => b.iconst(Type::I1, i64::from(value != 0.0)),
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
        let (most, nan, minus_zero) = self.bounds().real();
        let value = match self {
            Self::Const(value) => return b.fconst(plcc_abi::pmac::arithmetic::finite(value)),
            other => other.float(b),
        };
        let may_be_infinite = most > f64::MAX;
        let value = if may_be_infinite || nan { without_infinity_and_nan(b, value) } else { value };
        if !minus_zero {
            return value;
        }
        let zero = b.fconst(0.0);
        b.binary(BinaryOp::Fadd, value, zero)
    }

    /// The low bits of the operand rounded to an integer, an `i32`.
    pub(crate) fn bits(self, b: &mut FuncBuilder) -> Result<Value, InternalError> {
        if let Some(value) = self.int(b, Type::I32) {
            return Ok(value);
        }
        if let Self::Const(value) = self {
            return Ok(b.iconst(Type::I32, plcc_abi::pmac::fixed::bits(value) as i64));
        }
        // Most numbers are integers, which need no rounding.
        let (_, may_be_nan, _) = self.bounds().real();
        let value = self.float(b);
        let cond = if may_be_nan { FloatCond::Eq } else { FloatCond::OrderedNe };
        let (truncated, is_integer) = integrality_check(b, value, cond);
        let fixed = cold(|b| {
            let bits = host_value(b, HostFn::PmacBits, &[value])?;
            Ok(b.sextend_or_trunc(Type::I32, bits))
        });
        if may_be_nan {
            either(b, is_integer, Type::I32, |_| Ok(truncated), fixed)
        } else {
            either(b, is_integer, Type::I32, fixed, |_| Ok(truncated))
        }
    }
}

/// Calls a function of the host that gives a value.
pub(crate) fn host_value(
    b: &mut FuncBuilder,
    function: HostFn,
    args: &[Value],
) -> Result<Value, InternalError> {
    let value = b.host_call(function, args);
    let name = function.name();
    value.ok_or_else(|| InternalError::new(format!("the host function {name} gives no value")))
}

/// An integrality check: converts a double to an `i32` and back, and compares the result with the
/// double by `cond`. The two are equal if the double is an integer of 32 bits. Gives the `i32` and
/// the truth value of the comparison.
pub(crate) fn integrality_check(
    b: &mut FuncBuilder,
    value: Value,
    cond: FloatCond,
) -> (Value, Value) {
    let truncated = b.convert(ConvertOp::FloatToInt, Type::I32, value);
    let back = b.convert(ConvertOp::IntToFloat, Type::F64, truncated);
    (truncated, b.fcmp(cond, back, value))
}

/// The type that has room for every integer within bounds.
pub(crate) fn integer_type(bounds: Bounds) -> Type {
    match bounds {
        Bounds::Int(low, high) if i32::try_from(low).is_ok() && i32::try_from(high).is_ok() => {
            Type::I32
        }
        _ => Type::I64,
    }
}

/// The type that has room for every integer within one of two bounds.
fn common_type(a: Bounds, b: Bounds) -> Type {
    integer_type(a).max(integer_type(b))
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

/// A double without infinities and NaN: the largest number of the infinity's sign, or 0.
fn without_infinity_and_nan(b: &mut FuncBuilder, value: Value) -> Value {
    let finite = is_finite(b, value);
    let Ok(value) = either(
        b,
        finite,
        Type::F64,
        |_| Ok::<_, Infallible>(value),
        cold(|b| {
            let (high, low) = (b.fconst(f64::MAX), b.fconst(-f64::MAX));
            Ok(by_sign(b, value, high, low))
        }),
    );
    value
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
        Operand::Value(value, bounds @ Bounds::Int(..)) => {
            let bounds = bounds.negated();
            let value = b.sextend_or_trunc(integer_type(bounds), value);
            Operand::Value(b.unary(UnaryOp::Neg, value), bounds)
        }
        other => {
            let value = other.float(b);
            Operand::Value(b.unary(UnaryOp::Fneg, value), other.bounds().negated())
        }
    }
}

/// The result of an operator. With `prefer_short` the code is short rather than fast, which is
/// right for code that seldom runs.
pub(crate) fn binary(
    b: &mut FuncBuilder,
    op: Bin,
    left: Operand,
    right: Operand,
    prefer_short: bool,
) -> Result<Operand, InternalError> {
    if let (Operand::Const(x), Operand::Const(y)) = (left, right) {
        return Ok(Operand::Const(crate::pmac::analyse::eval::binary(op, x, y)));
    }
    let bounds = Bounds::binary(op, left.bounds(), right.bounds());
    let ty = integer_type(bounds);
    if bounds.is_int() && op == Bin::Mod {
        let value = modulo(b, left, right)?;
        return Ok(Operand::Value(b.sextend_or_trunc(ty, value), bounds));
    }
    // The low bits of these results depend only on the low bits of the operands.
    if bounds.is_int()
        && let (Some(x), Some(y)) = (left.int(b, ty), right.int(b, ty))
    {
        let value = match op {
            Bin::Add => b.binary(BinaryOp::Add, x, y),
            Bin::Sub => b.binary(BinaryOp::Sub, x, y),
            Bin::Mul => b.binary(BinaryOp::Mul, x, y),
            Bin::And => b.binary(BinaryOp::And, x, y),
            Bin::Or => b.binary(BinaryOp::Or, x, y),
            Bin::Xor => b.binary(BinaryOp::Xor, x, y),
            Bin::Mod | Bin::Div => {
                let message = format!("the low bits of {op:?} depend on more than low bits");
                return Err(InternalError::new(message));
            }
        };
        return Ok(Operand::Value(value, bounds));
    }
    let (x, y) = (left.float(b), right.float(b));
    let value = match op {
        Bin::Add => b.binary(BinaryOp::Fadd, x, y),
        Bin::Sub => b.binary(BinaryOp::Fsub, x, y),
        Bin::Mul => b.binary(BinaryOp::Fmul, x, y),
        Bin::Div => divide(b, (x, left), (y, right)),
        Bin::Mod => host_value(b, HostFn::PmacMod, &[x, y])?,
        Bin::And => bit_operator(b, (BinaryOp::And, HostFn::PmacAnd), x, y, prefer_short)?,
        Bin::Or => bit_operator(b, (BinaryOp::Or, HostFn::PmacOr), x, y, prefer_short)?,
        Bin::Xor => bit_operator(b, (BinaryOp::Xor, HostFn::PmacXor), x, y, prefer_short)?,
    };
    Ok(Operand::Value(value, bounds))
}

/// An integer modulo a constant that is not 0.
fn modulo(b: &mut FuncBuilder, x: Operand, by: Operand) -> Result<Value, InternalError> {
    let no_integers =
        || InternalError::new("an integer remainder of operands that are no integers");
    let (Bounds::Int(low, high), Bounds::Int(by, _)) = (x.bounds(), by.bounds()) else {
        return Err(no_integers());
    };
    if by == 0 {
        return Err(InternalError::new("an integer remainder by 0"));
    }
    // By a negative divisor -y the result lies between -y and y - 1: it is the remainder by 2y of
    // the dividend plus y, less y.
    let shift = if by > 0 { 0 } else { -by };
    let by = if by > 0 { by } else { -2 * by };
    let bounds = Bounds::Int(low.saturating_add(shift), high.saturating_add(shift));
    let ty = common_type(bounds, Bounds::Int(by, by));
    let x = x.int(b, ty).ok_or_else(no_integers)?;
    let shifted = if shift == 0 { x } else { b.binary_imm(BinaryOp::Add, x, shift) };
    let rest = b.binary_imm(BinaryOp::Smod, shifted, by);
    Ok(if shift == 0 { rest } else { b.binary_imm(BinaryOp::Sub, rest, shift) })
}

/// A quotient. Each operand comes as a double and as what is known of it. Divided by 0 it is the
/// largest number of the dividend's sign, or 0 for 0.
fn divide(b: &mut FuncBuilder, a: (Value, Operand), by: (Value, Operand)) -> Value {
    let quotient = b.binary(BinaryOp::Fdiv, a.0, by.0);
    let never_zero = match by.1 {
        Operand::Const(value) => value != 0.0,
        Operand::Value(_, Bounds::Int(low, high)) => low > 0 || high < 0,
        Operand::Value(..) | Operand::Stored(_) => false,
    };
    if never_zero {
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
            let by_rule = by_sign(b, a.0, high, low);
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

/// A bit operator on doubles. The control applies it to the operands in fixed-point form, which the
/// host function does. Integers of 32 bits keep all their bits in that form, so if both operands
/// are such integers the instruction on integers gives the same.
fn bit_operator(
    b: &mut FuncBuilder,
    (instruction, function): (BinaryOp, HostFn),
    x: Value,
    y: Value,
    prefer_short: bool,
) -> Result<Value, InternalError> {
    if prefer_short {
        return host_value(b, function, &[x, y]);
    }
    let (i, x_fits) = integrality_check(b, x, FloatCond::Eq);
    let (j, y_fits) = integrality_check(b, y, FloatCond::Eq);
    let both_fit = b.binary(BinaryOp::And, x_fits, y_fits);
    let integers = |b: &mut FuncBuilder| {
        let bits = b.binary(instruction, i, j);
        Ok(b.convert(ConvertOp::IntToFloat, Type::F64, bits))
    };
    either(b, both_fit, Type::F64, integers, cold(|b| host_value(b, function, &[x, y])))
}

/// The truth value of a comparator.
pub(crate) fn compare(b: &mut FuncBuilder, cmp: Cmp, left: Operand, right: Operand) -> Operand {
    if let (Operand::Const(x), Operand::Const(y)) = (left, right) {
        let truth = crate::pmac::analyse::eval::compare(cmp, x, y);
        return Operand::Value(b.iconst(Type::I1, i64::from(truth)), Bounds::Truth);
    }
    let ty = common_type(left.bounds(), right.bounds());
    if left.bounds().is_int()
        && right.bounds().is_int()
        && let (Some(x), Some(y)) = (left.int(b, ty), right.int(b, ty))
    {
        return Operand::Value(compare_ints(b, cmp, x, y), Bounds::Truth);
    }
    if let (Cmp::Eq | Cmp::Ne, Operand::Stored(_), _) | (Cmp::Eq | Cmp::Ne, _, Operand::Stored(_)) =
        (cmp, left, right)
        && let (Some(x), Some(y)) = (left.bit_pattern(b), right.bit_pattern(b))
    {
        let cond = if cmp == Cmp::Eq { IntCond::Eq } else { IntCond::Ne };
        return Operand::Value(b.icmp(cond, x, y), Bounds::Truth);
    }
    if let Some(truth) = compare_stored(b, cmp, left, right) {
        return Operand::Value(truth, Bounds::Truth);
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
    Operand::Value(value, Bounds::Truth)
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
