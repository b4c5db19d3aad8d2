//! The order and the edges of a function's blocks.

use crate::{Block, FuncData};

/// The blocks that can be reached, in an order in which definitions come before uses, and how
/// they are reached.
#[derive(Debug, Default)]
pub(crate) struct Graph {
    /// Reverse postorder from the entries.
    pub(crate) order: Vec<Block>,
    /// Edges that lead to each block; being an entry counts as one.
    pub(crate) edges: Vec<u32>,
    /// The block before, where control comes from one place only.
    pub(crate) before: Vec<Option<Block>>,
}

impl Graph {
    /// Looks at a function.
    pub(crate) fn new(func: &FuncData) -> Self {
        let count = func.block_count();
        let mut graph = Self {
            order: Vec::with_capacity(count),
            edges: vec![0; count],
            before: vec![None; count],
        };
        let mut stack: Vec<(Block, usize)> = vec![];
        for &(_, entry) in func.entries().iter().rev() {
            let seen = graph.edges[entry.index()] > 0;
            graph.edges[entry.index()] += 1;
            graph.before[entry.index()] = None;
            if !seen {
                stack.push((entry, 0));
            }
            while let Some((block, number)) = stack.last_mut() {
                let terminator = func.block(*block).terminator.as_ref();
                match terminator.and_then(|terminator| terminator.successor(*number)) {
                    Some(next) => {
                        *number += 1;
                        let from = *block;
                        let edges = &mut graph.edges[next.index()];
                        *edges += 1;
                        if *edges == 1 {
                            graph.before[next.index()] = Some(from);
                            stack.push((next, 0));
                        } else {
                            graph.before[next.index()] = None;
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

    /// Whether anything leads to a block.
    pub(crate) fn is_reachable(&self, block: Block) -> bool {
        self.edges[block.index()] > 0
    }
}
