//! Vectors: rows of statements that do the same with neighbouring variables (the technique `vectors`).
//!
//! ```text
//! store words:0, add(load words:100, 1)
//! store words:2, add(load words:102, 1)     ==>     one load, one addition and one store
//! …                                                 of eight words
//! store words:14, add(load words:114, 1)
//! ```
//!
//! Each such statement is a *lane* of a *row*. Processors compute 16 bytes at once, so a row has 16
//! truth values or integers of 8 bits, 8 integers of 16 bits, or 4 of 32 bits; it may also have 8 truth
//! values. The IR stays as it is. Before a function is lowered, [`plan`] looks for stores to neighbouring
//! bytes, whose values are computed by the same operations in all lanes (`nodes`). `emit` writes a row's
//! instructions where its last store stands; the instructions that nothing else uses are left out.
//!
//! Operands of the lanes that are neighbours in the image, too, are loaded at once. Others are *gathered*:
//! each is loaded into its place in the vector, which takes one instruction.

mod chains;
mod cost;
mod emit;
mod nodes;
mod plan;

use cranelift_codegen::ir::Value as ClifValue;
use plcc_ir::tables::FastMap;
use plcc_ir::{Address, BinaryOp, FuncData, Inst, IntCond, Module, Type, UnaryOp, Value};

use crate::CodegenOptions;

/// What of a function is computed in vectors.
#[derive(Default)]
pub(super) struct Vectors {
    /// For each instruction whether it is left out. Empty if there are no rows.
    left_out: Vec<bool>,
    /// The rows of stores, by the instruction in whose place they are written: the last of their stores.
    rows: FastMap<Inst, StoredRow>,
    /// The rows of selects, by the last of these instructions.
    chains: FastMap<Inst, Chain>,
    /// How the values of rows and chains are computed. Operands are indices into this list.
    nodes: Vec<Node>,
    /// For each node the vector, once it has been written.
    written: Vec<Option<ClifValue>>,
    /// The words that hold the truth values of rows of selects, with the nodes of these values.
    words: FastMap<Vec<(usize, usize)>, ClifValue>,
}

impl Vectors {
    /// For a function of a module.
    pub(super) fn new(module: &Module, func: &FuncData, options: CodegenOptions) -> Self {
        match options.vectors {
            true => plan::plan(module, func),
            false => Self::default(),
        }
    }

    /// Whether nothing is to be written for an instruction.
    pub(super) fn leaves_out(&self, inst: Inst) -> bool {
        self.left_out.get(inst.index()).copied().unwrap_or(false)
    }
}

/// How a vector holds a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Format {
    /// So many truth values, 16 or 8, as bytes that are 0 or 1.
    Truths(usize),
    /// Integers of this type, which fill the vector. Truth values in a vector of this format have the
    /// same width, and all of their bits are equal.
    Integers(Type),
}

impl Format {
    /// The number of lanes.
    fn lanes(self) -> usize {
        match self {
            Self::Truths(lanes) => lanes,
            Self::Integers(ty) => 16 / ty.bytes() as usize,
        }
    }

    /// Whether a vector can hold values of a type.
    fn holds(self, ty: Type) -> bool {
        ty == Type::I1 || self == Self::Integers(ty)
    }
}

/// A row of stores.
#[derive(Clone, Copy)]
struct StoredRow {
    /// Where the first lane is stored; the others follow.
    at: Address,
    /// The type of each lane in the image.
    ty: Type,
    format: Format,
    /// The number of the node that gives the values.
    node: usize,
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
struct Chain {
    /// The nodes of the truth values, each with the number of its lanes.
    rows: Vec<(usize, usize)>,
    /// The number that the first select chooses.
    start: i64,
    /// By how much the number of each select exceeds that of the one before.
    step: i64,
    /// What is chosen if all are 0.
    otherwise: Value,
    ty: Type,
}

/// How a row of values is computed. Operands are numbers of nodes.
enum Node {
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
