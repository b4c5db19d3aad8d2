//! Bits and fields of integers.

use cranelift_codegen::ir::{InstBuilder, Value as ClifValue, types};
use plcc_ir::tables::FastMap;
use plcc_ir::{ExtractOp, Field, FuncData, Inst, InstData, IntCond, Type, Value, eval};

use super::{LowerResult, Lowering, clif_type};

/// Bits with lower numbers can be tested by one instruction where they are in their word: its
/// constant is sign-extended from 32 bits.
const TESTABLE_BITS: u8 = 31;

/// Fields that are compared with constants.
#[derive(Default)]
pub(super) struct ComparedFields {
    /// How often each is.
    counts: FastMap<Value, u32>,
    /// Signed fields that have been lowered, each at the top of its word.
    raised: FastMap<Value, ClifValue>,
}

impl ComparedFields {
    pub(super) fn new(func: &FuncData) -> Self {
        let mut this = Self::default();
        for &inst in func.blocks().flat_map(|(_, block)| &block.insts) {
            if let InstData::Icmp { cond: _, args: [compared, number] } = *func.inst(inst)
                && func.constant(number).is_some()
                && let Some(InstData::Extract { .. }) = func.def_inst(compared)
            {
                *this.counts.entry(compared).or_default() += 1;
            }
        }
        this
    }
}

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

    /// A field of an integer, the result of an instruction.
    pub(super) fn extract(
        &mut self,
        inst: Inst,
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
                    if let Some(result) = self.func.result(inst) {
                        self.compared_fields.raised.insert(result, value);
                    }
                }
                if width < bits {
                    value = self.builder.ins().sshr_imm_u(value, bits - width);
                }
            }
        }
        Ok(value)
    }

    /// The operands of a comparison of a field with a constant, if nothing needs the field but such comparisons. For
    /// equality the other bits of the word are masked off; else a signed field is compared at the top of the word. In both cases
    /// the constant is moved to the place of the field, so that the field need not be moved.
    pub(super) fn compared_field(
        &mut self,
        cond: IntCond,
        [compared, number]: [Value; 2],
    ) -> LowerResult<Option<[ClifValue; 2]>> {
        let (Some(&InstData::Extract { op, arg, field }), Some(number)) =
            (self.func.def_inst(compared), self.constant(number))
        else {
            return Ok(None);
        };
        let ty = self.func.ty(arg);
        let is_only_compared =
            self.compared_fields.counts.get(&compared) == Some(&self.use_count(compared));
        let is_held = eval::extract(op, ty, Field { first: 0, ..field }, number) == number;
        if !is_only_compared || !is_held {
            return Ok(None);
        }
        let raised = self.compared_fields.raised.get(&compared).copied();
        if let Some(raised) = raised.filter(|_| field.first == 0 && number != 0) {
            let by = ty.bits() - u32::from(field.width);
            let number = self.iconst(ty, ty.wrap(number << by));
            return Ok(Some([raised, number]));
        }
        if !matches!(cond, IntCond::Eq | IntCond::Ne) {
            return Ok(None);
        }
        let word = self.value(arg)?;
        let mask = ty.wrap(field.mask() as i64);
        let masked = self.builder.ins().band_imm_s(word, mask);
        let number = self.iconst(ty, ty.wrap(number << field.first) & mask);
        Ok(Some([masked, number]))
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
