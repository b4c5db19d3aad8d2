//! Rule 9: a value is defined before it is used.

use super::Errors;
use crate::passes::Graph;
use crate::{Block, FuncData, Value, ValueDef};

/// No block: what stands above all entries.
const ROOT: u32 = u32::MAX;

pub(super) fn function(func: &FuncData, errors: &mut Errors) {
    let graph = Graph::new(func);
    let tree = Tree::new(func, &graph);
    // Where instructions stand in their block, as far as it has been walked.
    let mut defined = vec![false; func.values.len()];
    let mut home: Vec<Option<Block>> = vec![None; func.insts.len()];
    for &block in &graph.order {
        for &inst in &func.block(block).insts {
            home[inst.index()] = Some(block);
        }
    }
    for &block in &graph.order {
        errors.block = Some(block);
        let data = func.block(block);
        for &param in &data.params {
            defined[param.index()] = true;
        }
        let reaches = |defined: &[bool], value: Value| {
            let from = match func.def(value) {
                ValueDef::Result(inst) => home.get(inst.index()).copied().flatten(),
                ValueDef::Param(block, _) => (block.index() < func.blocks.len()).then_some(block),
            };
            match from {
                Some(from) if from == block => defined[value.index()],
                Some(from) => tree.dominates(from, block),
                None => false,
            }
        };
        for &inst in &data.insts {
            errors.inst = Some(inst);
            func.inst(inst).for_each_arg(|value| {
                if !reaches(&defined, value) {
                    errors.push(format!("{value} is not defined on every way here"));
                }
            });
            if let Some(result) = func.result(inst) {
                defined[result.index()] = true;
            }
        }
        errors.inst = None;
        if let Some(terminator) = &data.terminator {
            terminator.for_each_arg(|value| {
                if !reaches(&defined, value) {
                    errors.push(format!("{value} is not defined on every way here"));
                }
            });
        }
    }
    errors.block = None;
}

/// Which blocks control must come through (Cooper, Harvey, Kennedy: A Simple, Fast Dominance
/// Algorithm). Blocks are known by their number in the graph's order.
struct Tree {
    number: Vec<u32>,
    /// First and last number in a walk of the tree.
    spans: Vec<(u32, u32)>,
}

impl Tree {
    fn new(func: &FuncData, graph: &Graph) -> Self {
        let count = graph.order.len();
        let mut number = vec![ROOT; func.block_count()];
        for (at, block) in graph.order.iter().enumerate() {
            number[block.index()] = at as u32;
        }
        let mut above: Vec<Option<u32>> = vec![None; count];
        for (_, entry) in func.entries() {
            above[number[entry.index()] as usize] = Some(ROOT);
        }
        let mut changed = true;
        while changed {
            changed = false;
            for (at, &block) in graph.order.iter().enumerate() {
                let Some(terminator) = &func.block(block).terminator else { continue };
                if above[at].is_none() {
                    continue;
                }
                terminator.for_each_block(|next, _| {
                    let slot = number[next.index()] as usize;
                    let meet = match above[slot] {
                        None => at as u32,
                        Some(other) => common(&above, other, at as u32),
                    };
                    if above[slot] != Some(meet) {
                        above[slot] = Some(meet);
                        changed = true;
                    }
                });
            }
        }
        Self { number, spans: spans(&above) }
    }

    fn dominates(&self, above: Block, below: Block) -> bool {
        let span = |block: Block| self.spans.get(*self.number.get(block.index())? as usize);
        match (span(above), span(below)) {
            (Some(&(first, last)), Some(&(at, _))) => first <= at && at <= last,
            _ => false,
        }
    }
}

/// The nearest that stands above both.
fn common(above: &[Option<u32>], mut a: u32, mut b: u32) -> u32 {
    while a != b {
        if a == ROOT || b == ROOT {
            return ROOT;
        }
        // What stands above has the smaller number.
        if a > b {
            a = above[a as usize].unwrap_or(ROOT);
        } else {
            b = above[b as usize].unwrap_or(ROOT);
        }
    }
    a
}

/// Numbers a tree, given by what stands above each, so that a subtree is a span.
fn spans(above: &[Option<u32>]) -> Vec<(u32, u32)> {
    // What stands above comes first, so sizes add up from behind.
    let mut sizes = vec![1u32; above.len()];
    for at in (0..above.len()).rev() {
        if let Some(up) = above[at]
            && up != ROOT
        {
            sizes[up as usize] += sizes[at];
        }
    }
    let mut spans = vec![(0, 0); above.len()];
    let mut next = vec![0u32; above.len()];
    let mut free = 0;
    for at in 0..above.len() {
        let first = match above[at] {
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
