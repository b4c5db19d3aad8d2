//! Drops instructions whose results nobody uses and that do nothing else.

use super::graph::Graph;
use crate::FuncData;

/// Runs the pass.
pub(super) fn run(func: &mut FuncData) {
    let graph = Graph::new(func);
    let mut used = vec![false; func.value_count()];
    // Backwards, so every use is seen before the definition: it is behind it in this order.
    for &block in graph.order.iter().rev() {
        let data = &mut func.blocks[block.index()];
        if let Some(terminator) = &data.terminator {
            terminator.for_each_arg(|value| used[value.index()] = true);
        }
        let mut kept = data.insts.len();
        for at in (0..data.insts.len()).rev() {
            let inst = data.insts[at];
            let instruction = &func.insts[inst.index()];
            let wanted = func.results[inst.index()].is_some_and(|value| used[value.index()]);
            if wanted || instruction.has_effect() {
                instruction.for_each_arg(|value| used[value.index()] = true);
                kept -= 1;
                data.insts[kept] = inst;
            }
        }
        data.insts.drain(..kept);
    }
}
