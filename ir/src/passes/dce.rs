//! Drops instructions whose results are not used (dead code elimination).
//!
//! ```text
//! v1: i16 = load vars:0
//! v2: i16 = add v1, v1           (both are dropped if nothing uses v2)
//! ```
//!
//! One visit backwards suffices, since all uses of a value are visited before its definition. It
//! must not drop what [has an effect](crate::InstData::has_effect): stores, volatile loads, and
//! calls of host functions that are not pure.

use super::graph::Graph;
use crate::FuncData;

/// Runs the pass.
pub(super) fn run(func: &mut FuncData) {
    let graph = Graph::new(func);
    let mut used = vec![false; func.value_count()];
    // Backwards, so that all uses are visited before the definition.
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
