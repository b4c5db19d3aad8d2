//! The operations that instructions name: for each its word in text, the types that it takes, and whether its operands
//! can be exchanged. All are *total*: division by 0, shifts by too much and doubles that fit no integer have results
//! like any other operands.

use crate::Type;
use crate::words::{operations, words};

/// The types of an operation's operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operands {
    /// Integers, but not truth values.
    Integer,
    /// Integers and truth values.
    AnyInteger,
    /// Doubles.
    Double,
}

impl Operands {
    /// Whether a type is one of them.
    pub fn include(self, ty: Type) -> bool {
        match self {
            Self::Integer => ty.is_int() && ty != Type::I1,
            Self::AnyInteger => ty.is_int(),
            Self::Double => ty == Type::F64,
        }
    }
}

operations! {
    /// Operations on one operand, whose result has the same type.
    UnaryOp {
        /// All bits inverted. The opposite of a truth value.
        Not = "not" on AnyInteger,
        /// 0 minus the operand, wrapping around.
        Neg = "neg" on Integer,
        /// The double with its sign bit inverted, also if it is NaN.
        Fneg = "fneg" on Double,
        /// The double with its sign bit cleared, also if it is NaN.
        Fabs = "fabs" on Double,
        /// The IEEE square root; NaN of a number below 0.
        Fsqrt = "fsqrt" on Double,
        /// Rounded towards minus infinity.
        Ffloor = "ffloor" on Double,
        /// Rounded towards plus infinity.
        Fceil = "fceil" on Double,
        /// Rounded towards 0.
        Ftrunc = "ftrunc" on Double,
        /// The finite double that is nearest: the largest number of an infinity's sign, and 0 for
        /// NaN. A finite double stays as it is, also -0.
        Ffinite = "ffinite" on Double,
    }
}

operations! {
    /// Operations on two operands of one type, whose result has the same type. Those whose name
    /// begins with `F` take doubles, all others integers.
    BinaryOp {
        /// Wrapping sum.
        Add = "add" on Integer commutative,
        /// Wrapping difference.
        Sub = "sub" on Integer,
        /// Wrapping product.
        Mul = "mul" on Integer commutative,
        /// The upper half of the unsigned product, which has twice as many bits as the operands.
        Umulh = "umulh" on Integer commutative,
        /// Signed quotient, rounded towards 0. Divided by 0 it is 0; the least integer divided by
        /// -1 is itself.
        Sdiv = "sdiv" on Integer,
        /// Signed remainder of the quotient rounded towards 0, with the dividend's sign. Divided by
        /// 0 or by -1 it is 0.
        Srem = "srem" on Integer,
        /// Signed remainder of the quotient rounded down, with the divisor's sign (SMT-LIB's
        /// `bvsmod`). Divided by 0 it is 0.
        Smod = "smod" on Integer,
        /// Unsigned quotient. Divided by 0 it is 0.
        Udiv = "udiv" on Integer,
        /// Unsigned remainder. Divided by 0 it is 0.
        Urem = "urem" on Integer,
        /// The bits that are 1 in both operands.
        And = "and" on AnyInteger commutative,
        /// The bits that are 1 in at least one operand.
        Or = "or" on AnyInteger commutative,
        /// The bits that differ between the operands.
        Xor = "xor" on AnyInteger commutative,
        /// The first operand shifted left by the second, which is unsigned; 0 if that reaches the
        /// width.
        Shl = "shl" on Integer,
        /// The first operand shifted right by the second, which is unsigned, with zeros coming in;
        /// 0 if that reaches the width.
        Lshr = "lshr" on Integer,
        /// The first operand shifted right by the second, which is unsigned, with copies of the
        /// sign coming in; nothing but copies of the sign if that reaches the width.
        Ashr = "ashr" on Integer,
        /// The lesser of two signed integers.
        Smin = "smin" on Integer commutative,
        /// The greater of two signed integers.
        Smax = "smax" on Integer commutative,
        /// The lesser of two unsigned integers.
        Umin = "umin" on Integer commutative,
        /// The greater of two unsigned integers.
        Umax = "umax" on Integer commutative,
        /// IEEE sum.
        Fadd = "fadd" on Double,
        /// IEEE difference.
        Fsub = "fsub" on Double,
        /// IEEE product.
        Fmul = "fmul" on Double,
        /// IEEE quotient.
        Fdiv = "fdiv" on Double,
    }
}

operations! {
    /// Comparisons of two integers.
    IntCond {
        /// Equal.
        Eq = "eq" on AnyInteger commutative,
        /// Not equal.
        Ne = "ne" on AnyInteger commutative,
        /// Signed less.
        Slt = "slt" on Integer,
        /// Signed less or equal.
        Sle = "sle" on Integer,
        /// Signed greater.
        Sgt = "sgt" on Integer,
        /// Signed greater or equal.
        Sge = "sge" on Integer,
        /// Unsigned less.
        Ult = "ult" on Integer,
        /// Unsigned less or equal.
        Ule = "ule" on Integer,
        /// Unsigned greater.
        Ugt = "ugt" on Integer,
        /// Unsigned greater or equal.
        Uge = "uge" on Integer,
    }
}

impl IntCond {
    /// The comparison that holds where this one does not.
    pub fn inverted(self) -> Self {
        match self {
            Self::Eq => Self::Ne,
            Self::Ne => Self::Eq,
            Self::Slt => Self::Sge,
            Self::Sle => Self::Sgt,
            Self::Sgt => Self::Sle,
            Self::Sge => Self::Slt,
            Self::Ult => Self::Uge,
            Self::Ule => Self::Ugt,
            Self::Ugt => Self::Ule,
            Self::Uge => Self::Ult,
        }
    }

    /// The comparison that gives the same when the operands are exchanged.
    pub fn swapped(self) -> Self {
        match self {
            Self::Eq | Self::Ne => self,
            Self::Slt => Self::Sgt,
            Self::Sle => Self::Sge,
            Self::Sgt => Self::Slt,
            Self::Sge => Self::Sle,
            Self::Ult => Self::Ugt,
            Self::Ule => Self::Uge,
            Self::Ugt => Self::Ult,
            Self::Uge => Self::Ule,
        }
    }
}

words! {
    /// Comparisons of two doubles. If one is NaN, all are false but `ne` and `eq_or_nan`.
    FloatCond {
        /// Equal.
        Eq = "eq",
        /// Not equal, or NaN.
        Ne = "ne",
        /// Less.
        Lt = "lt",
        /// Less or equal.
        Le = "le",
        /// Greater.
        Gt = "gt",
        /// Greater or equal.
        Ge = "ge",
        /// Equal, or one is NaN. Where NaN cannot occur this is the same as `eq`, and machine code
        /// needs one branch for it instead of two.
        EqOrNan = "eq_or_nan",
    }
}

words! {
    /// Conversions from one type to another.
    ConvertOp {
        /// To a wider integer, filled with copies of the sign. A truth value becomes 0 or -1.
        Sext = "sext",
        /// To a wider integer, filled with zeros. A truth value becomes 0 or 1.
        Zext = "zext",
        /// To the low bits of an integer, as a narrower integer. A truth value is made of one by `bit`.
        Trunc = "trunc",
        /// From a signed `i32` or `i64` to the nearest double, ties to even.
        IntToFloat = "itof",
        /// From a double to an `i32`, rounded towards 0. What does not fit, NaN included, becomes
        /// -2^31.
        FloatToInt = "ftoi",
        /// From a double to a truth value: whether it is an integer of 32 bits, so that `ftoi` gives
        /// an equal number (integrality check). -0 counts as 0.
        IsInteger = "is_integer",
        /// The same, but NaN counts as one. Where NaN cannot occur machine code needs one branch for
        /// it instead of two.
        IsIntegerOrNan = "is_integer_or_nan",
        /// Between `i64` and `f64`, keeping the bits.
        Bitcast = "bitcast",
    }
}

impl ConvertOp {
    /// Whether it converts values of one type to another.
    pub fn converts(self, from: Type, to: Type) -> bool {
        let are_integers = from.is_int() && to.is_int();
        match self {
            Self::Sext | Self::Zext => are_integers && to.bits() > from.bits(),
            Self::Trunc => are_integers && to.bits() < from.bits() && to != Type::I1,
            Self::IntToFloat => matches!(from, Type::I32 | Type::I64) && to == Type::F64,
            Self::FloatToInt => from == Type::F64 && to == Type::I32,
            Self::IsInteger | Self::IsIntegerOrNan => from == Type::F64 && to == Type::I1,
            Self::Bitcast => {
                matches!((from, to), (Type::I64, Type::F64) | (Type::F64, Type::I64))
            }
        }
    }
}
