//! The control-flow graph of a function: an order of its blocks, and the edges to each.
//!
//! Passes visit blocks in *reverse postorder* from the entries: every block comes before the blocks
//! that it branches to, except along branches back. So a pass that goes forwards visits the
//! definition of a value before its uses, and one that goes backwards visits all uses before the
//! definition. The exception in both are arguments that a branch back passes.
//!
//! Passes that carry what they know from block to block do so along *sole predecessors*: where
//! control reaches a block from one other block only, everything known at the end of that one
//! holds. That is less than dominance gives, but costs nothing.

use crate::{Block, FuncData, PrimaryMap};

/// The order and the edges of the blocks that control can reach.
#[derive(Debug, Default)]
pub(crate) struct Graph {
    /// The reachable blocks in reverse postorder from the entries.
    pub(crate) order: Vec<Block>,
    /// For each block the number of edges that lead to it. Each label at the block counts as one
    /// edge. It is 0 if control cannot reach the block.
    pub(crate) edges: PrimaryMap<Block, u32>,
    /// For each block its sole predecessor: the block that the edge to it comes from, if there is
    /// only one edge.
    pub(crate) sole_predecessor: PrimaryMap<Block, Option<Block>>,
}

impl Graph {
    /// The graph of a function.
    pub(crate) fn new(func: &FuncData) -> Self {
        let count = func.block_count();
        let mut graph = Self {
            order: Vec::with_capacity(count),
            edges: vec![0; count].into(),
            sole_predecessor: vec![None; count].into(),
        };
        let mut stack: Vec<(Block, usize)> = vec![];
        for &(_, entry) in func.entries().iter().rev() {
            let seen = graph.edges[entry] > 0;
            graph.edges[entry] += 1;
            graph.sole_predecessor[entry] = None;
            if !seen {
                stack.push((entry, 0));
            }
            while let Some((block, number)) = stack.last_mut() {
                let terminator = func.block(*block).terminator.as_ref();
                match terminator.and_then(|terminator| terminator.successor(*number)) {
                    Some(next) => {
                        *number += 1;
                        let from = *block;
                        let edges = &mut graph.edges[next];
                        *edges += 1;
                        if *edges == 1 {
                            graph.sole_predecessor[next] = Some(from);
                            stack.push((next, 0));
                        } else {
                            graph.sole_predecessor[next] = None;
                        }
                    }
                    None => {
                        graph.order.push(*block);
                        stack.pop();
                    }
                }
            }
        }
        graph.order.reverse();
        graph
    }

    /// For each block those reachable ones that branch to it, each once.
    pub(crate) fn predecessors(&self, func: &FuncData) -> PrimaryMap<Block, Vec<Block>> {
        let mut all = PrimaryMap::from(vec![vec![]; func.block_count()]);
        for &block in &self.order {
            if let Some(terminator) = &func.block(block).terminator {
                terminator.for_each_block(|next, _| {
                    let before = &mut all[next];
                    if before.last() != Some(&block) {
                        before.push(block);
                    }
                });
            }
        }
        all
    }

    /// Whether control can reach a block.
    pub(crate) fn is_reachable(&self, block: Block) -> bool {
        self.edges[block] > 0
    }
}
