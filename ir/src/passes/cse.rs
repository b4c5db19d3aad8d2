//! Computes the same thing once, where the first computation always comes before: in the same
//! block, or in one that control must have come through.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use super::graph::Graph;
use super::substitution::Substitution;
use crate::{Block, FuncData, InstData, Value};

/// Mixes words quickly; keys are our own, so nobody chooses them to collide.
#[derive(Default)]
struct Mix(u64);

impl Hasher for Mix {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(byte.into());
        }
    }

    fn write_u8(&mut self, n: u8) {
        self.write_u64(n.into());
    }

    fn write_u32(&mut self, n: u32) {
        self.write_u64(n.into());
    }

    fn write_i64(&mut self, n: i64) {
        self.write_u64(n as u64);
    }

    fn write_u64(&mut self, n: u64) {
        let mixed = (self.0.rotate_left(5) ^ n).wrapping_mul(0x517C_C1B7_2722_0A95);
        self.0 = mixed ^ (mixed >> 32);
    }

    fn write_usize(&mut self, n: usize) {
        self.write_u64(n as u64);
    }

    fn write_isize(&mut self, n: isize) {
        self.write_u64(n as u64);
    }
}

type Table = HashMap<InstData, (Value, Block), BuildHasherDefault<Mix>>;

/// Runs the pass.
pub(super) fn run(func: &mut FuncData) {
    let graph = Graph::new(func);
    let forest = Forest::new(&graph);
    let mut values = Substitution::new(func);
    let mut table = Table::default();
    for &block in &forest.order {
        let mut insts = std::mem::take(&mut func.blocks[block.index()].insts);
        insts.retain(|&inst| {
            let mut data = *func.inst(inst);
            values.inst(&mut data);
            func.insts[inst.index()] = data;
            let Some(result) = func.result(inst).filter(|_| is_mergeable(&data)) else {
                return true;
            };
            let slot = table.entry(ordered(data)).or_insert((result, block));
            let (first, home) = *slot;
            if first == result {
                return true;
            }
            if forest.leads_to(home, block) {
                values.replace(result, first);
                return false;
            }
            *slot = (result, block);
            true
        });
        let data = &mut func.blocks[block.index()];
        data.insts = insts;
        if let Some(terminator) = &mut data.terminator {
            values.terminator(terminator);
        }
    }
}

/// Whether the result depends on the operands alone.
fn is_mergeable(data: &InstData) -> bool {
    !matches!(data, InstData::Load { .. }) && !data.has_effect()
}

/// The same key whichever way round the operands stand, where that does not matter.
fn ordered(mut data: InstData) -> InstData {
    if let InstData::Binary { op, args } = &mut data
        && op.is_commutative()
    {
        args.sort_unstable();
    }
    data
}

/// The trees of blocks that control reaches from one place only.
struct Forest {
    /// Each tree from its root, a block before those below it.
    order: Vec<Block>,
    /// First and last number of the subtree of each block.
    spans: Vec<(u32, u32)>,
}

impl Forest {
    fn new(graph: &Graph) -> Self {
        let count = graph.edges.len();
        // Children as lists that are linked through the blocks.
        let mut first: Vec<Option<Block>> = vec![None; count];
        let mut next: Vec<Option<Block>> = vec![None; count];
        for &block in graph.order.iter().rev() {
            if let Some(parent) = graph.before[block.index()] {
                next[block.index()] = first[parent.index()].replace(block);
            }
        }
        let mut forest = Self { order: vec![], spans: vec![(0, 0); count] };
        let mut stack = vec![];
        for &root in &graph.order {
            if graph.before[root.index()].is_some() {
                continue;
            }
            forest.enter(root);
            stack.push((root, first[root.index()]));
            while let Some((block, child)) = stack.last_mut() {
                match *child {
                    Some(down) => {
                        *child = next[down.index()];
                        forest.enter(down);
                        stack.push((down, first[down.index()]));
                    }
                    None => {
                        forest.spans[block.index()].1 = forest.order.len() as u32;
                        stack.pop();
                    }
                }
            }
        }
        forest
    }

    fn enter(&mut self, block: Block) {
        self.spans[block.index()].0 = self.order.len() as u32;
        self.order.push(block);
    }

    /// Whether control comes to `to` through `from` only.
    fn leads_to(&self, from: Block, to: Block) -> bool {
        let (first, end) = self.spans[from.index()];
        (first..end).contains(&self.spans[to.index()].0)
    }
}
