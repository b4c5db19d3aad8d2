//! Writing instructions: one trait for the front ends, which build functions, and for the passes, which change them.
//!
//! Whoever writes implements [`InstBuilder`] by saying where a new instruction goes, and what is kept in mind of its result.
//! Writing can't fail: every method returns a value. So where a rule of a pass returns `None`, that means that the rule
//! does not apply, and never that code has been written by halves.

use crate::{
    Address, BinaryOp, ConvertOp, ExtractOp, Field, FloatCond, FuncData, InstData, IntCond, Type,
    UnaryOp, Value,
};

/// Added to a double whose magnitude is at most 2^50, this gives a sum between 2^52 and 2^53. Doubles of
/// that size are integers, so the sum is rounded to one (ties to even), and its lowest bits are those of
/// the double rounded to the nearest integer.
pub const ROUNDING: f64 = 6_755_399_441_055_744.0;

/// A place in a function at which new instructions are written, one after the other.
pub trait InstBuilder {
    /// The function.
    fn func(&self) -> &FuncData;

    /// Writes an instruction and returns its result. A store and some calls have none; for them this is [`Value::NONE`],
    /// which the verifier refuses wherever it is used.
    fn build(&mut self, data: InstData) -> Value;

    /// A constant: an integer, which is cut to its type, or the bits of a double.
    fn constant(&mut self, ty: Type, value: i64) -> Value {
        self.build(InstData::constant(ty, value))
    }

    /// A constant double.
    fn fconst(&mut self, value: f64) -> Value {
        self.build(InstData::Fconst { bits: value.to_bits() })
    }

    /// An operation on one operand.
    fn unary(&mut self, op: UnaryOp, arg: Value) -> Value {
        self.build(InstData::Unary { op, arg })
    }

    /// A NOT.
    fn not(&mut self, arg: Value) -> Value {
        self.unary(UnaryOp::Not, arg)
    }

    /// An operation on two operands of one type.
    fn binary(&mut self, op: BinaryOp, a: Value, b: Value) -> Value {
        self.build(InstData::Binary { op, args: [a, b] })
    }

    /// An operation on an operand and a constant, which is cut to the operand's type and written before.
    fn binary_imm(&mut self, op: BinaryOp, a: Value, b: i64) -> Value {
        let b = self.constant(self.func().ty(a), b);
        self.binary(op, a, b)
    }

    /// A comparison of two integers.
    fn icmp(&mut self, cond: IntCond, a: Value, b: Value) -> Value {
        self.build(InstData::Icmp { cond, args: [a, b] })
    }

    /// A comparison of an integer with a constant, which is cut to the integer's type and written before.
    fn icmp_imm(&mut self, cond: IntCond, a: Value, b: i64) -> Value {
        let b = self.constant(self.func().ty(a), b);
        self.icmp(cond, a, b)
    }

    /// A comparison of two doubles.
    fn fcmp(&mut self, cond: FloatCond, a: Value, b: Value) -> Value {
        self.build(InstData::Fcmp { cond, args: [a, b] })
    }

    /// A choice: `a` if `cond` is true, else `b`.
    fn select(&mut self, cond: Value, a: Value, b: Value) -> Value {
        self.build(InstData::Select { cond, args: [a, b] })
    }

    /// A conversion to another type.
    fn convert(&mut self, op: ConvertOp, to: Type, arg: Value) -> Value {
        self.build(InstData::Convert { op, to, arg })
    }

    /// The reading of a bit of an integer; gives an `i1`.
    fn bit(&mut self, arg: Value, number: u8) -> Value {
        self.build(InstData::Bit { arg, number })
    }

    /// The reading of a field of an integer.
    fn extract(&mut self, op: ExtractOp, arg: Value, field: Field) -> Value {
        self.build(InstData::Extract { op, arg, field })
    }

    /// The replacing of a field of an integer: by the low bits of `bits`, or by an `i1` if the field is one bit.
    fn insert(&mut self, word: Value, bits: Value, field: Field) -> Value {
        self.build(InstData::Insert { args: [word, bits], field })
    }

    /// A load from the process image.
    fn load(&mut self, ty: Type, at: Address) -> Value {
        self.build(InstData::Load { ty, at })
    }

    /// A store to the process image.
    fn store(&mut self, at: Address, value: Value) {
        self.build(InstData::Store { at, value });
    }

    /// A signed integer in a wider, narrower or the same type. A truth value is its lowest bit.
    fn sextend_or_trunc(&mut self, to: Type, arg: Value) -> Value {
        resize(self, ConvertOp::Sext, to, arg)
    }

    /// An unsigned integer or a truth value in a wider, narrower or the same type.
    fn zextend_or_trunc(&mut self, to: Type, arg: Value) -> Value {
        resize(self, ConvertOp::Zext, to, arg)
    }

    /// The integrality check of a double. Returns the integer, an `i32`, and whether the double is equal to it;
    /// with `never_nan`, which says that the double is not NaN, by the shorter operation.
    fn integrality_check(&mut self, double: Value, never_nan: bool) -> (Value, Value) {
        let op = if never_nan { ConvertOp::IsIntegerOrNan } else { ConvertOp::IsInteger };
        let integer = self.convert(ConvertOp::FloatToInt, Type::I32, double);
        (integer, self.convert(op, Type::I1, double))
    }

    /// The same for a value that is a double or an `i64` with the bits of one. Of bits those of -0 are not those of
    /// an integer.
    fn integrality_check_of_bits(&mut self, value: Value) -> (Value, Value) {
        if self.func().ty(value) == Type::F64 {
            return self.integrality_check(value, false);
        }
        let double = self.convert(ConvertOp::Bitcast, Type::F64, value);
        let integer = self.convert(ConvertOp::FloatToInt, Type::I32, double);
        let back = self.convert(ConvertOp::IntToFloat, Type::F64, integer);
        let back = self.convert(ConvertOp::Bitcast, Type::I64, back);
        (integer, self.icmp(IntCond::Eq, back, value))
    }
}

fn resize<B: InstBuilder + ?Sized>(
    builder: &mut B,
    extend: ConvertOp,
    to: Type,
    arg: Value,
) -> Value {
    match to.bits().cmp(&builder.func().ty(arg).bits()) {
        std::cmp::Ordering::Equal => arg,
        std::cmp::Ordering::Less if to == Type::I1 => builder.bit(arg, 0),
        std::cmp::Ordering::Less => builder.convert(ConvertOp::Trunc, to, arg),
        std::cmp::Ordering::Greater => builder.convert(extend, to, arg),
    }
}
