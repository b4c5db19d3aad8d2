//! Bits and fields of integers.

use cranelift_codegen::ir::{InstBuilder, Value as ClifValue, types};
use plcc_ir::{ExtractOp, Field, InstData, Type, Value};

use super::{LowerResult, Lowering, clif_type};

/// Bits with lower numbers can be tested by one instruction where they are in their word: its
/// constant is sign-extended from 32 bits.
const TESTABLE_BITS: u8 = 31;

impl Lowering<'_> {
    /// A bit of an integer, as a truth value.
    pub(super) fn bit(&mut self, arg: Value, number: u8) -> LowerResult<ClifValue> {
        let mut bits = self.value(arg)?;
        if number > 0 {
            bits = self.builder.ins().ushr_imm_u(bits, i64::from(number));
        }
        if self.func.ty(arg) != Type::I8 {
            bits = self.builder.ins().ireduce(types::I8, bits);
        }
        Ok(self.builder.ins().band_imm_u(bits, 1))
    }

    /// A truth value to branch by: 0 for false, anything else for true. A single bit of a word is
    /// tested where it is in the word.
    pub(super) fn truth(&mut self, cond: Value) -> LowerResult<ClifValue> {
        let Some(&InstData::Bit { arg, number: number @ ..TESTABLE_BITS }) =
            self.func.def_inst(cond)
        else {
            return self.value(cond);
        };
        let mut word = self.value(arg)?;
        // The instruction that tests a byte is shorter.
        if number < 8 && self.func.ty(arg) != Type::I8 {
            word = self.builder.ins().ireduce(types::I8, word);
        }
        Ok(self.builder.ins().band_imm_u(word, 1 << number))
    }

    /// A field of an integer.
    pub(super) fn extract(
        &mut self,
        op: ExtractOp,
        arg: Value,
        field: Field,
    ) -> LowerResult<ClifValue> {
        let bits = self.func.ty(arg).bits() as i64;
        let (first, width) = (i64::from(field.first), i64::from(field.width));
        let mut value = self.value(arg)?;
        match op {
            ExtractOp::Unsigned => {
                if first > 0 {
                    value = self.builder.ins().ushr_imm_u(value, first);
                }
                if first + width < bits {
                    value = self.builder.ins().band_imm_u(value, field.ones() as i64);
                }
            }
            ExtractOp::Signed => {
                if first + width < bits {
                    value = self.builder.ins().ishl_imm_u(value, bits - first - width);
                }
                if width < bits {
                    value = self.builder.ins().sshr_imm_u(value, bits - width);
                }
            }
        }
        Ok(value)
    }

    /// An integer of which a field is replaced.
    pub(super) fn insert(
        &mut self,
        [word, bits]: [Value; 2],
        field: Field,
    ) -> LowerResult<ClifValue> {
        let ty = self.func.ty(word);
        let (first, mask) = (i64::from(field.first), ty.wrap(field.mask() as i64));
        let (word, mut new) = (self.value(word)?, self.value(bits)?);
        let is_truth = self.func.ty(bits) == Type::I1;
        if is_truth && ty != Type::I8 {
            new = self.builder.ins().uextend(clif_type(ty), new);
        }
        if first > 0 {
            new = self.builder.ins().ishl_imm_u(new, first);
        }
        if !is_truth {
            new = self.builder.ins().band_imm_s(new, mask);
        }
        let rest = self.builder.ins().band_imm_s(word, !mask);
        Ok(self.builder.ins().bor(rest, new))
    }
}
