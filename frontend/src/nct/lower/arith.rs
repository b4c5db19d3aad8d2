//! Lowers loads, stores and arithmetic with the status flags that they write (NCT 4.5 to 4.9).
//!
//! A `guard` is an i1 that says whether the statement is done at all: an indirect access whose
//! address is not valid does nothing but set F0080 or F0082. `None` stands for a statement that is
//! always done. `after` is the set of registers and flags that can be read after the statement;
//! the others are not computed.

use plcc_ir::{BinaryOp, InstBuilder, IntCond, Type, Value};

use super::memory::{Bcd, Indirect};
use super::{Lowerer, Result};
use crate::nct::{
    ast::{Arith, Bit, Operand, Variable, Word},
    lower::liveness::LiveSet,
    status_flags::{
        BCD_SIGN, CARRY, HIGH_WORD, MUL_OVERFLOW, NOT_BCD, OVERFLOW, SIGN, SYNTAX, ZERO,
    },
};

/// The operation of the IR. A division is done by [`Lowerer::divide`], which has a dividend of 32
/// bits.
fn binary(op: Arith) -> BinaryOp {
    match op {
        Arith::Add => BinaryOp::Add,
        Arith::Sub => BinaryOp::Sub,
        Arith::Mul => BinaryOp::Mul,
        Arith::Div => BinaryOp::Udiv,
        Arith::And => BinaryOp::And,
        Arith::Or => BinaryOp::Or,
        Arith::Xor => BinaryOp::Xor,
    }
}

impl Lowerer<'_> {
    /// Writes status flags, which lie in one byte, if the guard holds.
    fn flags(&mut self, guard: Option<Value>, flags: &[(Bit, Value)]) -> Result {
        let Some(&(Bit { space, byte, .. }, _)) = flags.first() else { return Ok(()) };
        let mut bits = Vec::with_capacity(flags.len());
        for &(flag, value) in flags {
            let value = match guard {
                None => value,
                Some(guard) => {
                    let old = self.bit(flag)?;
                    self.builder.func().select(guard, value, old)
                }
            };
            bits.push((flag.bit, value));
        }
        self.store_bits(space, byte, &bits)
    }

    /// Writes F0080 and F0082 of an indirect access.
    fn address_flags(&mut self, to: &Indirect) -> Result {
        self.flags(None, &[(SYNTAX, to.syntax), (NOT_BCD, to.not_bcd)])
    }

    /// The value of an operand, an i16, and the guard of an indirect one.
    pub(super) fn operand(&mut self, operand: Operand) -> Result<(Value, Option<Value>)> {
        let (negate, variable) = match operand {
            Operand::Const(value) => {
                return Ok((self.builder.func().constant(Type::I16, value.into()), None));
            }
            Operand::Load { negate, place: variable } => (negate, variable),
        };
        match variable {
            Variable::Bit(bit) => {
                let mut value = self.bit(bit)?;
                if negate {
                    value = self.not(value);
                }
                Ok((self.builder.func().zextend_or_trunc(Type::I16, value), None))
            }
            Variable::Word(word) => {
                let (mut value, guard) = match word {
                    Word::Indirect(at) => {
                        let to = self.indirect(at)?;
                        let value = self.indirect_word(&to);
                        self.address_flags(&to)?;
                        (value, Some(to.ok))
                    }
                    word => (self.word(word)?, None),
                };
                if negate {
                    value = self.not(value);
                }
                Ok((value, guard))
            }
        }
    }

    /// OP becomes the operand.
    pub(super) fn load(&mut self, operand: Operand) -> Result {
        let (mut value, guard) = self.operand(operand)?;
        if guard.is_some() {
            let op = self.op();
            value = self.guarded(guard, value, op);
        }
        self.set_op(value);
        Ok(())
    }

    /// A variable becomes OP, or its complement.
    pub(super) fn store(&mut self, negate: bool, variable: Variable) -> Result {
        let mut value = self.op();
        if negate {
            value = self.not(value);
        }
        match variable {
            Variable::Bit(bit) => {
                let value = self.builder.func().zextend_or_trunc(Type::I1, value);
                self.store_bit(bit, value)?;
            }
            Variable::Word(Word::Indirect(at)) => {
                let to = self.indirect(at)?;
                let old = self.indirect_word(&to);
                let value = self.guarded(Some(to.ok), value, old);
                self.store_indirect(&to, value);
                self.address_flags(&to)?;
            }
            Variable::Word(word) => self.store_word(word, value)?,
        }
        Ok(())
    }

    /// OP becomes OP combined with the operand.
    pub(super) fn arith(&mut self, op: Arith, operand: Operand, after: LiveSet) -> Result {
        let (mut with, guard) = self.operand(operand)?;
        if op == Arith::And && matches!(operand, Operand::Load { place: Variable::Bit(_), .. }) {
            // AND with a bit changes only bit 0 of OP.
            with = self.builder.func().binary_imm(BinaryOp::Or, with, -2);
        }
        let old = self.op();
        self.combine(op, old, with, guard, after)
    }

    /// OP becomes `a` combined with `b` if the guard holds.
    pub(super) fn combine(
        &mut self,
        op: Arith,
        a: Value,
        b: Value,
        guard: Option<Value>,
        after: LiveSet,
    ) -> Result {
        let value = match op {
            Arith::Mul => self.multiply(a, b, guard, after)?,
            Arith::Div => self.divide(a, b, guard, after)?,
            _ => {
                let value = self.builder.func().binary(binary(op), a, b);
                self.sum_flags(op, (a, b), value, guard, after)?;
                value
            }
        };
        let value = self.guarded(guard, value, a);
        self.set_op(value);
        Ok(())
    }

    /// Writes F0040, F0046 and F0047 of a sum or difference, as far as they can be read.
    fn sum_flags(
        &mut self,
        op: Arith,
        (a, b): (Value, Value),
        value: Value,
        guard: Option<Value>,
        after: LiveSet,
    ) -> Result {
        let mut bits = vec![];
        let carry = match op {
            Arith::Add => Some((value, a)),
            Arith::Sub => Some((a, b)),
            _ => return Ok(()),
        };
        if let Some((less, than)) = carry.filter(|_| after.has(LiveSet::CARRY)) {
            bits.push((CARRY, self.builder.func().icmp(IntCond::Ult, less, than)));
        }
        bits.extend(self.value_flags(value, after));
        self.flags(guard, &bits)
    }

    /// F0046 and F0047 of a result, as far as they can be read.
    fn value_flags(&mut self, value: Value, after: LiveSet) -> Vec<(Bit, Value)> {
        let mut bits = vec![];
        if after.has(LiveSet::ZERO) {
            bits.push((ZERO, self.is_zero(value)));
        }
        if after.has(LiveSet::SIGN) {
            bits.push((SIGN, self.builder.func().icmp_imm(IntCond::Slt, value, 0)));
        }
        bits
    }

    /// An i16 as an i32, without its sign.
    fn wide(&mut self, value: Value) -> Value {
        self.builder.func().zextend_or_trunc(Type::I32, value)
    }

    /// The low word of a product. Writes its high word and F0083 as far as they can be read.
    fn multiply(
        &mut self,
        a: Value,
        b: Value,
        guard: Option<Value>,
        after: LiveSet,
    ) -> Result<Value> {
        let (a, b) = (self.wide(a), self.wide(b));
        let func = self.builder.func();
        let product = func.binary(BinaryOp::Mul, a, b);
        let low = func.zextend_or_trunc(Type::I16, product);
        if !after.has(LiveSet::HIGH) && !after.has(LiveSet::MUL_OVERFLOW) {
            return Ok(low);
        }
        let high = func.binary_imm(BinaryOp::Lshr, product, 16);
        let high = func.zextend_or_trunc(Type::I16, high);
        if after.has(LiveSet::HIGH) {
            let old = if guard.is_some() { self.word(HIGH_WORD)? } else { high };
            let value = self.guarded(guard, high, old);
            self.store_word(HIGH_WORD, value)?;
        }
        if after.has(LiveSet::MUL_OVERFLOW) {
            let some = self.builder.func().icmp_imm(IntCond::Ne, high, 0);
            self.flags(guard, &[(MUL_OVERFLOW, some)])?;
        }
        Ok(low)
    }

    /// The quotient of a 32-bit dividend, whose high word is F000 and F001. Writes the remainder
    /// and F0080 as far as they can be read. By zero the quotient is `a`, and the remainder is not
    /// written.
    fn divide(
        &mut self,
        a: Value,
        b: Value,
        guard: Option<Value>,
        after: LiveSet,
    ) -> Result<Value> {
        let high = self.word(HIGH_WORD)?;
        let (low, upper, divisor) = (self.wide(a), self.wide(high), self.wide(b));
        let func = self.builder.func();
        let upper = func.binary_imm(BinaryOp::Shl, upper, 16);
        let dividend = func.binary(BinaryOp::Or, upper, low);
        let quotient = func.binary(BinaryOp::Udiv, dividend, divisor);
        let rest = func.binary(BinaryOp::Urem, dividend, divisor);
        let quotient = func.zextend_or_trunc(Type::I16, quotient);
        let rest = func.zextend_or_trunc(Type::I16, rest);
        let by_zero = self.is_zero(b);
        if after.has(LiveSet::SYNTAX) {
            self.flags(guard, &[(SYNTAX, by_zero)])?;
        }
        if after.has(LiveSet::HIGH) {
            let rest = self.builder.func().select(by_zero, high, rest);
            let rest = self.guarded(guard, rest, high);
            self.store_word(HIGH_WORD, rest)?;
        }
        Ok(self.builder.func().select(by_zero, a, quotient))
    }

    /// The variable becomes itself, or its complement, combined with OP.
    pub(super) fn update(
        &mut self,
        op: Arith,
        negate: bool,
        variable: Variable,
        after: LiveSet,
    ) -> Result {
        let with = self.op();
        match variable {
            Variable::Bit(bit) => {
                let mut old = self.bit(bit)?;
                if negate {
                    old = self.not(old);
                }
                let with = self.builder.func().zextend_or_trunc(Type::I1, with);
                let value = self.builder.func().binary(binary(op), old, with);
                self.store_bit(bit, value)?;
            }
            Variable::Word(Word::Indirect(at)) => {
                let to = self.indirect(at)?;
                let before = self.indirect_word(&to);
                let old = if negate { self.not(before) } else { before };
                let value = self.builder.func().binary(binary(op), old, with);
                let kept = self.guarded(Some(to.ok), value, before);
                self.store_indirect(&to, kept);
                self.address_flags(&to)?;
                self.sum_flags(op, (old, with), value, Some(to.ok), after)?;
            }
            Variable::Word(word) => {
                let mut old = self.word(word)?;
                if negate {
                    old = self.not(old);
                }
                let value = self.builder.func().binary(binary(op), old, with);
                self.store_word(word, value)?;
                self.sum_flags(op, (old, with), value, None, after)?;
            }
        }
        Ok(())
    }

    /// BCD to binary; the result is negative if F0087 is 1.
    pub(super) fn bin(&mut self, after: LiveSet) -> Result {
        let op = self.op();
        let word = self.wide(op);
        let Bcd { number, wrong } = self.take_bcd(word);
        let sign = self.bit(BCD_SIGN)?;
        let func = self.builder.func();
        let value = func.zextend_or_trunc(Type::I16, number);
        let negative = func.unary(plcc_ir::UnaryOp::Neg, value);
        let value = func.select(sign, negative, value);
        let result = func.select(wrong, op, value);
        self.flags(None, &[(NOT_BCD, wrong)])?;
        let right = self.not(wrong);
        let bits = self.value_flags(value, after);
        self.flags(Some(right), &bits)?;
        self.set_op(result);
        Ok(())
    }

    /// Binary to BCD.
    pub(super) fn bcd(&mut self, after: LiveSet) -> Result {
        let op = self.op();
        let func = self.builder.func();
        let negative = func.icmp_imm(IntCond::Slt, op, 0);
        let negated = func.unary(plcc_ir::UnaryOp::Neg, op);
        let value = func.select(negative, negated, op);
        let over = func.icmp_imm(IntCond::Ugt, value, 9999);
        let mut result = func.binary_imm(BinaryOp::Urem, value, 10);
        for (divisor, shift) in [(10, 4), (100, 8), (1000, 12)] {
            let digit = func.binary_imm(BinaryOp::Udiv, value, divisor);
            let digit = func.binary_imm(BinaryOp::Urem, digit, 10);
            let digit = func.binary_imm(BinaryOp::Shl, digit, shift);
            result = func.binary(BinaryOp::Or, result, digit);
        }
        let result = func.select(over, op, result);
        self.flags(None, &[(OVERFLOW, over)])?;
        let within = self.not(over);
        let mut bits = vec![];
        if after.has(LiveSet::ZERO) {
            bits.push((ZERO, self.is_zero(op)));
        }
        if after.has(LiveSet::SIGN) {
            bits.push((SIGN, negative));
        }
        self.flags(Some(within), &bits)?;
        self.set_op(result);
        Ok(())
    }
}
