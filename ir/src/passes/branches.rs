//! Simplifies control flow.
//!
//! - A branch whose condition is a constant becomes a jump. A branch by a NOT becomes one by the
//!   operand of the NOT, with the targets exchanged.
//! - A branch to an empty block that only jumps on goes to the target of that jump (jump
//!   threading).
//! - A block is appended to its sole predecessor if that ends with a jump to it.
//! - Blocks that control cannot reach are emptied.
//!
//! ```text
//! block0: v0: i1 = iconst 1
//!         brif v0, block1, block2          block0: v0: i1 = iconst 1
//! block1: jump block3                ==>           store vars:0, v1
//! block2: store vars:1, v1                         return
//! block3: store vars:0, v1
//!         return
//! ```
//!
//! Labels stay at their blocks, even at empty ones, since other functions and suspended tasks refer
//! to them.

use super::graph::Graph;
use super::substitution::Substitution;
use crate::{
    Block, BlockCall, BlockData, FuncData, InstData, PrimaryMap, Terminator, UnaryOp, Value,
};

/// Runs the pass.
pub(super) fn run(func: &mut FuncData) {
    for block in func.blocks.keys() {
        decide(func, block);
    }
    thread_jumps(func);
    let graph = Graph::new(func);
    for (block, data) in &mut func.blocks {
        if !graph.is_reachable(block) {
            *data = BlockData { terminator: Some(Terminator::Return), ..BlockData::default() };
        }
    }
    join_blocks(func, &graph);
}

/// Makes a jump of a branch that can go one way only.
fn decide(func: &mut FuncData, block: Block) {
    let Some(mut terminator) = func.blocks[block].terminator.take() else { return };
    terminator = match terminator {
        Terminator::Brif { cond, then, otherwise } => decide_brif(func, cond, then, otherwise),
        Terminator::Switch { arg, targets, default } => {
            let known = func
                .constant(arg)
                .map(|number| targets.get(number as u32 as usize).copied().unwrap_or(default));
            if let Some(block) = known {
                Terminator::Jump(BlockCall::plain(block))
            } else if targets.iter().all(|&target| target == default) {
                Terminator::Jump(BlockCall::plain(default))
            } else {
                Terminator::Switch { arg, targets, default }
            }
        }
        other => other,
    };
    func.blocks[block].terminator = Some(terminator);
}

fn decide_brif(
    func: &FuncData,
    mut cond: Value,
    mut then: BlockCall,
    mut otherwise: BlockCall,
) -> Terminator {
    while let Some(&InstData::Unary { op: UnaryOp::Not, arg }) = func.def_inst(cond) {
        cond = arg;
        std::mem::swap(&mut then, &mut otherwise);
    }
    match func.constant(cond) {
        Some(0) => Terminator::Jump(otherwise),
        Some(_) => Terminator::Jump(then),
        None if then == otherwise => Terminator::Jump(then),
        None => Terminator::Brif { cond, then, otherwise },
    }
}

/// Lets every branch to an empty block that only jumps on go straight to where that goes.
fn thread_jumps(func: &mut FuncData) {
    // For each block visited the block at which a jump to it ends up.
    let mut ends = PrimaryMap::from(vec![None; func.block_count()]);
    let mut path = vec![];
    for start in func.blocks.keys() {
        let mut at = start;
        // Empty blocks that jump in a circle lead back to a block of the path; that block is then
        // taken as the end.
        let end = loop {
            if let Some(end) = ends[at] {
                break end;
            }
            match only_jumps_to(func, at) {
                Some(next) => {
                    ends[at] = Some(at);
                    path.push(at);
                    at = next;
                }
                None => break at,
            }
        };
        for block in path.drain(..) {
            ends[block] = Some(end);
        }
    }
    for block in func.blocks.values_mut() {
        if let Some(terminator) = &mut block.terminator {
            terminator.for_each_block_mut(|block| {
                if let Some(end) = ends[*block] {
                    *block = end;
                }
            });
        }
    }
}

/// The block to which an empty block jumps; `None` if the block does anything else.
fn only_jumps_to(func: &FuncData, block: Block) -> Option<Block> {
    match &func.blocks[block] {
        BlockData { params, insts, terminator: Some(Terminator::Jump(call)), .. }
            if params.is_empty() && insts.is_empty() && call.args.is_empty() =>
        {
            Some(call.block)
        }
        _ => None,
    }
}

/// Appends blocks to their sole predecessors.
fn join_blocks(func: &mut FuncData, graph: &Graph) {
    let mut values = Substitution::new(func);
    let mut replaced = false;
    let mut gone = PrimaryMap::from(vec![false; func.block_count()]);
    for &block in &graph.order {
        if gone[block] {
            continue;
        }
        let mut data = std::mem::take(&mut func.blocks[block]);
        while let Some(Terminator::Jump(call)) = &data.terminator {
            let next = call.block;
            // The next block has further predecessors, or the blocks form a circle.
            if graph.sole_predecessor[next].is_none() || next == block || gone[next] {
                break;
            }
            let follower = std::mem::take(&mut func.blocks[next]);
            for (&param, &arg) in follower.params.iter().zip(&call.args) {
                values.replace(param, arg);
                replaced = true;
            }
            gone[next] = true;
            data.insts.extend(follower.insts);
            data.terminator = follower.terminator;
        }
        func.blocks[block] = data;
    }
    for (block, data) in &mut func.blocks {
        if gone[block] {
            data.terminator = Some(Terminator::Return);
        }
    }
    if replaced {
        for data in func.blocks.values_mut() {
            for &inst in &data.insts {
                values.inst(&mut func.insts[inst]);
            }
            if let Some(terminator) = &mut data.terminator {
                values.terminator(terminator);
            }
        }
    }
}
