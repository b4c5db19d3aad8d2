//! The result of each operation for given operands: the executable definition of
//! [`inst`](crate::inst).
//!
//! The interpreter and constant folding compute with these functions, and generated code is
//! tested against them.
//!
//! A value of any type is an `i64` here: an integer in the form of [`Type::wrap`], a truth value
//! as 0 or 1, a double as its bits.

use plcc_abi::{HostFn, HostType};

use crate::{
    BinaryOp, ConvertOp, ExtractOp, Field, FloatCond, FuncData, InstData, IntCond, Type, UnaryOp,
    Value,
};

fn float(bits: i64) -> f64 {
    f64::from_bits(bits as u64)
}

fn bits(value: f64) -> i64 {
    value.to_bits() as i64
}

/// The unsigned number that an integer is.
fn unsigned(ty: Type, value: i64) -> u64 {
    match ty.bits() {
        64 => value as u64,
        width => value as u64 & ((1 << width) - 1),
    }
}

/// The result of an instruction whose operands alone decide about it; `None` for one that works on memory or asks the host.
/// `get` gives the values of operands.
pub fn instruction(func: &FuncData, inst: &InstData, get: impl Fn(Value) -> i64) -> Option<i64> {
    Some(match *inst {
        InstData::Iconst { ty: _, value } => value,
        InstData::Fconst { bits } => bits as i64,
        InstData::Unary { op, arg } => unary(op, func.ty(arg), get(arg)),
        InstData::Binary { op, args: [a, b] } => binary(op, func.ty(a), get(a), get(b)),
        InstData::Icmp { cond, args: [a, b] } => icmp(cond, func.ty(a), get(a), get(b)).into(),
        InstData::Fcmp { cond, args: [a, b] } => fcmp(cond, get(a), get(b)).into(),
        InstData::Select { cond, args: [a, b] } => match get(cond) {
            0 => get(b),
            _ => get(a),
        },
        InstData::Convert { op, to, arg } => convert(op, func.ty(arg), to, get(arg)),
        InstData::Bit { arg, number } => bit(get(arg), number),
        InstData::Extract { op, arg, field } => extract(op, func.ty(arg), field, get(arg)),
        InstData::Insert { args: [word, bits], field } => {
            insert(func.ty(word), field, get(word), get(bits))
        }
        InstData::Load { .. }
        | InstData::Store { .. }
        | InstData::Unpack { .. }
        | InstData::Pack { .. }
        | InstData::IsLate
        | InstData::HostCall { .. } => return None,
    })
}

/// An argument of a host function, of type `ty`.
pub fn host_word(ty: Type, value: i64) -> u64 {
    match ty {
        Type::I64 | Type::F64 => value as u64,
        Type::I1 | Type::I8 | Type::I16 | Type::I32 => u64::from(value as u32),
    }
}

/// The result of a host function that has given a word.
pub fn host_result(function: HostFn, word: u64) -> i64 {
    match function.signature().1 {
        Some(HostType::I32) => i64::from(word as i32),
        _ => word as i64,
    }
}

/// The result of an operation on one operand `x` of type `ty`.
pub fn unary(op: UnaryOp, ty: Type, x: i64) -> i64 {
    match op {
        UnaryOp::Not => ty.wrap(!x),
        UnaryOp::Neg => ty.wrap(x.wrapping_neg()),
        UnaryOp::Fneg => bits(-float(x)),
        UnaryOp::Fabs => bits(float(x).abs()),
        UnaryOp::Fsqrt => bits(float(x).sqrt()),
        UnaryOp::Ffloor => bits(float(x).floor()),
        UnaryOp::Fceil => bits(float(x).ceil()),
        UnaryOp::Ftrunc => bits(float(x).trunc()),
        UnaryOp::Ffinite => match float(x) {
            number if number.is_nan() => bits(0.0),
            number => bits(number.clamp(-f64::MAX, f64::MAX)),
        },
    }
}

/// The result of an operation on two operands of type `ty`.
pub fn binary(op: BinaryOp, ty: Type, a: i64, b: i64) -> i64 {
    let (ua, ub) = (unsigned(ty, a), unsigned(ty, b));
    let width = u64::from(ty.bits());
    let result = match op {
        BinaryOp::Add => a.wrapping_add(b),
        BinaryOp::Sub => a.wrapping_sub(b),
        BinaryOp::Mul => a.wrapping_mul(b),
        BinaryOp::Umulh => ((u128::from(ua) * u128::from(ub)) >> width) as i64,
        BinaryOp::Sdiv => {
            if b == 0 {
                0
            } else {
                a.wrapping_div(b)
            }
        }
        BinaryOp::Srem => {
            if b == 0 {
                0
            } else {
                a.wrapping_rem(b)
            }
        }
        BinaryOp::Smod => {
            let remainder = if b == 0 { 0 } else { a.wrapping_rem(b) };
            let other_sign = remainder != 0 && (remainder < 0) != (b < 0);
            if other_sign { remainder + b } else { remainder }
        }
        BinaryOp::Udiv => ua.checked_div(ub).unwrap_or(0) as i64,
        BinaryOp::Urem => ua.checked_rem(ub).unwrap_or(0) as i64,
        BinaryOp::And => a & b,
        BinaryOp::Or => a | b,
        BinaryOp::Xor => a ^ b,
        BinaryOp::Shl => {
            if ub < width {
                a << ub
            } else {
                0
            }
        }
        BinaryOp::Lshr => {
            if ub < width {
                (ua >> ub) as i64
            } else {
                0
            }
        }
        BinaryOp::Ashr => a >> ub.min(width - 1),
        BinaryOp::Smin => a.min(b),
        BinaryOp::Smax => a.max(b),
        BinaryOp::Umin => {
            if ua < ub {
                a
            } else {
                b
            }
        }
        BinaryOp::Umax => {
            if ua > ub {
                a
            } else {
                b
            }
        }
        BinaryOp::Fadd => return bits(float(a) + float(b)),
        BinaryOp::Fsub => return bits(float(a) - float(b)),
        BinaryOp::Fmul => return bits(float(a) * float(b)),
        BinaryOp::Fdiv => return bits(float(a) / float(b)),
    };
    ty.wrap(result)
}

/// Whether a comparison holds of two integers of type `ty`.
pub fn icmp(cond: IntCond, ty: Type, a: i64, b: i64) -> bool {
    let (ua, ub) = (unsigned(ty, a), unsigned(ty, b));
    match cond {
        IntCond::Eq => a == b,
        IntCond::Ne => a != b,
        IntCond::Slt => a < b,
        IntCond::Sle => a <= b,
        IntCond::Sgt => a > b,
        IntCond::Sge => a >= b,
        IntCond::Ult => ua < ub,
        IntCond::Ule => ua <= ub,
        IntCond::Ugt => ua > ub,
        IntCond::Uge => ua >= ub,
    }
}

/// Whether a comparison holds of two doubles, given as their bits.
pub fn fcmp(cond: FloatCond, a: i64, b: i64) -> bool {
    let (a, b) = (float(a), float(b));
    match cond {
        FloatCond::Eq => a == b,
        FloatCond::Ne => a != b,
        FloatCond::Lt => a < b,
        FloatCond::Le => a <= b,
        FloatCond::Gt => a > b,
        FloatCond::Ge => a >= b,
        FloatCond::EqOrNan => a == b || a.is_nan() || b.is_nan(),
    }
}

/// The result of a conversion of `x` from type `from` to type `to`.
pub fn convert(op: ConvertOp, from: Type, to: Type, x: i64) -> i64 {
    match op {
        ConvertOp::Sext if from == Type::I1 => to.wrap(-x),
        ConvertOp::Sext => x,
        ConvertOp::Zext => to.wrap(unsigned(from, x) as i64),
        ConvertOp::Trunc => to.wrap(x),
        ConvertOp::IntToFloat => bits(x as f64),
        ConvertOp::FloatToInt => float_to_int(float(x)),
        ConvertOp::IsInteger => i64::from(float_to_int(float(x)) as f64 == float(x)),
        ConvertOp::IsIntegerOrNan => {
            i64::from(float(x).is_nan() || float_to_int(float(x)) as f64 == float(x))
        }
        ConvertOp::Bitcast => x,
    }
}

/// The bit of an integer with a number.
pub fn bit(x: i64, number: u8) -> i64 {
    x.wrapping_shr(number.into()) & 1
}

/// A field of an integer `x` of type `ty`.
pub fn extract(op: ExtractOp, ty: Type, field: Field, x: i64) -> i64 {
    let top = x.wrapping_shl(64u32.wrapping_sub(u32::from(field.first) + u32::from(field.width)));
    let down = 64u32.wrapping_sub(field.width.into());
    ty.wrap(match op {
        ExtractOp::Unsigned => (top as u64).wrapping_shr(down) as i64,
        ExtractOp::Signed => top.wrapping_shr(down),
    })
}

/// The integer `x`, of type `ty`, with a field replaced by the low bits of `bits`.
pub fn insert(ty: Type, field: Field, x: i64, bits: i64) -> i64 {
    let mask = field.mask() as i64;
    ty.wrap(x & !mask | bits.wrapping_shl(field.first.into()) & mask)
}

fn float_to_int(x: f64) -> i64 {
    let fits = x.abs() < 2_147_483_648.0;
    i64::from(if fits { x as i32 } else { i32::MIN })
}

/// Whether a pass may replace an operation by its result `value`, a constant of type `ty`. Only NaN
/// may not become a constant: it has many bit patterns, and which of them an operation gives
/// depends on the machine.
pub fn may_become_constant(ty: Type, value: i64) -> bool {
    ty != Type::F64 || !float(value).is_nan()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overflow_and_division_by_zero_have_their_documented_results() {
        let min = i64::from(i16::MIN);
        for (op, a, b, result) in [
            (BinaryOp::Sdiv, min, -1, min),
            (BinaryOp::Sdiv, 7, 0, 0),
            (BinaryOp::Srem, min, -1, 0),
            (BinaryOp::Srem, -7, 2, -1),
            (BinaryOp::Smod, -7, 3, 2),
            (BinaryOp::Smod, 7, -3, -2),
            (BinaryOp::Smod, -6, 3, 0),
            (BinaryOp::Smod, 7, 0, 0),
            (BinaryOp::Smod, min, -1, 0),
            (BinaryOp::Smod, -1, min, -1),
            (BinaryOp::Smod, 1, min, min + 1),
            (BinaryOp::Udiv, -1, 2, 0x7FFF),
            (BinaryOp::Shl, 1, 16, 0),
            (BinaryOp::Shl, 1, 15, min),
            (BinaryOp::Lshr, -1, 15, 1),
            (BinaryOp::Ashr, min, 99, -1),
            (BinaryOp::Umax, -1, 1, -1),
            (BinaryOp::Umulh, -1, -1, -2),
            (BinaryOp::Umulh, 0x4000, 12, 3),
            (BinaryOp::Add, 0x7FFF, 1, min),
        ] {
            assert_eq!(binary(op, Type::I16, a, b), result, "{} {a} {b}", op.name());
        }
        assert_eq!(binary(BinaryOp::Sdiv, Type::I64, i64::MIN, -1), i64::MIN);
        assert_eq!(binary(BinaryOp::Umulh, Type::I64, -1, -1), -2);
        assert_eq!(convert(ConvertOp::Sext, Type::I1, Type::I32, 1), -1);
        assert_eq!(convert(ConvertOp::Zext, Type::I8, Type::I32, -1), 255);
        let field = Field { first: 4, width: 8 };
        assert_eq!(extract(ExtractOp::Unsigned, Type::I16, field, 0x1F32), 0xF3);
        assert_eq!(extract(ExtractOp::Signed, Type::I16, field, 0x1F32), -13);
        assert_eq!(insert(Type::I16, field, 0x1F32, 0x5AB), 0x1AB2);
        assert_eq!(insert(Type::I16, Field::bit(15), 0x1F32, 1), 0x1F32 + min);
        let whole = Field { first: 0, width: 16 };
        assert_eq!(extract(ExtractOp::Unsigned, Type::I16, whole, min), min);
        assert_eq!(insert(Type::I16, whole, 7, min), min);
        let whole = Field { first: 0, width: 64 };
        assert_eq!(extract(ExtractOp::Unsigned, Type::I64, whole, -3), -3);
        assert_eq!(insert(Type::I64, whole, 7, -3), -3);
        assert_eq!((bit(min, 15), bit(min, 14), bit(i64::MIN, 63)), (1, 0, 1));
        let truncated = |x: f64| convert(ConvertOp::FloatToInt, Type::F64, Type::I32, bits(x));
        for integer in [0, 1, -1, 8_388_607, i64::from(i32::MAX), i64::from(i32::MIN)] {
            assert_eq!(truncated(integer as f64), integer);
        }
        let is_integer = |op, x: f64| convert(op, Type::F64, Type::I1, bits(x));
        for (x, holds) in [(-0.0, 1), (-7.0, 1), (0.5, 0), (2147483648.0, 0), (f64::INFINITY, 0)] {
            for op in [ConvertOp::IsInteger, ConvertOp::IsIntegerOrNan] {
                assert_eq!(is_integer(op, x), holds, "{x}");
            }
        }
        assert_eq!(is_integer(ConvertOp::IsInteger, f64::NAN), 0);
        assert_eq!(is_integer(ConvertOp::IsIntegerOrNan, f64::NAN), 1);
        for other in [0.5, -0.5, 2147483648.0, -2147483649.0, 1e300, f64::INFINITY, f64::NAN] {
            assert_ne!(truncated(other) as f64, other);
        }
        assert!(fcmp(FloatCond::Ne, bits(f64::NAN), bits(f64::NAN)));
        assert!(fcmp(FloatCond::EqOrNan, bits(f64::NAN), bits(1.0)));
        assert!(fcmp(FloatCond::EqOrNan, bits(0.0), bits(-0.0)));
        assert_eq!(unary(UnaryOp::Not, Type::I1, 1), 0);
        for (x, result) in [
            (f64::NAN, 0.0),
            (f64::INFINITY, f64::MAX),
            (f64::NEG_INFINITY, -f64::MAX),
            (-0.0, -0.0),
            (-f64::MAX, -f64::MAX),
            (2.5, 2.5),
        ] {
            assert_eq!(unary(UnaryOp::Ffinite, Type::F64, bits(x)), bits(result), "{x}");
        }
    }
}
