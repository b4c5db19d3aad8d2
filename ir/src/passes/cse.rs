//! Computes the same thing once (common subexpression elimination).
//!
//! ```text
//! v2: i16 = add v0, v1           v2: i16 = add v0, v1
//! v3: i16 = add v1, v0     ==>
//! store vars:0, v3               store vars:0, v2
//! ```
//!
//! Instructions are looked up in a hash table by operation and operands (hash consing). An earlier
//! one replaces a later one if it is in the same block, or in a block that control must have
//! passed through before. The latter is known along sole predecessors ([`Graph`]). They form trees,
//! which are numbered so that the blocks of each subtree have consecutive numbers.
//!
//! It must not merge loads, since the image may have changed between them (`forward` does that),
//! nor anything that has an effect.

use super::graph::Graph;
use super::substitution::Substitution;
use crate::tables::FastMap;
use crate::{Block, FuncData, InstData, PrimaryMap, Value};

/// Instructions by operation and operands, each with its result and its block.
type Table = FastMap<InstData, (Value, Block)>;

/// Runs the pass.
pub(super) fn run(func: &mut FuncData) {
    let graph = Graph::new(func);
    let forest = Forest::new(&graph);
    let mut values = Substitution::new(func);
    let mut table = Table::with_capacity_and_hasher(func.inst_count(), Default::default());
    for &block in &forest.order {
        let mut insts = std::mem::take(&mut func.blocks[block].insts);
        insts.retain(|&inst| {
            let mut data = *func.inst(inst);
            values.inst(&mut data);
            func.insts[inst] = data;
            let Some(result) = func.result(inst).filter(|_| is_mergeable(&data)) else {
                return true;
            };
            let slot = table.entry(table_key(data)).or_insert((result, block));
            let (first, owner) = *slot;
            if first == result {
                return true;
            }
            if forest.is_above(owner, block) {
                values.replace(result, first);
                return false;
            }
            *slot = (result, block);
            true
        });
        let data = &mut func.blocks[block];
        data.insts = insts;
        if let Some(terminator) = &mut data.terminator {
            values.terminator(terminator);
        }
    }
}

/// Whether the result of an instruction depends on its operands only.
fn is_mergeable(data: &InstData) -> bool {
    !data.reads_memory() && !data.has_effect()
}

/// The key of an instruction in the table: the operands of a commutative operation are brought into
/// a fixed order.
fn table_key(mut data: InstData) -> InstData {
    if let InstData::Binary { op, args } = &mut data
        && op.is_commutative()
    {
        args.sort_unstable();
    }
    data
}

/// The trees that sole predecessors form.
struct Forest {
    /// The blocks, each before those below it, tree after tree.
    order: Vec<Block>,
    /// For each block its number, which is the first of its subtree, and the number after the last
    /// of its subtree.
    spans: PrimaryMap<Block, (u32, u32)>,
}

impl Forest {
    fn new(graph: &Graph) -> Self {
        let count = graph.edges.len();
        // The children of each block, as linked lists: the first child, and the next sibling.
        let mut first = PrimaryMap::from(vec![None; count]);
        let mut next = PrimaryMap::from(vec![None; count]);
        for &block in graph.order.iter().rev() {
            if let Some(parent) = graph.sole_predecessor[block] {
                next[block] = first[parent].replace(block);
            }
        }
        let mut forest = Self { order: vec![], spans: vec![(0, 0); count].into() };
        let mut stack = vec![];
        for &root in &graph.order {
            if graph.sole_predecessor[root].is_some() {
                continue;
            }
            forest.enter(root);
            stack.push((root, first[root]));
            while let Some((block, child)) = stack.last_mut() {
                match *child {
                    Some(down) => {
                        *child = next[down];
                        forest.enter(down);
                        stack.push((down, first[down]));
                    }
                    None => {
                        forest.spans[*block].1 = forest.order.len() as u32;
                        stack.pop();
                    }
                }
            }
        }
        forest
    }

    /// Gives a block the next number.
    fn enter(&mut self, block: Block) {
        self.spans[block].0 = self.order.len() as u32;
        self.order.push(block);
    }

    /// Whether control must have passed through `from` when it is at `to`.
    fn is_above(&self, from: Block, to: Block) -> bool {
        let (first, end) = self.spans[from];
        (first..end).contains(&self.spans[to].0)
    }
}
