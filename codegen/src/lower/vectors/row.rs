//! The rows of a function, and how their values are computed.

use cranelift_codegen::ir::Value as ClifValue;
use plcc_ir::tables::FastMap;
use plcc_ir::{Address, BinaryOp, Inst, IntCond, SecondaryMap, Type, UnaryOp, Value};

/// What of a function is computed in vectors.
#[derive(Default)]
pub(in super::super) struct Vectors {
    /// For each instruction whether it is left out. Empty if there are no rows.
    pub(super) left_out: SecondaryMap<Inst, bool>,
    /// The rows of stores, by the instruction in whose place they are written: the last of their stores.
    pub(super) rows: FastMap<Inst, StoredRow>,
    /// The rows of selects, by the last of these instructions.
    pub(super) chains: FastMap<Inst, Chain>,
    /// How the values of rows and chains are computed. Operands are indices into this list.
    pub(super) nodes: Vec<Node>,
    /// For each node the vector, once it has been written.
    pub(super) written: Vec<Option<ClifValue>>,
    /// The words that hold the truth values of rows of selects, with the nodes of these values.
    pub(super) words: FastMap<Vec<(usize, usize)>, ClifValue>,
}

impl Vectors {
    /// Whether nothing is to be written for an instruction.
    pub(in super::super) fn leaves_out(&self, inst: Inst) -> bool {
        self.left_out[inst]
    }
}

/// How a vector holds a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Format {
    /// That many truth values, 16 or 8, as bytes that are 0 or 1.
    Truths(usize),
    /// Integers of this type, which fill the vector. Truth values in a vector of this format have the
    /// same width, and all of their bits are equal.
    Integers(Type),
}

impl Format {
    /// The number of lanes.
    pub(super) fn lanes(self) -> usize {
        match self {
            Self::Truths(lanes) => lanes,
            Self::Integers(ty) => 16 / ty.bytes() as usize,
        }
    }

    /// Whether a vector can hold values of a type.
    pub(super) fn holds(self, ty: Type) -> bool {
        ty == Type::I1 || self == Self::Integers(ty)
    }
}

/// A row of stores.
#[derive(Clone, Copy)]
pub(super) struct StoredRow {
    /// Where the first lane is stored; the others follow.
    pub(super) at: Address,
    /// The type of each lane in the image.
    pub(super) ty: Type,
    pub(super) format: Format,
    /// The number of the node that gives the values.
    pub(super) node: usize,
}

/// A row of selects that chooses a number by the last truth value that is 1. It is found as the highest
/// 1 in a word that has a bit for each truth value.
///
/// ```text
/// v1 = select v11, 100, v0
/// v2 = select v12, 101, v1     ==>     100 + the number of the highest 1 in v11, v12, v13; or v0
/// v3 = select v13, 102, v2
/// ```
#[derive(Clone)]
pub(super) struct Chain {
    /// The nodes of the truth values, each with the number of its lanes.
    pub(super) rows: Vec<(usize, usize)>,
    /// The number that the first select chooses.
    pub(super) start: i64,
    /// By how much the number of each select exceeds that of the one before.
    pub(super) step: i64,
    /// What is chosen if all are 0.
    pub(super) otherwise: Value,
    pub(super) ty: Type,
}

/// How a row of values is computed. Operands are numbers of nodes.
pub(super) enum Node {
    /// A constant for each lane.
    Constants(Type, Format, Vec<i64>),
    /// The same value in all lanes.
    Splat(Value, Format),
    /// Neighbours in the image, from an address on.
    Load(Address, Type, Format),
    /// The same variable in all lanes, loaded for each.
    SplatLoad(Address, Type, Format),
    /// Variables anywhere in the image.
    Gather(Vec<Address>, Type, Format),
    /// The inverse of truth values or of the bits of integers; or negated integers.
    Unary(UnaryOp, usize, Format),
    /// An operation, on truth values or integers.
    Binary(BinaryOp, [usize; 2]),
    /// A comparison of integers.
    Compare(IntCond, [usize; 2]),
    /// By a row of truth values the first of two rows where they are 1, else the second.
    Select(usize, [usize; 2], Format),
    /// Truth values as integers that are 0 or 1.
    Extend(usize, Format),
}
