//! Instructions. Each has one result for all operands.

use plcc_abi::HostFn;

use crate::{Region, Type, Value};

macro_rules! words {
    ($(#[$doc:meta])* $name:ident { $($(#[$vdoc:meta])* $variant:ident = $text:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum $name {
            $($(#[$vdoc])* $variant,)*
        }

        impl $name {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// The word in the text format.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)*
                }
            }

            /// Finds one by its word.
            pub fn from_name(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|op| op.name() == name)
            }
        }
    };
}

words! {
    /// One operand, a result of the same type.
    UnaryOp {
        /// All bits inverted; of a truth value, its opposite.
        Not = "not",
        /// 0 minus it, wrapping; no truth values.
        Neg = "neg",
        /// The sign bit inverted, of NaN too.
        Fneg = "fneg",
        /// The sign bit cleared, of NaN too.
        Fabs = "fabs",
        /// The IEEE square root, NaN below 0.
        Fsqrt = "fsqrt",
        /// Rounded towards minus infinity.
        Ffloor = "ffloor",
        /// Rounded towards plus infinity.
        Fceil = "fceil",
        /// Rounded towards 0.
        Ftrunc = "ftrunc",
    }
}

words! {
    /// Two operands of one type, a result of the same. Integers unless the word begins with `f`;
    /// truth values with `and or xor` only.
    BinaryOp {
        /// Wrapping sum.
        Add = "add",
        /// Wrapping difference.
        Sub = "sub",
        /// Wrapping product.
        Mul = "mul",
        /// Signed quotient towards 0; by 0 it is 0; the least by -1 is itself.
        Sdiv = "sdiv",
        /// Signed remainder with the dividend's sign; by 0 and by -1 it is 0.
        Srem = "srem",
        /// Signed remainder of the quotient rounded down, with the divisor's sign (SMT-LIB's
        /// `bvsmod`); by 0 it is 0.
        Smod = "smod",
        /// Unsigned quotient; by 0 it is 0.
        Udiv = "udiv",
        /// Unsigned remainder; by 0 it is 0.
        Urem = "urem",
        /// Bits in both.
        And = "and",
        /// Bits in either.
        Or = "or",
        /// Bits in one alone.
        Xor = "xor",
        /// Shifted left; 0 when the (unsigned) distance reaches the width.
        Shl = "shl",
        /// Shifted right, zeros in; 0 when the distance reaches the width.
        Lshr = "lshr",
        /// Shifted right, signs in; all signs when the distance reaches the width.
        Ashr = "ashr",
        /// The lesser, signed.
        Smin = "smin",
        /// The greater, signed.
        Smax = "smax",
        /// The lesser, unsigned.
        Umin = "umin",
        /// The greater, unsigned.
        Umax = "umax",
        /// IEEE sum.
        Fadd = "fadd",
        /// IEEE difference.
        Fsub = "fsub",
        /// IEEE product.
        Fmul = "fmul",
        /// IEEE quotient.
        Fdiv = "fdiv",
    }
}

impl BinaryOp {
    /// Whether the operands can change places.
    pub fn is_commutative(self) -> bool {
        matches!(
            self,
            Self::Add
                | Self::Mul
                | Self::And
                | Self::Or
                | Self::Xor
                | Self::Smin
                | Self::Smax
                | Self::Umin
                | Self::Umax
        )
    }

    /// Whether it computes with doubles.
    pub fn is_float(self) -> bool {
        matches!(self, Self::Fadd | Self::Fsub | Self::Fmul | Self::Fdiv)
    }
}

words! {
    /// How two integers compare.
    IntCond {
        /// Equal; truth values too.
        Eq = "eq",
        /// Not equal; truth values too.
        Ne = "ne",
        /// Signed less.
        Slt = "slt",
        /// Signed less or equal.
        Sle = "sle",
        /// Signed greater.
        Sgt = "sgt",
        /// Signed greater or equal.
        Sge = "sge",
        /// Unsigned less.
        Ult = "ult",
        /// Unsigned less or equal.
        Ule = "ule",
        /// Unsigned greater.
        Ugt = "ugt",
        /// Unsigned greater or equal.
        Uge = "uge",
    }
}

impl IntCond {
    /// The opposite.
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

    /// What holds of the operands when they change places.
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
    /// How two doubles compare; with a NaN all are false but `ne`.
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
        /// Less or greater: where there is no NaN, unequal, for one branch instead of two.
        Apart = "apart",
    }
}

words! {
    /// From one type to another.
    ConvertOp {
        /// To a wider integer, with the sign; a truth value becomes 0 or -1.
        Sext = "sext",
        /// To a wider integer, with zeros; a truth value becomes 0 or 1.
        Zext = "zext",
        /// To a narrower integer, the low bits; to a truth value, the lowest.
        Trunc = "trunc",
        /// A signed i32 or i64 to the nearest double, ties to even.
        IntToFloat = "itof",
        /// A double to an i32, towards zero; what does not fit, NaN too, to -2^31. What comes back
        /// equal from it by `itof` was an integer.
        Whole = "whole",
        /// Between i64 and f64, the same bits.
        Bitcast = "bitcast",
    }
}

/// Up to four operands of a host call; none by default.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Args {
    len: u8,
    values: [Value; 4],
}

impl Default for Args {
    fn default() -> Self {
        Self { len: 0, values: [Value(0); 4] }
    }
}

impl Args {
    /// The operands; `None` when there are more than four.
    pub fn new(args: &[Value]) -> Option<Self> {
        let mut values = [Value(0); 4];
        values.get_mut(..args.len())?.copy_from_slice(args);
        Some(Self { len: args.len() as u8, values })
    }

    /// The operands.
    pub fn as_slice(&self) -> &[Value] {
        &self.values[..usize::from(self.len)]
    }

    /// The operands, to change.
    pub fn as_mut_slice(&mut self) -> &mut [Value] {
        &mut self.values[..usize::from(self.len)]
    }
}

/// The moving part of an address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Index {
    /// An i32, taken as unsigned.
    pub value: Value,
    /// Bytes between elements.
    pub scale: u32,
    /// How many elements there are, at least one. An index that reaches it is taken as 0, so an
    /// access stays in its region whatever the index; a program that wants a bound watched
    /// compares first.
    pub count: u32,
}

/// Where an access goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Address {
    /// The region.
    pub region: Region,
    /// Bytes from the region's start, of element 0 where there is an index.
    pub offset: u32,
    /// The moving part.
    pub index: Option<Index>,
    /// Whether the access is seen from outside, so that it is neither moved, merged nor dropped.
    pub volatile: bool,
}

impl Address {
    /// A fixed place.
    pub fn fixed(region: Region, offset: u32) -> Self {
        Self { region, offset, index: None, volatile: false }
    }

    /// Element `value` of `count` that are `scale` bytes apart.
    pub fn indexed(region: Region, offset: u32, value: Value, scale: u32, count: u32) -> Self {
        Self { region, offset, index: Some(Index { value, scale, count }), volatile: false }
    }

    /// The same, volatile.
    pub fn volatile(mut self) -> Self {
        self.volatile = true;
        self
    }

    /// The bytes of the region that an access of a type may touch: first and behind the last.
    pub fn extent(&self, ty: Type) -> (u64, u64) {
        let start = u64::from(self.offset);
        let span = match self.index {
            Some(index) => u64::from(index.scale) * u64::from(index.count.saturating_sub(1)),
            None => 0,
        };
        (start, start + span + u64::from(ty.bytes()))
    }
}

/// An instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum InstData {
    /// An integer.
    Iconst {
        /// Its type.
        ty: Type,
        /// Its value in the form of [`Type::wrap`].
        value: i64,
    },
    /// A double.
    Fconst {
        /// Its bits.
        bits: u64,
    },
    /// One operand.
    Unary {
        /// What.
        op: UnaryOp,
        /// Of what.
        arg: Value,
    },
    /// Two operands.
    Binary {
        /// What.
        op: BinaryOp,
        /// Of what.
        args: [Value; 2],
    },
    /// Two integers compared; the result is an i1.
    Icmp {
        /// How.
        cond: IntCond,
        /// What.
        args: [Value; 2],
    },
    /// Two doubles compared; the result is an i1.
    Fcmp {
        /// How.
        cond: FloatCond,
        /// What.
        args: [Value; 2],
    },
    /// The first of two values of one type where an i1 is true, else the second.
    Select {
        /// Which.
        cond: Value,
        /// Of what.
        args: [Value; 2],
    },
    /// Another type.
    Convert {
        /// How.
        op: ConvertOp,
        /// To what.
        to: Type,
        /// From what.
        arg: Value,
    },
    /// What stands in the image.
    Load {
        /// Its type.
        ty: Type,
        /// Where.
        at: Address,
    },
    /// A value put into the image; no result.
    Store {
        /// Where.
        at: Address,
        /// What.
        value: Value,
    },
    /// A call of the host, with its [signature](HostFn::signature).
    HostCall {
        /// What is called.
        function: HostFn,
        /// With what.
        args: Args,
    },
}

impl InstData {
    /// Calls `f` for each operand.
    pub fn for_each_arg(&self, mut f: impl FnMut(Value)) {
        let mut copy = *self;
        copy.for_each_arg_mut(|value| f(*value));
    }

    /// Calls `f` for each operand, to change it.
    pub fn for_each_arg_mut(&mut self, mut f: impl FnMut(&mut Value)) {
        match self {
            Self::Iconst { .. } | Self::Fconst { .. } => {}
            Self::Unary { op: _, arg } | Self::Convert { op: _, to: _, arg } => f(arg),
            Self::Binary { op: _, args }
            | Self::Icmp { cond: _, args }
            | Self::Fcmp { cond: _, args } => args.iter_mut().for_each(f),
            Self::Select { cond, args } => {
                f(cond);
                args.iter_mut().for_each(f);
            }
            Self::Load { ty: _, at } => at.index.iter_mut().for_each(|i| f(&mut i.value)),
            Self::Store { at, value } => {
                at.index.iter_mut().for_each(|i| f(&mut i.value));
                f(value);
            }
            Self::HostCall { function: _, args } => args.as_mut_slice().iter_mut().for_each(f),
        }
    }

    /// Whether it does more than give a result: it must stay even where the result is not used.
    pub fn has_effect(&self) -> bool {
        match self {
            Self::Store { .. } => true,
            Self::Load { ty: _, at } => at.volatile,
            Self::HostCall { function, args: _ } => !function.is_pure(),
            _ => false,
        }
    }
}
