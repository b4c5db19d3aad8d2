//! The question whether a double is an integer, short.
//!
//! PMAC's variables are asked it wherever integers compute what was written for doubles. x86-64
//! cuts a double in a vector register with one instruction and makes it a double again with
//! another, both of four bytes and neither bound to what the register held before. CLIF has them
//! as operations on vectors.

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{Endianness, InstBuilder, MemFlagsData, Value as ClifValue, types};
use plcc_ir::{Inst, Type, Value};

use super::Lowering;

impl Lowering<'_> {
    /// A double cut to an `i32`; -2^31 for one that does not fit.
    pub(super) fn whole(&mut self, inst: Inst, arg: Value) -> ClifValue {
        let x = self.value(arg);
        if !self.is_x86 {
            let size = self.builder.ins().fabs(x);
            let end = self.builder.ins().f64const(2_147_483_648.0);
            let fits = self.builder.ins().fcmp(FloatCC::LessThan, size, end);
            let cut = self.builder.ins().fcvt_to_sint_sat(types::I32, x);
            let least = self.iconst(Type::I32, i64::from(i32::MIN));
            return self.builder.ins().select(fits, cut, least);
        }
        // Into both lanes: into one alone takes an instruction more.
        let doubles = self.builder.ins().splat(types::F64X2, x);
        let cut = self.builder.ins().x86_cvtt2dq(types::I64X2, doubles);
        let zeros = self.builder.func.dfg.constants.insert([0; 16].as_slice().into());
        let zeros = self.builder.ins().vconst(types::I64X2, zeros);
        let lanes = self.builder.ins().snarrow(cut, zeros);
        if let Some(result) = self.func.result(inst) {
            self.cut.insert(result, lanes);
        }
        // As a float: the instruction that takes one from a lane is shorter than an integer's.
        let flags = MemFlagsData::new().with_endianness(Endianness::Little);
        let floats = self.builder.ins().bitcast(types::F32X4, flags, lanes);
        let first = self.builder.ins().extractlane(floats, 0);
        self.builder.ins().bitcast(types::I32, MemFlagsData::new(), first)
    }

    /// An integer as a double.
    pub(super) fn int_to_float(&mut self, arg: Value) -> ClifValue {
        let Some(&lanes) = self.cut.get(&arg) else {
            let x = self.value(arg);
            return self.builder.ins().fcvt_from_sint(types::F64, x);
        };
        let wide = self.builder.ins().swiden_low(lanes);
        let doubles = self.builder.ins().fcvt_from_sint(types::F64X2, wide);
        self.builder.ins().extractlane(doubles, 0)
    }
}
