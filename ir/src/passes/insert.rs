//! Writing new instructions, for every pass.
//!
//! A pass implements [`Insert`] by saying where a new instruction goes, and what it keeps in mind of the result.
//! Writing can't fail: every method returns a value. So where a rule of a pass returns `None`, that means that the rule
//! does not apply, and never that code has been written by halves.

use crate::{
    Address, BinaryOp, ConvertOp, FuncData, Inst, InstData, IntCond, StatementId, Type, UnaryOp,
    Value,
};

/// A place in a function at which new instructions are inserted, one after the other.
pub(super) trait Insert {
    /// The function.
    fn func(&self) -> &FuncData;

    /// Inserts an instruction and returns its result. A store has none; for it this is [`Value::NONE`], which the
    /// verifier refuses wherever it is used.
    fn insert(&mut self, data: InstData) -> Value;

    /// Inserts a constant: an integer, which is cut to its type, or the bits of a double.
    fn insert_const(&mut self, ty: Type, value: i64) -> Value {
        self.insert(constant(ty, value))
    }

    /// Inserts an operation on one operand.
    fn insert_unary(&mut self, op: UnaryOp, arg: Value) -> Value {
        self.insert(InstData::Unary { op, arg })
    }

    /// Inserts a NOT.
    fn insert_not(&mut self, arg: Value) -> Value {
        self.insert_unary(UnaryOp::Not, arg)
    }

    /// Inserts an operation on two operands.
    fn insert_binary(&mut self, op: BinaryOp, a: Value, b: Value) -> Value {
        self.insert(InstData::Binary { op, args: [a, b] })
    }

    /// Inserts an operation on an operand and a constant of its type, which is inserted before.
    fn insert_with(&mut self, op: BinaryOp, value: Value, constant: i64) -> Value {
        let constant = self.insert_const(self.func().ty(value), constant);
        self.insert_binary(op, value, constant)
    }

    /// Inserts a comparison of two integers.
    fn insert_icmp(&mut self, cond: IntCond, a: Value, b: Value) -> Value {
        self.insert(InstData::Icmp { cond, args: [a, b] })
    }

    /// Inserts a choice: `a` if `cond` is true, else `b`.
    fn insert_select(&mut self, cond: Value, a: Value, b: Value) -> Value {
        self.insert(InstData::Select { cond, args: [a, b] })
    }

    /// Inserts a conversion.
    fn insert_convert(&mut self, op: ConvertOp, to: Type, arg: Value) -> Value {
        self.insert(InstData::Convert { op, to, arg })
    }

    /// Inserts the integrality check of a double. Returns the integer, an `i32`, and whether the double is equal to it;
    /// with `never_nan`, which says that the double is not NaN, by the shorter operation.
    fn insert_integrality_check(&mut self, double: Value, never_nan: bool) -> (Value, Value) {
        let op = if never_nan { ConvertOp::IsIntegerOrNan } else { ConvertOp::IsInteger };
        let integer = self.insert_convert(ConvertOp::FloatToInt, Type::I32, double);
        (integer, self.insert_convert(op, Type::I1, double))
    }

    /// The same for a value that is a double or an `i64` with the bits of one. Of bits those of -0 are not those of
    /// an integer.
    fn insert_integrality_check_of_bits(&mut self, value: Value) -> (Value, Value) {
        if self.func().ty(value) == Type::F64 {
            return self.insert_integrality_check(value, false);
        }
        let double = self.insert_convert(ConvertOp::Bitcast, Type::F64, value);
        let integer = self.insert_convert(ConvertOp::FloatToInt, Type::I32, double);
        let back = self.insert_convert(ConvertOp::IntToFloat, Type::F64, integer);
        let back = self.insert_convert(ConvertOp::Bitcast, Type::I64, back);
        (integer, self.insert_icmp(IntCond::Eq, back, value))
    }

    /// Inserts the reading of a bit of an integer.
    fn insert_bit(&mut self, arg: Value, number: u8) -> Value {
        self.insert(InstData::Bit { arg, number })
    }

    /// Inserts a load.
    fn insert_load(&mut self, ty: Type, at: Address) -> Value {
        self.insert(InstData::Load { ty, at })
    }

    /// Inserts a store.
    fn insert_store(&mut self, at: Address, value: Value) {
        self.insert(InstData::Store { at, value });
    }
}

/// A constant: an integer, which is cut to its type, or the bits of a double.
pub(super) fn constant(ty: Type, value: i64) -> InstData {
    match ty {
        Type::F64 => InstData::Fconst { bits: value as u64 },
        ty => InstData::Iconst { ty, value: ty.wrap(value) },
    }
}

/// The end of a list of instructions, where they are inserted for a statement.
pub(super) struct Cursor<'a> {
    pub(super) func: &'a mut FuncData,
    pub(super) out: &'a mut Vec<Inst>,
    pub(super) loc: StatementId,
}

impl Insert for Cursor<'_> {
    fn func(&self) -> &FuncData {
        self.func
    }

    fn insert(&mut self, data: InstData) -> Value {
        let (inst, result) = self.func.append(data, self.loc);
        self.out.push(inst);
        result
    }
}
