//! Indices of arrays as parts of addresses: which of them were checked before, and how they become
//! 64 bits wide.
//!
//! An access with an index stays in its region whatever the index is: an index that is not below the
//! number of elements is replaced by 0. Where a comparison that dominates the access shows that the
//! index is below, nothing is replaced. PMI's front end emits such a comparison before each access:
//!
//! ```text
//!     v1: i32 = zext v0                      // v0 is an i16
//!     v2: i1 = icmp ult v1, 5
//!     brif v2, block1, block2
//! block1:                                    // has no other predecessor
//!     v3: i16 = load integer:40[v1 * 2, 5]   // v1 is below 5
//! ```
//!
//! The machine computes addresses with 64 bits. An index that was widened from 8 or 16 bits is
//! therefore widened once to 64 bits, where the narrow value is defined, so that one instruction
//! loads and widens it. The comparison takes the same register.

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{InstBuilder, Value as ClifValue, types};
use plcc_ir::{
    BinaryOp, Block, ConvertOp, FuncData, Index, InstData, IntCond, PrimaryMap, SecondaryMap,
    Terminator, Type, Value,
};

use super::{LowerResult, Lowering};

/// Through how many instructions an index is followed back to find out how great it may be.
const MAX_STEPS: u32 = 5;

/// How many blocks are searched upwards for a comparison, so that the time is linear.
const MAX_DISTANCE: usize = 64;

/// The end of the only block that leads to a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Edge {
    /// A jump.
    Jump(Block),
    /// A branch, taken if its condition has this truth.
    Brif(Block, Value, bool),
}

/// What a function's indices need to know of it.
#[derive(Default)]
pub(super) struct Indices {
    /// For each block the end of the block that leads to it, if only one does.
    edges: SecondaryMap<Block, Option<Edge>>,
    /// Which values of 8 or 16 bits become indices by being widened with zeros.
    narrow: SecondaryMap<Value, bool>,
    /// Those values widened to 64 bits, once an instruction has defined them. Parameters of blocks
    /// are not widened.
    wide: SecondaryMap<Value, Option<ClifValue>>,
}

impl Indices {
    pub(super) fn new(func: &FuncData) -> Self {
        let mut this = Self::default();
        let index_of = |data: &InstData| match *data {
            InstData::Load { ty: _, at } | InstData::Store { at, value: _ } => at.index,
            _ => None,
        };
        for (_, block) in func.blocks() {
            for index in block.insts.iter().filter_map(|&inst| index_of(func.inst(inst))) {
                this.narrow.resize(func.value_count());
                if let Some(narrow) = widened(func, index.value) {
                    this.narrow[narrow] = true;
                }
            }
        }
        // A function without indices needs neither table.
        if !this.narrow.is_empty() {
            this.wide.resize(func.value_count());
            this.edges = edges(func);
        }
        this
    }

    /// Whether a value is one that becomes an index by being widened with zeros.
    fn is_narrow(&self, value: Value) -> bool {
        self.narrow[value]
    }

    /// Whether a comparison that dominates a block shows that a value of 32 bits is below the count.
    fn is_compared(&self, func: &FuncData, mut block: Block, value: Value, count: u32) -> bool {
        let narrow = widened(func, value);
        for _ in 0..MAX_DISTANCE {
            block = match self.edges[block] {
                Some(Edge::Jump(from)) => from,
                Some(Edge::Brif(from, cond, truth)) => {
                    if let Some((compared, limit)) = value_below_limit(func, cond, truth)
                        && (compared == value || narrow == Some(compared))
                        && limit <= u64::from(count)
                    {
                        return true;
                    }
                    from
                }
                None => return false,
            };
        }
        false
    }
}

/// The value of 8 or 16 bits that a value of 32 bits is, widened with zeros.
fn widened(func: &FuncData, value: Value) -> Option<Value> {
    match func.def_inst(value) {
        Some(&InstData::Convert { op: ConvertOp::Zext, to: Type::I32, arg }) => {
            matches!(func.ty(arg), Type::I8 | Type::I16).then_some(arg)
        }
        _ => None,
    }
}

/// For each block the end of the block that leads to it, if only one does.
fn edges(func: &FuncData) -> SecondaryMap<Block, Option<Edge>> {
    let mut ways = PrimaryMap::from(vec![0u32; func.block_count()]);
    let mut edges = SecondaryMap::from(vec![None; func.block_count()]);
    let mut add = |to: Block, edge: Option<Edge>| {
        if let (Some(ways), Some(slot)) = (ways.get_mut(to), edges.get_mut(to)) {
            *ways += 1;
            *slot = edge.filter(|_| *ways == 1);
        }
    };
    for &(_, entry) in func.entries() {
        add(entry, None);
    }
    for (from, data) in func.blocks() {
        match &data.terminator {
            Some(Terminator::Jump(call)) => add(call.block, Some(Edge::Jump(from))),
            Some(Terminator::Brif { cond, then, otherwise }) => {
                add(then.block, Some(Edge::Brif(from, *cond, true)));
                add(otherwise.block, Some(Edge::Brif(from, *cond, false)));
            }
            Some(other) => other.for_each_block(|block, _| add(block, None)),
            None => {}
        }
    }
    edges
}

/// What follows from a condition that is `truth`: a value, and a limit that it is below as an unsigned
/// number.
fn value_below_limit(func: &FuncData, cond: Value, truth: bool) -> Option<(Value, u64)> {
    let Some(&InstData::Icmp { cond, args: [value, constant] }) = func.def_inst(cond) else {
        return None;
    };
    let bits = func.ty(value).bits();
    let constant = func.constant(constant)? as u64 & (u64::MAX >> (64 - bits));
    match if truth { cond } else { cond.inverted() } {
        IntCond::Ult => Some((value, constant)),
        IntCond::Ule => Some((value, constant.checked_add(1)?)),
        _ => None,
    }
}

impl Lowering<'_> {
    /// Widens a value that was just defined, if it becomes an index.
    pub(super) fn widen_for_index(&mut self, value: Value, clif: ClifValue) {
        if self.indices.is_narrow(value) {
            let wide = self.builder.ins().uextend(types::I64, clif);
            if let Some(slot) = self.indices.wide.get_mut(value) {
                *slot = Some(wide);
            }
        }
    }

    /// A value of 8 or 16 bits, widened to 64 bits with zeros, if it becomes an index.
    fn wide_index(&self, value: Value) -> Option<ClifValue> {
        self.indices.wide[value]
    }

    /// A value widened with zeros to 32 bits, if it becomes an index: the low half of the register in
    /// which the index lies.
    pub(super) fn zero_extended_index(&mut self, to: Type, arg: Value) -> Option<ClifValue> {
        let wide = self.wide_index(arg).filter(|_| to == Type::I32)?;
        Some(self.builder.ins().ireduce(types::I32, wide))
    }

    /// The operands of an unsigned comparison with a constant below 2^31, where the compared value
    /// becomes an index: the comparison takes the register in which the index lies.
    pub(super) fn compared_index(
        &mut self,
        cond: IntCond,
        [value, constant]: [Value; 2],
    ) -> Option<[ClifValue; 2]> {
        let unsigned = matches!(cond, IntCond::Ult | IntCond::Ule | IntCond::Ugt | IntCond::Uge);
        let wide = self.wide_index(value).filter(|_| unsigned)?;
        let mask = u64::MAX >> (64 - self.func.ty(value).bits());
        let constant = self.func.constant(constant)? as u64 & mask;
        let value = self.builder.ins().ireduce(types::I32, wide);
        Some([value, self.builder.ins().iconst(types::I32, constant as i64)])
    }

    /// The number of bytes that an index adds to an address. An index that is not below its count
    /// adds none.
    pub(super) fn index(&mut self, index: Index) -> LowerResult<ClifValue> {
        let narrow = widened(self.func, index.value).and_then(|narrow| self.wide_index(narrow));
        let is_below = self.is_below(index.value, index.count)
            || self.indices.is_compared(self.func, self.ir_block, index.value, index.count);
        let wide = match narrow.filter(|_| is_below) {
            Some(wide) => wide,
            None => {
                let mut value = self.value(index.value)?;
                if !is_below {
                    let count = self.builder.ins().iconst(types::I32, i64::from(index.count));
                    let fits = self.builder.ins().icmp(IntCC::UnsignedLessThan, value, count);
                    let zero = self.builder.ins().iconst(types::I32, 0);
                    value = self.builder.ins().select(fits, value, zero);
                }
                self.builder.ins().uextend(types::I64, value)
            }
        };
        Ok(match index.scale {
            1 => wide,
            scale if scale.is_power_of_two() => {
                self.builder.ins().ishl_imm_u(wide, i64::from(scale.trailing_zeros()))
            }
            scale => self.builder.ins().imul_imm_u(wide, i64::from(scale)),
        })
    }

    /// Whether the instruction that computes a value shows that it is below the count, so that no
    /// check is needed.
    fn is_below(&self, value: Value, count: u32) -> bool {
        self.greatest(value, MAX_STEPS).is_some_and(|most| most < i64::from(count))
    }

    /// The greatest number that a value may be as an unsigned number; `None` if the instructions that
    /// compute it, followed back through at most `steps` of them, show none below 2^31.
    fn greatest(&self, value: Value, steps: u32) -> Option<i64> {
        let steps = steps.checked_sub(1)?;
        let not_negative = |value: Value| self.constant(value).filter(|&n| n >= 0);
        let most = match *self.func.def_inst(value)? {
            InstData::Iconst { ty: _, value } => Some(value).filter(|&n| n >= 0),
            InstData::Convert { op: ConvertOp::Zext, to: _, arg } => {
                let bits = self.func.ty(arg).bits();
                let all = (bits < 32).then(|| (1 << bits) - 1);
                all.into_iter().chain(self.greatest(arg, steps)).min()
            }
            InstData::Convert { op: ConvertOp::Trunc, to: Type::I32, arg } => {
                self.greatest(arg, steps)
            }
            InstData::Binary { op: BinaryOp::And, args: [a, b] } => {
                not_negative(a).into_iter().chain(not_negative(b)).min()
            }
            InstData::Binary { op: BinaryOp::Add, args: [a, b] } => {
                self.greatest(a, steps)?.checked_add(self.greatest(b, steps)?)
            }
            InstData::Binary { op: BinaryOp::Urem, args: [_, by] } => {
                not_negative(by).filter(|&by| by > 0).map(|by| by - 1)
            }
            InstData::Binary { op: BinaryOp::Umin, args: [_, limit] } => not_negative(limit),
            _ => None,
        };
        most.filter(|&most| most <= i64::from(i32::MAX))
    }
}
