//! Lowers statements of L-variables, which the control computes in integers of 24 bits (two's
//! complement, wrapping).
//!
//! Values are `i32`s of which only the low 24 bits mean anything. The low bits of sums, products
//! and bit operators depend on nothing else, so a value is sign-extended from its 24 bits only for
//! operations that depend on the upper bits: divisions, remainders, comparisons, and conversions to
//! doubles.

use plcc_abi::pmac::{Format, Kind};
use plcc_ir::{
    BinaryOp, ConvertOp, ExtractOp, Field, FuncBuilder, InstBuilder, IntCond, Type, UnaryOp, Value,
};

use super::Lowerer;
use super::emit;
use super::variables::MAX_SEPARATE_STORES;
use crate::common::BrokenInvariant;
use crate::pmac::ast::{Bin, Expr, Func, Op, Target};

/// A value, and whether it is sign-extended from 24 bits. Truth values are `i1`s.
type Integer = (Value, bool);

/// The value sign-extended from its low 24 bits.
fn sign_extended(b: &mut FuncBuilder, (value, extended): Integer) -> Value {
    if extended {
        return value;
    }
    b.extract(ExtractOp::Signed, value, Field { first: 0, width: 24 })
}

impl Lowerer<'_> {
    /// Assigns an expression to one L-variable or to a range of them; it is computed once.
    pub(crate) fn assign_integer(
        &mut self,
        target: Target,
        expr: Expr,
    ) -> Result<(), BrokenInvariant> {
        let (first, count, step) = match target {
            Target::Var(Kind::L, number) => (number, 1, 0),
            Target::Range { kind: Kind::L, first, count, step } => (first, count, step),
            other => {
                return Err(BrokenInvariant::new(format!("integers are assigned to {other:?}")));
            }
        };
        let value = self.integer(expr)?;
        if count > MAX_SEPARATE_STORES {
            // The host takes doubles, which hold every integer of 24 bits exactly.
            let b = self.builder.func();
            let value = sign_extended(b, value);
            let value = b.convert(ConvertOp::IntToFloat, Type::F64, value);
            self.write_range(Kind::L, (first, count, step), value);
            return Ok(());
        }
        for k in 0..u32::from(count) {
            self.write_integer(u32::from(first) + k * u32::from(step), value)?;
        }
        Ok(())
    }

    /// Writes a value to an L-variable, in the format of its field.
    fn write_integer(&mut self, number: u32, value: Integer) -> Result<(), BrokenInvariant> {
        let bits = match self.l_format(number)? {
            Format::D | Format::C => {
                let value = sign_extended(self.builder.func(), value);
                let value = self.int_to_double(value);
                self.encode_bcd(number, value)?
            }
            Format::U | Format::S => value.0,
        };
        self.write_l(number, bits)
    }

    /// The truth value of a condition on L-variables, an `i1`.
    pub(crate) fn condition_integer(&mut self, expr: Expr) -> Result<Value, BrokenInvariant> {
        Ok(self.integer(expr)?.0)
    }

    /// The value of an expression, or the truth value of a condition.
    fn integer(&mut self, expr: Expr) -> Result<Integer, BrokenInvariant> {
        let download = self.download;
        let mut stack: Vec<Integer> = Vec::new();
        for op in download.ops(expr) {
            let mut pop = || stack.pop().ok_or_else(super::lacks_operand);
            let value = match *op {
                Op::Const(value) => (self.builder.func().constant(Type::I32, value as i64), true),
                Op::Var(_, number) => {
                    let number = u32::from(number);
                    let (_, _, field) = self.l_field(number)?;
                    let narrow = field.width < 24 || field.format != Format::U;
                    (self.read_l(number)?, narrow)
                }
                Op::Neg => (self.builder.func().unary(UnaryOp::Neg, pop()?.0), false),
                Op::Bin(op) => {
                    let (right, left) = (pop()?, pop()?);
                    self.integer_binary(op, left, right)
                }
                Op::Cmp(cmp) => {
                    let (right, left) = (pop()?, pop()?);
                    let b = self.builder.func();
                    let (left, right) = (sign_extended(b, left), sign_extended(b, right));
                    (emit::compare_ints(b, cmp, left, right), true)
                }
                Op::Both | Op::Either => {
                    let (right, left) = (pop()?, pop()?);
                    let op = if *op == Op::Both { BinaryOp::And } else { BinaryOp::Or };
                    (self.builder.func().binary(op, left.0, right.0), true)
                }
                Op::Call(Func::Abs) => {
                    let b = self.builder.func();
                    let value = sign_extended(b, pop()?);
                    let negative = b.unary(UnaryOp::Neg, value);
                    (b.binary(BinaryOp::Smax, value, negative), false)
                }
                Op::Call(Func::Int) => pop()?,
                Op::Call(_) | Op::Indirect(_) => {
                    return Err(BrokenInvariant::new(format!("integers compute no {op:?}")));
                }
            };
            stack.push(value);
        }
        stack.pop().ok_or_else(super::lacks_operand)
    }

    fn integer_binary(&mut self, op: Bin, left: Integer, right: Integer) -> Integer {
        let b = self.builder.func();
        let plain = match op {
            Bin::Add => BinaryOp::Add,
            Bin::Sub => BinaryOp::Sub,
            Bin::Mul => BinaryOp::Mul,
            Bin::And => BinaryOp::And,
            Bin::Or => BinaryOp::Or,
            Bin::Xor => BinaryOp::Xor,
            Bin::Div => {
                let (left, right) = (sign_extended(b, left), sign_extended(b, right));
                return (b.binary(BinaryOp::Sdiv, left, right), false);
            }
            Bin::Mod => {
                let (left, right) = (sign_extended(b, left), sign_extended(b, right));
                let by = b.func().constant(right);
                return match by.filter(|&by| by > 0) {
                    Some(by) => (b.binary_imm(BinaryOp::Smod, left, by), true),
                    None => (modulo(b, left, right), true),
                };
            }
        };
        let extended = left.1 && right.1 && matches!(op, Bin::And | Bin::Or | Bin::Xor);
        (b.binary(plain, left.0, right.0), extended)
    }
}

/// `a % x` for sign-extended values, with a divisor that is not known before the program runs. The
/// result is from 0 to x - 1; from x to -x - 1 if x is negative; 0 if x is 0.
fn modulo(b: &mut FuncBuilder, a: Value, x: Value) -> Value {
    let minus = b.unary(UnaryOp::Neg, x);
    let size = b.binary(BinaryOp::Smax, x, minus);
    let positive = b.icmp_imm(IntCond::Sgt, x, 0);
    // By a negative divisor -y the result lies between -y and y - 1: it is the remainder by 2y of
    // the dividend plus y, less y.
    let zero = b.constant(Type::I32, 0);
    let shift = b.select(positive, zero, size);
    let double_size = b.binary(BinaryOp::Add, size, shift);
    let from = b.binary(BinaryOp::Add, a, shift);
    let rest = b.binary(BinaryOp::Srem, from, double_size);
    let negative = b.icmp_imm(IntCond::Slt, rest, 0);
    let up = b.binary(BinaryOp::Add, rest, double_size);
    let rest = b.select(negative, up, rest);
    b.binary(BinaryOp::Sub, rest, shift)
}
