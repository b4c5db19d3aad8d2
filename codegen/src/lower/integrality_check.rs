//! Conversions of doubles to integers and back, and integrality checks, by short instructions.
//!
//! PMAC's variables are doubles. Where integer code computes with one, an integrality check is before it: the double is
//! truncated to an integer, the integer converted back, and the two doubles compared. x86-64 has an instruction for each
//! conversion that works on vector registers, takes four bytes, and does not depend on what the destination register held
//! before. CLIF has them as operations on vectors. A check and the conversions of its double in the same block share them.

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{Endianness, InstBuilder, MemFlagsData, Value as ClifValue, types};
use plcc_ir::tables::FastMap;
use plcc_ir::{Block, ConvertOp, Inst, InstData, Type, Value};

use super::{LowerResult, Lowering};

/// What was made of doubles on x86-64.
#[derive(Default)]
pub(super) struct Truncated {
    /// For each result of a truncation the vector whose lowest lane holds it, from which it is converted back in fewer
    /// bytes.
    integers: FastMap<Value, ClifValue>,
    /// For each double that was truncated: in which block, that vector, and the integer as a double if that was needed.
    doubles: FastMap<Value, (Block, ClifValue, Option<ClifValue>)>,
}

impl Lowering<'_> {
    /// A double truncated to an `i32`; -2^31 for one that does not fit.
    pub(super) fn truncate(&mut self, inst: Inst, arg: Value) -> LowerResult<ClifValue> {
        if !self.is_x86 {
            let x = self.value(arg)?;
            let size = self.builder.ins().fabs(x);
            let end = self.builder.ins().f64const(2_147_483_648.0);
            let fits = self.builder.ins().fcmp(FloatCC::LessThan, size, end);
            let truncated = self.builder.ins().fcvt_to_sint_sat(types::I32, x);
            let least = self.iconst(Type::I32, i64::from(i32::MIN));
            return Ok(self.builder.ins().select(fits, truncated, least));
        }
        let lanes = self.lanes_of(arg)?;
        if let Some(result) = self.func.result(inst) {
            self.truncated.integers.insert(result, lanes);
        }
        // The lane is taken out as a float, since the instruction for that is shorter than the one
        // for an integer.
        let flags = MemFlagsData::new().with_endianness(Endianness::Little);
        let floats = self.builder.ins().bitcast(types::F32X4, flags, lanes);
        let first = self.builder.ins().extractlane(floats, 0);
        Ok(self.builder.ins().bitcast(types::I32, MemFlagsData::new(), first))
    }

    /// A vector whose lowest lane is a double truncated to an `i32`.
    fn lanes_of(&mut self, double: Value) -> LowerResult<ClifValue> {
        if let Some(&(block, lanes, _)) = self.truncated.doubles.get(&double)
            && block == self.ir_block
        {
            return Ok(lanes);
        }
        let x = self.value(double)?;
        // Both lanes get the double; to fill one alone takes an instruction more.
        let doubles = self.builder.ins().splat(types::F64X2, x);
        let lanes = self.truncated_lanes(doubles);
        self.truncated.doubles.insert(double, (self.ir_block, lanes, None));
        Ok(lanes)
    }

    /// Two doubles truncated, as the two lower lanes of a vector of `i32`.
    pub(super) fn truncated_lanes(&mut self, doubles: ClifValue) -> ClifValue {
        let truncated = self.builder.ins().x86_cvtt2dq(types::I64X2, doubles);
        let zeros = self.builder.func.dfg.constants.insert([0; 16].as_slice().into());
        let zeros = self.builder.ins().vconst(types::I64X2, zeros);
        self.builder.ins().snarrow(truncated, zeros)
    }

    /// The integer in the lowest lane of a vector of `i32`, as a double.
    fn lane_to_float(&mut self, lanes: ClifValue) -> ClifValue {
        let wide = self.builder.ins().swiden_low(lanes);
        let doubles = self.builder.ins().fcvt_from_sint(types::F64X2, wide);
        self.builder.ins().extractlane(doubles, 0)
    }

    /// An integer as a double.
    pub(super) fn int_to_float(&mut self, arg: Value) -> LowerResult<ClifValue> {
        let Some(&lanes) = self.truncated.integers.get(&arg) else {
            let x = self.value(arg)?;
            return Ok(self.builder.ins().fcvt_from_sint(types::F64, x));
        };
        let double = match self.func.def_inst(arg) {
            Some(&InstData::Convert { op: ConvertOp::FloatToInt, to: _, arg: double }) => double,
            _ => return Ok(self.lane_to_float(lanes)),
        };
        match self.truncated.doubles.get(&double) {
            // What was computed in the block of the truncation is there wherever its result is.
            Some(&(_, of, Some(back))) if of == lanes => Ok(back),
            Some(&(block, of, None)) if (block, of) == (self.ir_block, lanes) => {
                self.truncated_double(double)
            }
            _ => Ok(self.lane_to_float(lanes)),
        }
    }

    /// A double truncated to an `i32`, as a double.
    fn truncated_double(&mut self, double: Value) -> LowerResult<ClifValue> {
        let lanes = self.lanes_of(double)?;
        if let Some(&(_, _, Some(back))) = self.truncated.doubles.get(&double) {
            return Ok(back);
        }
        let back = self.lane_to_float(lanes);
        self.truncated.doubles.insert(double, (self.ir_block, lanes, Some(back)));
        Ok(back)
    }

    /// Whether a double was truncated and converted back in the current block, so that it can be checked again by one
    /// comparison.
    pub(super) fn is_checked_here(&self, double: Value) -> bool {
        let known = self.truncated.doubles.get(&double);
        known.is_some_and(|&(block, _, back)| block == self.ir_block && back.is_some())
    }

    /// Whether a double is an integer of 32 bits, which is what a comparison of the two says.
    pub(super) fn is_integer(&mut self, double: Value, cond: FloatCC) -> LowerResult<ClifValue> {
        let back = match self.is_x86 {
            true => self.truncated_double(double)?,
            false => {
                let x = self.value(double)?;
                // One that does not fit becomes the integer that is nearest, which is not equal to it.
                let integer = self.builder.ins().fcvt_to_sint_sat(types::I32, x);
                self.builder.ins().fcvt_from_sint(types::F64, integer)
            }
        };
        let x = self.value(double)?;
        Ok(self.builder.ins().fcmp(cond, back, x))
    }
}
