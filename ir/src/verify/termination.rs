//! Proves that every scan of a program ends, if the program has no loops.
//!
//! The graph of all blocks of all functions, with an edge for each branch and each goto to a label,
//! is searched depth first. An edge to a block that is on the current path closes a loop.

use crate::{Block, Func, Label, Module, Terminator};

/// Whether it is proven that every scan of a module ends, whatever the process image holds: control
/// cannot come to a block twice before the scan returns, is suspended or is stopped. For a module
/// with a jump to a label by number this is not proven, since such a jump can lead anywhere.
pub fn every_scan_ends(module: &Module) -> bool {
    let labels = module.label_targets();
    let target = |label: Label| labels.get(label).copied().flatten();
    let mut first = vec![];
    let mut count = 0;
    for (_, func) in module.funcs() {
        first.push(count);
        count += func.block_count();
    }
    let number = |(func, block): (Func, Block)| {
        first.get(func.index()).map(|&first| first + block.index()).filter(|&at| at < count)
    };
    let next = |(func, block): (Func, Block), which: usize| {
        let data = module.funcs.get(func.index())?.blocks.get(block)?;
        match data.terminator.as_ref()? {
            Terminator::Goto(label) => target(*label).filter(|_| which == 0),
            other => other.successor(which).map(|block| (func, block)),
        }
    };
    // Blocks on the current path, and blocks that are done.
    let (mut on_path, mut done) = (vec![false; count], vec![false; count]);
    let mut stack = vec![];
    for (func, data) in module.funcs() {
        for (block, data) in data.blocks() {
            if matches!(data.terminator, Some(Terminator::GotoIndirect(_))) {
                return false;
            }
            let Some(at) = number((func, block)).filter(|&at| !done[at]) else { continue };
            on_path[at] = true;
            stack.push(((func, block), at, 0));
            while let Some((place, at, which)) = stack.last_mut() {
                match next(*place, *which) {
                    Some(to) => {
                        *which += 1;
                        let Some(to_at) = number(to) else { continue };
                        if on_path[to_at] {
                            return false;
                        }
                        if !done[to_at] {
                            on_path[to_at] = true;
                            stack.push((to, to_at, 0));
                        }
                    }
                    None => {
                        on_path[*at] = false;
                        done[*at] = true;
                        stack.pop();
                    }
                }
            }
        }
    }
    true
}
