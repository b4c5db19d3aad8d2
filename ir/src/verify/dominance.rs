//! Rule 9: the definition of a value dominates its uses.
//!
//! Block A *dominates* block B if every way from an entry to B passes A. The dominators of each
//! block form a tree (its parent is the nearest one), which is computed by the algorithm of
//! Cooper, Harvey and Kennedy (A Simple, Fast Dominance Algorithm): blocks are visited in reverse
//! postorder, and the parent of each becomes the nearest common dominator of its predecessors,
//! until nothing changes. A function has several entries; a root that is not a block is above
//! them all.
//!
//! The tree is then numbered so that the blocks of each subtree have consecutive numbers. A block
//! dominates another if the other's number is among those of its subtree.

use super::error::Errors;
use crate::passes::Graph;
use crate::{Block, FuncData, PrimaryMap, Value, ValueDef};

/// The root of the tree. It is not a block, but the parent of all entries.
const ROOT: u32 = u32::MAX;

/// In place of the number of a block that control cannot reach.
const UNREACHABLE: u32 = u32::MAX;

pub(super) fn check_function(func: &FuncData, errors: &mut Errors) {
    let graph = Graph::new(func);
    let tree = Tree::new(func, &graph);
    // Whether each value's definition has been visited.
    let mut defined = PrimaryMap::from(vec![false; func.values.len()]);
    let mut block_of = PrimaryMap::from(vec![None; func.insts.len()]);
    for &block in &graph.order {
        for &inst in &func.block(block).insts {
            block_of[inst] = Some(block);
        }
    }
    for &block in &graph.order {
        errors.block = Some(block);
        let data = func.block(block);
        for &param in &data.params {
            defined[param] = true;
        }
        let is_defined_at_use = |defined: &PrimaryMap<Value, bool>, value: Value| {
            let from = match func.def(value) {
                ValueDef::Result(inst) => block_of.get(inst).copied().flatten(),
                ValueDef::Param(block, _) => func.blocks.is_valid(block).then_some(block),
            };
            match from {
                Some(from) if from == block => defined[value],
                Some(from) => tree.dominates(from, block),
                None => false,
            }
        };
        for &inst in &data.insts {
            errors.inst = Some(inst);
            func.inst(inst).for_each_arg(|value| {
                if !is_defined_at_use(&defined, value) {
                    errors.push(format!("{value} is not defined on every path to this use"));
                }
            });
            if let Some(result) = func.result(inst) {
                defined[result] = true;
            }
        }
        errors.inst = None;
        if let Some(terminator) = &data.terminator {
            terminator.for_each_arg(|value| {
                if !is_defined_at_use(&defined, value) {
                    errors.push(format!("{value} is not defined on every path to this use"));
                }
            });
        }
    }
    errors.block = None;
}

/// The dominator tree. Blocks are known by their number in the graph's order.
struct Tree {
    /// For each block its number, or [`UNREACHABLE`].
    number: PrimaryMap<Block, u32>,
    /// For each block the first and last number of its subtree, in a walk of the tree.
    spans: Vec<(u32, u32)>,
}

impl Tree {
    fn new(func: &FuncData, graph: &Graph) -> Self {
        let count = graph.order.len();
        let mut number = PrimaryMap::from(vec![UNREACHABLE; func.block_count()]);
        for (at, &block) in graph.order.iter().enumerate() {
            number[block] = at as u32;
        }
        let mut parents: Vec<Option<u32>> = vec![None; count];
        for &(_, entry) in func.entries() {
            parents[number[entry] as usize] = Some(ROOT);
        }
        let mut changed = true;
        while changed {
            changed = false;
            for (at, &block) in graph.order.iter().enumerate() {
                let Some(terminator) = &func.block(block).terminator else { continue };
                if parents[at].is_none() {
                    continue;
                }
                terminator.for_each_block(|next, _| {
                    let slot = number[next] as usize;
                    let meet = match parents[slot] {
                        None => at as u32,
                        Some(other) => nearest_common_dominator(&parents, other, at as u32),
                    };
                    if parents[slot] != Some(meet) {
                        parents[slot] = Some(meet);
                        changed = true;
                    }
                });
            }
        }
        Self { number, spans: spans(&parents) }
    }

    /// Whether one block dominates another; every block dominates itself.
    fn dominates(&self, dominator: Block, block: Block) -> bool {
        let span = |of: Block| self.spans.get(*self.number.get(of)? as usize);
        match (span(dominator), span(block)) {
            (Some(&(first, last)), Some(&(at, _))) => first <= at && at <= last,
            _ => false,
        }
    }
}

/// The nearest common dominator of two blocks, by the parents found so far.
fn nearest_common_dominator(parents: &[Option<u32>], mut a: u32, mut b: u32) -> u32 {
    while a != b {
        if a == ROOT || b == ROOT {
            return ROOT;
        }
        // A dominator has a smaller number than what it dominates.
        if a > b {
            a = parents[a as usize].unwrap_or(ROOT);
        } else {
            b = parents[b as usize].unwrap_or(ROOT);
        }
    }
    a
}

/// Numbers the nodes of a tree, given by the parent of each node, so that the nodes of each subtree
/// have consecutive numbers. Gives for each node the first and the last number of its subtree.
fn spans(parents: &[Option<u32>]) -> Vec<(u32, u32)> {
    // A parent comes before its children, so the sizes of subtrees are added up from the end.
    let mut sizes = vec![1u32; parents.len()];
    for at in (0..parents.len()).rev() {
        if let Some(up) = parents[at]
            && up != ROOT
        {
            sizes[up as usize] += sizes[at];
        }
    }
    let mut spans = vec![(0, 0); parents.len()];
    let mut next = vec![0u32; parents.len()];
    let mut free = 0;
    for at in 0..parents.len() {
        let first = match parents[at] {
            Some(up) if up != ROOT => {
                let slot = &mut next[up as usize];
                let first = *slot;
                *slot += sizes[at];
                first
            }
            _ => {
                let first = free;
                free += sizes[at];
                first
            }
        };
        spans[at] = (first, first + sizes[at] - 1);
        next[at] = first + 1;
    }
    spans
}
