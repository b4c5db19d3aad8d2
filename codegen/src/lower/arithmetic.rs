//! Arithmetic. Where a CLIF operation would trap, or is not defined as the IR's is, it is guarded
//! here: divisions, and shifts by the width or more.

use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::{InstBuilder, MemFlagsData, Value as ClifValue, types};
use plcc_ir::{BinaryOp, ConvertOp, FloatCond, Inst, InstData, IntCond, Type, UnaryOp, Value};

use super::{LowerResult, Lowering, clif_type};

impl Lowering<'_> {
    pub(super) fn unary(&mut self, op: UnaryOp, arg: Value) -> LowerResult<ClifValue> {
        let ty = self.func.ty(arg);
        let x = self.value(arg)?;
        Ok(match op {
            UnaryOp::Not if ty == Type::I1 => self.builder.ins().bxor_imm_u(x, 1),
            UnaryOp::Not => self.builder.ins().bnot(x),
            UnaryOp::Neg => self.builder.ins().ineg(x),
            UnaryOp::Fneg => self.builder.ins().fneg(x),
            UnaryOp::Fabs => self.builder.ins().fabs(x),
            UnaryOp::Fsqrt => self.builder.ins().sqrt(x),
            UnaryOp::Ffloor => self.builder.ins().floor(x),
            UnaryOp::Fceil => self.builder.ins().ceil(x),
            UnaryOp::Ftrunc => self.builder.ins().trunc(x),
            UnaryOp::Ffinite => self.finite(x),
        })
    }

    /// The finite double that is nearest. Nearly every double is finite, so what makes one of the
    /// others is in a cold block.
    fn finite(&mut self, x: ClifValue) -> ClifValue {
        let (other, join) = (self.builder.create_block(), self.builder.create_block());
        let result = self.builder.append_block_param(join, types::F64);
        // The difference of an infinity or NaN from itself is NaN, that of any other double is 0.
        let nothing = self.builder.ins().fsub(x, x);
        let is_finite = self.builder.ins().fcmp(FloatCC::GreaterThanOrEqual, nothing, nothing);
        self.builder.ins().brif(is_finite, join, &[x.into()], other, &[]);
        self.builder.set_cold_block(other);
        self.builder.switch_to_block(other);
        self.builder.seal_block(other);
        let (high, low) =
            (self.builder.ins().f64const(f64::MAX), self.builder.ins().f64const(-f64::MAX));
        let zero = self.builder.ins().f64const(0.0);
        let positive = self.builder.ins().fcmp(FloatCC::GreaterThan, x, zero);
        let negative = self.builder.ins().fcmp(FloatCC::LessThan, x, zero);
        let lower = self.builder.ins().select(negative, low, zero);
        let nearest = self.builder.ins().select(positive, high, lower);
        self.builder.ins().jump(join, &[nearest.into()]);
        self.builder.switch_to_block(join);
        self.builder.seal_block(join);
        if self.cold {
            self.builder.set_cold_block(join);
        }
        result
    }

    /// An operation on two operands, whose result is used `result_uses` times.
    pub(super) fn binary(
        &mut self,
        op: BinaryOp,
        mut args: [Value; 2],
        result_uses: u32,
    ) -> LowerResult<ClifValue> {
        // Only as second operand is a constant loaded by the instruction that uses it. A sum or product with a number does
        // not depend on the order, also if the other operand is NaN.
        let number = |value: Value| match self.func.def_inst(value) {
            Some(&InstData::Fconst { bits }) => !f64::from_bits(bits).is_nan(),
            _ => false,
        };
        if matches!(op, BinaryOp::Fadd | BinaryOp::Fmul) && number(args[0]) && !number(args[1]) {
            args.reverse();
        }
        let ty = self.func.ty(args[0]);
        let (a, mut b) = (self.value(args[0])?, self.value(args[1])?);
        if let (Some(InstData::Load { .. }), Some(&InstData::Fconst { bits })) =
            (self.func.def_inst(args[0]), self.func.def_inst(args[1]))
            && self.use_count(args[0]) == 1
            && result_uses == 1
            && self.double_in_register(args[1]).is_none()
        {
            b = self.pooled_constant(bits);
        }
        Ok(match op {
            BinaryOp::Add => self.builder.ins().iadd(a, b),
            BinaryOp::Sub => self.builder.ins().isub(a, b),
            BinaryOp::Mul => match self.constant(args[1]) {
                // Shifting takes a third of the time.
                Some(by) if by > 0 && by & (by - 1) == 0 => {
                    self.builder.ins().ishl_imm_u(a, i64::from(by.trailing_zeros()))
                }
                _ => self.builder.ins().imul(a, b),
            },
            BinaryOp::Umulh => self.high_product(ty, a, b),
            BinaryOp::And => self.builder.ins().band(a, b),
            BinaryOp::Or => self.builder.ins().bor(a, b),
            BinaryOp::Xor => self.builder.ins().bxor(a, b),
            BinaryOp::Smin => self.builder.ins().smin(a, b),
            BinaryOp::Smax => self.builder.ins().smax(a, b),
            BinaryOp::Umin => self.builder.ins().umin(a, b),
            BinaryOp::Umax => self.builder.ins().umax(a, b),
            BinaryOp::Fadd => self.builder.ins().fadd(a, b),
            BinaryOp::Fsub => self.builder.ins().fsub(a, b),
            BinaryOp::Fmul => self.builder.ins().fmul(a, b),
            BinaryOp::Fdiv => self.builder.ins().fdiv(a, b),
            BinaryOp::Shl => self.shift_in_zeros(true, ty, [a, b], args[1]),
            BinaryOp::Lshr => self.shift_in_zeros(false, ty, [a, b], args[1]),
            BinaryOp::Ashr => self.shift_in_signs(ty, [a, b], args[1]),
            BinaryOp::Sdiv => self.signed_quotient(ty, [a, b], args[1]),
            BinaryOp::Srem => self.signed_remainder(ty, [a, b], args[1]),
            BinaryOp::Smod => self.modulo(ty, [a, b], args[1]),
            BinaryOp::Udiv => self.unsigned_quotient(ty, [a, b], args[1]),
            BinaryOp::Urem => self.unsigned_remainder(ty, [a, b], args[1]),
        })
    }

    /// The upper half of an unsigned product.
    fn high_product(&mut self, ty: Type, a: ClifValue, b: ClifValue) -> ClifValue {
        if ty == Type::I64 {
            return self.builder.ins().umulhi(a, b);
        }
        let [a, b] = [a, b].map(|value| self.builder.ins().uextend(types::I64, value));
        let product = self.builder.ins().imul(a, b);
        let upper = self.builder.ins().ushr_imm_u(product, i64::from(ty.bits()));
        self.builder.ins().ireduce(clif_type(ty), upper)
    }

    /// A double that is loaded from the constants after the function's code. Cranelift would build
    /// it with two instructions of 15 bytes together. That is worth avoiding where the other
    /// operand comes from the image, if the operation then reads that one from memory by itself. It does
    /// not if one of the two values is used more than once; then Cranelift lets the operation read the
    /// constant from memory.
    pub(super) fn pooled_constant(&mut self, bits: u64) -> ClifValue {
        let mut both = [0; 16];
        both[..8].copy_from_slice(&bits.to_le_bytes());
        let constant = self.builder.func.dfg.constants.insert(both.as_slice().into());
        let both = self.builder.ins().vconst(types::F64X2, constant);
        self.builder.ins().extractlane(both, 0)
    }

    /// The integer that a value is, if it is a constant.
    pub(super) fn constant(&self, value: Value) -> Option<i64> {
        match self.func.def_inst(value) {
            Some(InstData::Iconst { ty: _, value }) => Some(*value),
            _ => None,
        }
    }

    /// A shift that brings zeros in, to the left (`Shl`) or else to the right (`Lshr`). By the width or more, bits are all
    /// shifted out, where machines take the distance modulo the width.
    fn shift_in_zeros(
        &mut self,
        is_left: bool,
        ty: Type,
        [a, b]: [ClifValue; 2],
        by: Value,
    ) -> ClifValue {
        let ins = self.builder.ins();
        let shifted = if is_left { ins.ishl(a, b) } else { ins.ushr(a, b) };
        let width = i64::from(ty.bits());
        if self.constant(by).is_some_and(|n| (0..width).contains(&n)) {
            return shifted;
        }
        let limit = self.iconst(ty, width);
        let fits = self.builder.ins().icmp(IntCC::UnsignedLessThan, b, limit);
        let zero = self.iconst(ty, 0);
        self.builder.ins().select(fits, shifted, zero)
    }

    /// A shift to the right that brings copies of the sign in (`Ashr`). By the width or more, nothing else is left.
    fn shift_in_signs(&mut self, ty: Type, [a, mut b]: [ClifValue; 2], by: Value) -> ClifValue {
        let width = i64::from(ty.bits());
        if !self.constant(by).is_some_and(|n| (0..width).contains(&n)) {
            let most = self.iconst(ty, width - 1);
            b = self.builder.ins().umin(b, most);
        }
        self.builder.ins().sshr(a, b)
    }

    /// A signed quotient (`Sdiv`). The machine would trap at a divisor of 0, and at -1 for the lowest dividend. So for
    /// 0 and -1 it divides by 1, and the right result is chosen afterwards.
    fn signed_quotient(&mut self, ty: Type, [a, b]: [ClifValue; 2], by: Value) -> ClifValue {
        let Some([is_zero, is_minus_one]) = self.unsafe_divisors(ty, b, by) else {
            return self.builder.ins().sdiv(a, b);
        };
        let safe = self.safe_divisor(ty, b, [is_zero, is_minus_one]);
        let plain = self.builder.ins().sdiv(a, safe);
        let negated = self.builder.ins().ineg(a);
        let by_minus_one = self.builder.ins().select(is_minus_one, negated, plain);
        let zero = self.iconst(ty, 0);
        self.builder.ins().select(is_zero, zero, by_minus_one)
    }

    /// A signed remainder (`Srem`), of a division by 1 in the same cases: that is 0, as it is to be by 0 and -1.
    fn signed_remainder(&mut self, ty: Type, [a, b]: [ClifValue; 2], by: Value) -> ClifValue {
        let divisor = match self.unsafe_divisors(ty, b, by) {
            Some(cases) => self.safe_divisor(ty, b, cases),
            None => b,
        };
        self.builder.ins().srem(a, divisor)
    }

    /// Whether a divisor is 0, and whether it is -1; `None` if it is a constant that is neither.
    fn unsafe_divisors(&mut self, ty: Type, b: ClifValue, by: Value) -> Option<[ClifValue; 2]> {
        if self.constant(by).is_some_and(|n| n != 0 && n != -1) {
            return None;
        }
        Some([0, -1].map(|number| {
            let number = self.iconst(ty, number);
            self.builder.ins().icmp(IntCC::Equal, b, number)
        }))
    }

    /// A divisor, or 1 if one of two things is true.
    fn safe_divisor(&mut self, ty: Type, b: ClifValue, [x, y]: [ClifValue; 2]) -> ClifValue {
        let one = self.iconst(ty, 1);
        let is_unsafe = self.builder.ins().bor(x, y);
        self.builder.ins().select(is_unsafe, one, b)
    }

    /// A remainder with the divisor's sign. The machine's has the dividend's; where the two differ
    /// the divisor is added.
    fn modulo(&mut self, ty: Type, [a, b]: [ClifValue; 2], by: Value) -> ClifValue {
        let rest = self.signed_remainder(ty, [a, b], by);
        let zero = self.iconst(ty, 0);
        let less = IntCC::SignedLessThan;
        let other_sign = if self.constant(by).is_some_and(|n| n > 0) {
            self.builder.ins().icmp(less, rest, zero)
        } else {
            let signs = self.builder.ins().bxor(rest, b);
            let differ = self.builder.ins().icmp(less, signs, zero);
            let is_nonzero = self.builder.ins().icmp(IntCC::NotEqual, rest, zero);
            self.builder.ins().band(differ, is_nonzero)
        };
        let moved = self.builder.ins().iadd(rest, b);
        self.builder.ins().select(other_sign, moved, rest)
    }

    /// An unsigned quotient (`Udiv`). The machine would trap at a divisor of 0, so it divides by 1 then, and the
    /// quotient 0 is chosen afterwards.
    fn unsigned_quotient(&mut self, ty: Type, [a, b]: [ClifValue; 2], by: Value) -> ClifValue {
        let Some((is_zero, safe)) = self.nonzero_divisor(ty, b, by) else {
            return self.builder.ins().udiv(a, b);
        };
        let plain = self.builder.ins().udiv(a, safe);
        let zero = self.iconst(ty, 0);
        self.builder.ins().select(is_zero, zero, plain)
    }

    /// An unsigned remainder (`Urem`); by 1 instead of 0 it is 0.
    fn unsigned_remainder(&mut self, ty: Type, [a, b]: [ClifValue; 2], by: Value) -> ClifValue {
        let divisor = self.nonzero_divisor(ty, b, by).map_or(b, |(_, safe)| safe);
        self.builder.ins().urem(a, divisor)
    }

    /// Whether a divisor is 0, and the divisor or 1 if it is; `None` if it is a constant other than 0.
    fn nonzero_divisor(
        &mut self,
        ty: Type,
        b: ClifValue,
        by: Value,
    ) -> Option<(ClifValue, ClifValue)> {
        if self.constant(by).is_some_and(|n| n != 0) {
            return None;
        }
        let (zero, one) = (self.iconst(ty, 0), self.iconst(ty, 1));
        let is_zero = self.builder.ins().icmp(IntCC::Equal, b, zero);
        Some((is_zero, self.builder.ins().select(is_zero, one, b)))
    }

    pub(super) fn icmp(&mut self, cond: IntCond, args: [Value; 2]) -> LowerResult<ClifValue> {
        let [a, b] = match self.compared_index(cond, args) {
            Some(operands) => operands,
            None => match self.compared_field(cond, args)? {
                Some(operands) => operands,
                None => [self.value(args[0])?, self.value(args[1])?],
            },
        };
        let cond = match cond {
            IntCond::Eq => IntCC::Equal,
            IntCond::Ne => IntCC::NotEqual,
            IntCond::Slt => IntCC::SignedLessThan,
            IntCond::Sle => IntCC::SignedLessThanOrEqual,
            IntCond::Sgt => IntCC::SignedGreaterThan,
            IntCond::Sge => IntCC::SignedGreaterThanOrEqual,
            IntCond::Ult => IntCC::UnsignedLessThan,
            IntCond::Ule => IntCC::UnsignedLessThanOrEqual,
            IntCond::Ugt => IntCC::UnsignedGreaterThan,
            IntCond::Uge => IntCC::UnsignedGreaterThanOrEqual,
        };
        Ok(self.builder.ins().icmp(cond, a, b))
    }

    pub(super) fn fcmp(&mut self, cond: FloatCond, args: [Value; 2]) -> LowerResult<ClifValue> {
        let (a, b) = (self.value(args[0])?, self.value(args[1])?);
        let cond = match cond {
            FloatCond::Eq => FloatCC::Equal,
            FloatCond::Ne => FloatCC::NotEqual,
            FloatCond::Lt => FloatCC::LessThan,
            FloatCond::Le => FloatCC::LessThanOrEqual,
            FloatCond::Gt => FloatCC::GreaterThan,
            FloatCond::Ge => FloatCC::GreaterThanOrEqual,
            FloatCond::EqOrNan => FloatCC::UnorderedOrEqual,
        };
        Ok(self.builder.ins().fcmp(cond, a, b))
    }

    pub(super) fn convert(
        &mut self,
        inst: Inst,
        op: ConvertOp,
        to: Type,
        arg: Value,
    ) -> LowerResult<ClifValue> {
        let from = self.func.ty(arg);
        let x = self.value(arg)?;
        let wide = clif_type(to);
        Ok(match op {
            // A truth value is held in 8 bits already.
            ConvertOp::Zext if from == Type::I1 && to == Type::I8 => x,
            ConvertOp::Zext => {
                let in_32_bits = self.extended_loads.get(&arg).copied();
                match (self.zero_extended_index(to, arg), in_32_bits) {
                    (Some(index), _) => index,
                    (None, Some(wide)) if to == Type::I32 => wide,
                    (None, Some(loaded)) if to == Type::I64 => {
                        self.builder.ins().uextend(wide, loaded)
                    }
                    _ => self.builder.ins().uextend(wide, x),
                }
            }
            ConvertOp::Sext if from == Type::I1 => {
                let narrow = self.builder.ins().ineg(x);
                match to {
                    Type::I8 => narrow,
                    _ => self.builder.ins().sextend(wide, narrow),
                }
            }
            ConvertOp::Sext => match self.checked_integer_extended(arg) {
                Some(extended) if to == Type::I64 => extended,
                _ => self.builder.ins().sextend(wide, x),
            },
            ConvertOp::Trunc => self.builder.ins().ireduce(wide, x),
            ConvertOp::IntToFloat => self.int_to_float(arg)?,
            ConvertOp::FloatToInt => self.truncate(inst, arg)?,
            ConvertOp::IsInteger => self.is_integer(arg, FloatCC::Equal)?,
            ConvertOp::IsIntegerOrNan => self.is_integer(arg, FloatCC::UnorderedOrEqual)?,
            ConvertOp::Bitcast => self.builder.ins().bitcast(wide, MemFlagsData::new(), x),
        })
    }
}
