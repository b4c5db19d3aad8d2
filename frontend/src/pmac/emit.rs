//! Values while IR is written: doubles, integers where the [analysis](super::rangeanalysis) allows
//! them, truth values.

use plcc_abi::HostFn;
use plcc_abi::pmac::Field;
use plcc_ir::{
    Address, BinaryOp, ConvertOp, FloatCond, FuncBuilder, IntCond, Type, UnaryOp, Value,
};

use super::ast::{Bin, Cmp};
use super::rangeanalysis::Shape;

/// A value with what is known of it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Operand {
    /// A number that is known.
    Const(f64),
    /// An `i64` for [`Shape::Int`], an `f64` for [`Shape::Real`], an `i1` for [`Shape::Truth`].
    Value(Value, Shape),
}

impl Operand {
    pub(crate) fn shape(self) -> Shape {
        match self {
            Self::Const(value) => Shape::constant(value),
            Self::Value(_, shape) => shape,
        }
    }

    /// As a double.
    pub(crate) fn float(self, b: &mut FuncBuilder) -> Value {
        match self {
            Self::Const(value) => b.fconst(value),
            Self::Value(value, Shape::Int(..)) => {
                b.convert(ConvertOp::IntToFloat, Type::F64, value)
            }
            Self::Value(value, Shape::Real { .. }) => value,
            Self::Value(value, Shape::Truth) => {
                let wide = b.zextend_or_trunc(Type::I64, value);
                b.convert(ConvertOp::IntToFloat, Type::F64, wide)
            }
        }
    }

    /// As an integer, if it is one.
    fn int(self, b: &mut FuncBuilder) -> Option<Value> {
        match self {
            Self::Const(value) => self.shape().is_int().then(|| b.iconst(Type::I64, value as i64)),
            Self::Value(value, Shape::Int(..)) => Some(value),
            Self::Value(..) => None,
        }
    }

    /// As a truth value.
    pub(crate) fn truth(self, b: &mut FuncBuilder) -> Value {
        match self {
            Self::Value(value, Shape::Truth) => value,
            Self::Const(value) => b.iconst(Type::I1, i64::from(value != 0.0)),
            other => {
                let value = other.float(b);
                let zero = b.fconst(0.0);
                b.fcmp(FloatCond::Ne, value, zero)
            }
        }
    }

    /// As a double that can be stored: finite and not -0.
    pub(crate) fn stored(self, b: &mut FuncBuilder) -> Value {
        let (most, nan, minus_zero) = self.shape().real();
        let mut value = match self {
            Self::Const(value) => return b.fconst(plcc_abi::pmac::math::finite(value)),
            other => other.float(b),
        };
        if most > f64::MAX {
            let high = b.fconst(f64::MAX);
            let over = b.fcmp(FloatCond::Gt, value, high);
            value = b.select(over, high, value);
            let low = b.fconst(-f64::MAX);
            let under = b.fcmp(FloatCond::Lt, value, low);
            value = b.select(under, low, value);
        }
        let zero = b.fconst(0.0);
        if nan {
            let number = b.fcmp(FloatCond::Eq, value, value);
            value = b.select(number, value, zero);
        }
        if minus_zero || most > f64::MAX { b.binary(BinaryOp::Fadd, value, zero) } else { value }
    }

    /// Rounded to an integer, the low bits of it, an `i64`.
    pub(crate) fn bits(self, b: &mut FuncBuilder) -> Value {
        if let Some(value) = self.int(b) {
            return value;
        }
        if let Self::Const(value) = self {
            return b.iconst(Type::I64, plcc_abi::pmac::fixed::bits(value) as i64);
        }
        let most = self.shape().real().0;
        let value = self.float(b);
        let rounded = round(b, value);
        if most < 9e18 {
            return b.convert(ConvertOp::FloatToInt, Type::I64, rounded);
        }
        // Saturation would lose the low bits of what does not fit.
        let magnitude = b.unary(UnaryOp::Fabs, rounded);
        let limit = b.fconst(9_223_372_036_854_775_808.0);
        let fits = b.fcmp(FloatCond::Lt, magnitude, limit);
        let (near, far, join) = (b.create_block(), b.create_block(), b.create_block());
        let result = b.block_param(join, Type::I64);
        b.brif(fits, near, far);
        b.switch_to(near);
        let small = b.convert(ConvertOp::FloatToInt, Type::I64, rounded);
        b.jump(join, &[small]);
        b.switch_to(far);
        let large = b.host_call(HostFn::PmacBits, &[value]).unwrap_or(small);
        b.jump(join, &[large]);
        b.switch_to(join);
        result
    }
}

/// To the nearest integer, ties away from zero.
fn round(b: &mut FuncBuilder, value: Value) -> Value {
    let whole = b.unary(UnaryOp::Ftrunc, value);
    let rest = b.binary(BinaryOp::Fsub, value, whole);
    let rest = b.unary(UnaryOp::Fabs, rest);
    let half = b.fconst(0.5);
    let up = b.fcmp(FloatCond::Ge, rest, half);
    let zero = b.fconst(0.0);
    let negative = b.fcmp(FloatCond::Lt, value, zero);
    let (minus, plus) = (b.fconst(-1.0), b.fconst(1.0));
    let one = b.select(negative, minus, plus);
    let next = b.binary(BinaryOp::Fadd, whole, one);
    b.select(up, next, whole)
}

/// Unary minus.
pub(crate) fn negate(b: &mut FuncBuilder, a: Operand) -> Operand {
    match a {
        Operand::Const(value) => Operand::Const(-value),
        Operand::Value(value, shape @ Shape::Int(..)) => {
            Operand::Value(b.unary(UnaryOp::Neg, value), shape.negated())
        }
        other => {
            let value = other.float(b);
            Operand::Value(b.unary(UnaryOp::Fneg, value), other.shape().negated())
        }
    }
}

/// An operator.
pub(crate) fn binary(b: &mut FuncBuilder, op: Bin, left: Operand, right: Operand) -> Operand {
    if let (Operand::Const(x), Operand::Const(y)) = (left, right) {
        return Operand::Const(super::eval::binary(op, x, y));
    }
    let shape = Shape::binary(op, left.shape(), right.shape());
    if shape.is_int()
        && let (Some(x), Some(y)) = (left.int(b), right.int(b))
    {
        let value = match op {
            Bin::Add => b.binary(BinaryOp::Add, x, y),
            Bin::Sub => b.binary(BinaryOp::Sub, x, y),
            Bin::Mul => b.binary(BinaryOp::Mul, x, y),
            Bin::And => b.binary(BinaryOp::And, x, y),
            Bin::Or => b.binary(BinaryOp::Or, x, y),
            Bin::Xor => b.binary(BinaryOp::Xor, x, y),
            Bin::Mod | Bin::Div => modulo(b, x, left.shape(), right),
        };
        return Operand::Value(value, shape);
    }
    let (x, y) = (left.float(b), right.float(b));
    let value = match op {
        Bin::Add => b.binary(BinaryOp::Fadd, x, y),
        Bin::Sub => b.binary(BinaryOp::Fsub, x, y),
        Bin::Mul => b.binary(BinaryOp::Fmul, x, y),
        Bin::Div => divide(b, (x, left), (y, right)),
        Bin::Mod => b.host_call(HostFn::PmacMod, &[x, y]).unwrap_or(x),
        Bin::And | Bin::Or | Bin::Xor => {
            let (x, y) = (to_fixed(b, x), to_fixed(b, y));
            let bits = match op {
                Bin::And => b.binary(BinaryOp::And, x, y),
                Bin::Or => b.binary(BinaryOp::Or, x, y),
                _ => b.binary(BinaryOp::Xor, x, y),
            };
            let value = b.convert(ConvertOp::IntToFloat, Type::F64, bits);
            let unit = b.fconst(1.0 / 16_777_216.0);
            b.binary(BinaryOp::Fmul, value, unit)
        }
    };
    Operand::Value(value, shape)
}

/// `x` modulo a constant that is not 0.
fn modulo(b: &mut FuncBuilder, x: Value, of: Shape, by: Operand) -> Value {
    let by = match by {
        Operand::Const(value) => value as i64,
        Operand::Value(_, Shape::Int(low, _)) => low,
        Operand::Value(..) => 1,
    };
    let (least, shifted, by, back) = match of {
        Shape::Int(low, _) if by > 0 => (low, x, by, 0),
        Shape::Int(low, _) => (low - by, b.binary_imm(BinaryOp::Sub, x, by), -2 * by, by),
        _ => (i64::MIN, x, by.max(1), 0),
    };
    let mut rest = b.binary_imm(BinaryOp::Srem, shifted, by);
    if least < 0 {
        let negative = b.icmp_imm(IntCond::Slt, rest, 0);
        let up = b.binary_imm(BinaryOp::Add, rest, by);
        rest = b.select(negative, up, rest);
    }
    if back == 0 { rest } else { b.binary_imm(BinaryOp::Add, rest, back) }
}

fn divide(b: &mut FuncBuilder, a: (Value, Operand), by: (Value, Operand)) -> Value {
    let quotient = b.binary(BinaryOp::Fdiv, a.0, by.0);
    let never_zero = match by.1 {
        Operand::Const(value) => value != 0.0,
        Operand::Value(_, Shape::Int(low, high)) => low > 0 || high < 0,
        Operand::Value(..) => false,
    };
    if never_zero {
        return quotient;
    }
    let zero = b.fconst(0.0);
    let (high, low) = (b.fconst(f64::MAX), b.fconst(-f64::MAX));
    let by_zero = b.fcmp(FloatCond::Eq, by.0, zero);
    let positive = b.fcmp(FloatCond::Gt, a.0, zero);
    let negative = b.fcmp(FloatCond::Lt, a.0, zero);
    let other = b.select(negative, low, zero);
    let largest = b.select(positive, high, other);
    b.select(by_zero, largest, quotient)
}

/// Two's complement with 24 fraction bits, saturated.
fn to_fixed(b: &mut FuncBuilder, value: Value) -> Value {
    let unit = b.fconst(16_777_216.0);
    let scaled = b.binary(BinaryOp::Fmul, value, unit);
    let rounded = round(b, scaled);
    b.convert(ConvertOp::FloatToInt, Type::I64, rounded)
}

/// A comparator.
pub(crate) fn compare(b: &mut FuncBuilder, cmp: Cmp, left: Operand, right: Operand) -> Operand {
    if let (Operand::Const(x), Operand::Const(y)) = (left, right) {
        let truth = super::eval::compare(cmp, x, y);
        return Operand::Value(b.iconst(Type::I1, i64::from(truth)), Shape::Truth);
    }
    if let (Some(x), Some(y)) = (left.int(b), right.int(b)) {
        return Operand::Value(compare_ints(b, cmp, x, y), Shape::Truth);
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
    Operand::Value(value, Shape::Truth)
}

/// A comparator of integers: nearly equal are only equal ones.
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

/// Reads a field of a word, U or S, as an `i32`.
pub(crate) fn read_field(b: &mut FuncBuilder, at: Address, field: Field) -> Value {
    let word = b.load(Type::I32, at);
    field_of(b, word, field)
}

/// A field of a word at hand.
pub(crate) fn field_of(b: &mut FuncBuilder, word: Value, field: Field) -> Value {
    use plcc_abi::pmac::Format;
    let (offset, width) = (i64::from(field.offset), i64::from(field.width));
    match field.format {
        Format::S => {
            let left = b.binary_imm(BinaryOp::Shl, word, 32 - offset - width);
            b.binary_imm(BinaryOp::Ashr, left, 32 - width)
        }
        Format::U => {
            let low = if offset == 0 { word } else { b.binary_imm(BinaryOp::Lshr, word, offset) };
            b.binary_imm(BinaryOp::And, low, (1 << width) - 1)
        }
        Format::D | Format::C => {
            let low = b.binary_imm(BinaryOp::Lshr, word, offset);
            let low = match field.format {
                Format::C => b.binary_imm(BinaryOp::Xor, low, -1),
                _ => low,
            };
            let bits = b.binary_imm(BinaryOp::And, low, (1 << width) - 1);
            let mut sum = b.iconst(Type::I32, 0);
            for digit in (0..6).rev() {
                let tens = b.binary_imm(BinaryOp::Mul, sum, 10);
                let nibble = b.binary_imm(BinaryOp::Lshr, bits, 4 * digit);
                let nibble = b.binary_imm(BinaryOp::And, nibble, 15);
                sum = b.binary(BinaryOp::Add, tens, nibble);
            }
            sum
        }
    }
}

/// A word with a field replaced by the low bits of an `i32`.
pub(crate) fn insert_field(b: &mut FuncBuilder, word: Value, field: Field, bits: Value) -> Value {
    let mask = ((1i64 << field.width) - 1) << field.offset;
    let shifted = match field.offset {
        0 => bits,
        offset => b.binary_imm(BinaryOp::Shl, bits, i64::from(offset)),
    };
    let new = b.binary_imm(BinaryOp::And, shifted, mask);
    let old = b.binary_imm(BinaryOp::And, word, 0xFF_FFFF & !mask);
    b.binary(BinaryOp::Or, old, new)
}

/// Writes a field of a word in the image.
pub(crate) fn write_field(b: &mut FuncBuilder, at: Address, field: Field, bits: Value) {
    let word = if field.width == 24 {
        b.binary_imm(BinaryOp::And, bits, 0xFF_FFFF)
    } else {
        let old = b.load(Type::I32, at);
        insert_field(b, old, field, bits)
    };
    b.store(at, word);
}
