//! Conversions of doubles to integers and back, by short instructions.
//!
//! PMAC's variables are doubles. Where integer code computes with one, an integrality check stands
//! before it: the double is truncated to an integer, the integer converted back, and the two
//! doubles compared. x86-64 has an instruction for each conversion that works on vector registers,
//! takes four bytes, and does not depend on what the destination register held before. CLIF has
//! them as operations on vectors.

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{Endianness, InstBuilder, MemFlagsData, Value as ClifValue, types};
use plcc_ir::{Inst, Type, Value};

use super::{LowerResult, Lowering};

impl Lowering<'_> {
    /// A double truncated to an `i32`; -2^31 for one that does not fit.
    pub(super) fn truncate(&mut self, inst: Inst, arg: Value) -> LowerResult<ClifValue> {
        let x = self.value(arg)?;
        if !self.is_x86 {
            let size = self.builder.ins().fabs(x);
            let end = self.builder.ins().f64const(2_147_483_648.0);
            let fits = self.builder.ins().fcmp(FloatCC::LessThan, size, end);
            let truncated = self.builder.ins().fcvt_to_sint_sat(types::I32, x);
            let least = self.iconst(Type::I32, i64::from(i32::MIN));
            return Ok(self.builder.ins().select(fits, truncated, least));
        }
        // Both lanes get the double; to fill one alone takes an instruction more.
        let doubles = self.builder.ins().splat(types::F64X2, x);
        let lanes = self.truncated_lanes(doubles);
        if let Some(result) = self.func.result(inst) {
            self.truncated.insert(result, lanes);
        }
        // The lane is taken out as a float, since the instruction for that is shorter than the one
        // for an integer.
        let flags = MemFlagsData::new().with_endianness(Endianness::Little);
        let floats = self.builder.ins().bitcast(types::F32X4, flags, lanes);
        let first = self.builder.ins().extractlane(floats, 0);
        Ok(self.builder.ins().bitcast(types::I32, MemFlagsData::new(), first))
    }

    /// Two doubles truncated, as the two lower lanes of a vector of `i32`.
    pub(super) fn truncated_lanes(&mut self, doubles: ClifValue) -> ClifValue {
        let truncated = self.builder.ins().x86_cvtt2dq(types::I64X2, doubles);
        let zeros = self.builder.func.dfg.constants.insert([0; 16].as_slice().into());
        let zeros = self.builder.ins().vconst(types::I64X2, zeros);
        self.builder.ins().snarrow(truncated, zeros)
    }

    /// An integer as a double.
    pub(super) fn int_to_float(&mut self, arg: Value) -> LowerResult<ClifValue> {
        let Some(&lanes) = self.truncated.get(&arg) else {
            let x = self.value(arg)?;
            return Ok(self.builder.ins().fcvt_from_sint(types::F64, x));
        };
        let wide = self.builder.ins().swiden_low(lanes);
        let doubles = self.builder.ins().fcvt_from_sint(types::F64X2, wide);
        Ok(self.builder.ins().extractlane(doubles, 0))
    }
}
