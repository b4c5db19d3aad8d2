//! Instructions: what there is to compute, load, store and call, and the result of each.
//!
//! An instruction ([`InstData`]) is a small value that can be copied, compared and hashed; it
//! names its operands by [`Value`] and does not hold its own result, which
//! [`FuncData::result`](crate::FuncData::result) knows. The operations are enumerations whose
//! variants document their results. All are *total*: division by 0, shifts by too much, doubles
//! that fit no integer, and indices out of bounds have results like any other operands. So an
//! instruction without side effects may be executed early, twice, or for nothing.
//!
//! | kind | operations | operands and result |
//! | --- | --- | --- |
//! | constants | `iconst`, `fconst` | any type |
//! | arithmetic | [`UnaryOp`], [`BinaryOp`] | all of one type |
//! | comparisons | `icmp` with [`IntCond`], `fcmp` with [`FloatCond`] | two of one type, gives an `i1` |
//! | choice | `select` | an `i1` and two of one type |
//! | conversions | [`ConvertOp`] | from one type to another |
//! | bits of an integer | `bit` | an integer, gives an `i1` |
//! | fields of an integer | [`ExtractOp`], `insert` | an integer and a [`Field`] of it |
//! | process image | `load`, `store` | an [`Address`] |
//! | local bits | `load`, `store`, `unpack`, `pack` | an [`Address`] among them, [`BitGroups`] |
//! | time | `is_late` | gives an `i1` |
//! | host | `hostcall` | the [signature](HostFn::signature) of the [`HostFn`] |

use plcc_abi::{HostFn, IntegerForm};

use crate::{
    Address, BinaryOp, BitGroups, ConvertOp, ExtractOp, Field, FloatCond, IntCond, Type, UnaryOp,
    Value,
};

/// The operands of a host call, at most four; none by default.
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
    /// An operand that the verifier refuses, in the place of operands that can't be.
    pub(crate) const WRONG: Self = Self { len: 1, values: [Value::NONE; 4] };

    /// Makes a list of operands; `None` if there are more than four.
    pub fn new(args: &[Value]) -> Option<Self> {
        let mut values = [Value(0); 4];
        values.get_mut(..args.len())?.copy_from_slice(args);
        Some(Self { len: args.len() as u8, values })
    }

    /// The operands.
    pub fn as_slice(&self) -> &[Value] {
        self.values.get(..usize::from(self.len)).unwrap_or_default()
    }

    /// The operands, to be changed.
    pub fn as_mut_slice(&mut self) -> &mut [Value] {
        self.values.get_mut(..usize::from(self.len)).unwrap_or_default()
    }
}

/// An instruction.
///
/// A match over operations or instructions names them all where it says what they do. One with a default says only
/// that nothing is known of the others, or that a rule does not apply to them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum InstData {
    /// An integer constant.
    Iconst {
        /// Its type.
        ty: Type,
        /// Its value in the form of [`Type::wrap`].
        value: i64,
    },
    /// A constant double.
    Fconst {
        /// Its bits.
        bits: u64,
    },
    /// An operation on one operand.
    Unary {
        /// The operation.
        op: UnaryOp,
        /// The operand.
        arg: Value,
    },
    /// An operation on two operands.
    Binary {
        /// The operation.
        op: BinaryOp,
        /// The operands.
        args: [Value; 2],
    },
    /// A comparison of two integers; the result is an `i1`.
    Icmp {
        /// The comparison.
        cond: IntCond,
        /// The operands.
        args: [Value; 2],
    },
    /// A comparison of two doubles; the result is an `i1`.
    Fcmp {
        /// The comparison.
        cond: FloatCond,
        /// The operands.
        args: [Value; 2],
    },
    /// The first of two values of one type if a condition is true, else the second.
    Select {
        /// The condition, an `i1`.
        cond: Value,
        /// The values.
        args: [Value; 2],
    },
    /// A conversion to another type.
    Convert {
        /// The conversion.
        op: ConvertOp,
        /// The type of the result.
        to: Type,
        /// The operand.
        arg: Value,
    },
    /// A bit of an integer, as an `i1`.
    Bit {
        /// The integer.
        arg: Value,
        /// The number of the bit, from 0 for the lowest. The verifier sees that the integer has it.
        number: u8,
    },
    /// A field of an integer, as an integer of the same type.
    Extract {
        /// Whether the field is a signed or an unsigned number.
        op: ExtractOp,
        /// The integer.
        arg: Value,
        /// The field.
        field: Field,
    },
    /// An integer of which a field is replaced.
    Insert {
        /// The integer, and what takes the place of the field: the low bits of another integer of the same type, or an `i1`
        /// where the field is one bit.
        args: [Value; 2],
        /// The field.
        field: Field,
    },
    /// A value read from the process image.
    Load {
        /// The type of the value.
        ty: Type,
        /// Its address.
        at: Address,
    },
    /// A value written to the process image. There is no result.
    Store {
        /// Its address.
        at: Address,
        /// The value.
        value: Value,
    },
    /// Puts groups of bits of a word into local bits, each of which is 0 or 1 then. There is no result.
    Unpack {
        /// The word, an `i32`.
        word: Value,
        /// The groups.
        to: BitGroups,
    },
    /// An `i32` that has the lowest bit of each local bit of some groups at its place in the word, and 0 elsewhere.
    Pack {
        /// The groups.
        from: BitGroups,
    },
    /// Whether the scan has taken longer than it may, an `i1`: the [epoch](plcc_abi::deadline) has
    /// reached the scan's limit. Code that jumps back asks this, and leaves if it is true.
    IsLate,
    /// A call of a host function. There is a result if its [signature](HostFn::signature) has one.
    HostCall {
        /// The function.
        function: HostFn,
        /// The operands, of the signature's types.
        args: Args,
    },
}

impl InstData {
    /// A constant: an integer, which is cut to its type, or the bits of a double.
    pub(crate) fn constant(ty: Type, value: i64) -> Self {
        match ty {
            Type::F64 => Self::Fconst { bits: value as u64 },
            ty => Self::Iconst { ty, value: ty.wrap(value) },
        }
    }

    /// What the host function that the instruction calls does to integers; `None` if it calls none, or if nothing
    /// simple can be said.
    pub fn integer_form(&self) -> Option<IntegerForm> {
        match self {
            Self::HostCall { function, args: _ } => function.integer_form(),
            _ => None,
        }
    }

    /// Calls `f` for each operand, in their order.
    pub fn for_each_arg(&self, mut f: impl FnMut(Value)) {
        let mut copy = *self;
        copy.for_each_arg_mut(|value| f(*value));
    }

    /// Calls `f` for each operand, in their order; `f` may replace it.
    pub fn for_each_arg_mut(&mut self, mut f: impl FnMut(&mut Value)) {
        match self {
            Self::Iconst { .. } | Self::Fconst { .. } | Self::Pack { .. } | Self::IsLate => {}
            Self::Unary { op: _, arg }
            | Self::Convert { op: _, to: _, arg }
            | Self::Unpack { word: arg, to: _ }
            | Self::Bit { arg, number: _ }
            | Self::Extract { op: _, arg, field: _ } => f(arg),
            Self::Binary { op: _, args }
            | Self::Insert { args, field: _ }
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

    /// How many operations and constants it stands for, by which limits and thresholds measure programs: a bit or a field
    /// takes shifts and masks.
    pub fn length(&self) -> usize {
        match self {
            Self::Bit { arg: _, number: 0 } => 1,
            Self::Bit { .. } => 3,
            Self::Extract { .. } => 4,
            Self::Insert { .. } => 7,
            Self::Iconst { .. }
            | Self::Fconst { .. }
            | Self::Unary { .. }
            | Self::Binary { .. }
            | Self::Icmp { .. }
            | Self::Fcmp { .. }
            | Self::Select { .. }
            | Self::Convert { .. }
            | Self::Load { .. }
            | Self::Store { .. }
            | Self::Unpack { .. }
            | Self::Pack { .. }
            | Self::IsLate
            | Self::HostCall { .. } => 1,
        }
    }

    /// Whether the instruction does more than give a result, so that it must stay even if its
    /// result is not used: stores, unpacking, volatile loads, and calls of host functions that are not pure.
    /// `IsLate` counts as one of these, since it may give another result each time.
    pub fn has_effect(&self) -> bool {
        match self {
            Self::Store { .. } | Self::Unpack { .. } | Self::IsLate => true,
            Self::Load { ty: _, at } => at.volatile,
            Self::HostCall { function, args: _ } => !function.is_pure(),
            Self::Iconst { .. }
            | Self::Fconst { .. }
            | Self::Unary { .. }
            | Self::Binary { .. }
            | Self::Icmp { .. }
            | Self::Fcmp { .. }
            | Self::Select { .. }
            | Self::Convert { .. }
            | Self::Bit { .. }
            | Self::Extract { .. }
            | Self::Insert { .. }
            | Self::Pack { .. } => false,
        }
    }

    /// Whether the result depends on what was stored before: in the process image or in local bits.
    pub fn reads_memory(&self) -> bool {
        matches!(self, Self::Load { .. } | Self::Pack { .. })
    }
}
