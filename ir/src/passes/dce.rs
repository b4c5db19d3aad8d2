//! Drops instructions whose results are not used, and parameters of blocks that are not used (dead
//! code elimination).
//!
//! ```text
//! v1: i16 = load vars:0
//! v2: i16 = add v1, v1           (both are dropped if nothing uses v2)
//! jump block1(v2)                (becomes `jump block1` if nothing uses the parameter)
//! ```
//!
//! One visit backwards suffices, since all uses of a value are visited before its definition. There is
//! one exception: what a branch back passes to a parameter is kept in any case, since the uses of the
//! parameter are visited later. The pass must not drop what [has an
//! effect](crate::InstData::has_effect): stores, volatile loads, `is_late`, and calls of host functions
//! that are not pure.

use super::graph::Graph;
use crate::{FuncData, PrimaryMap, Value, ValueDef};

/// Runs the pass.
pub(super) fn run(func: &mut FuncData) {
    let graph = Graph::new(func);
    let mut used = PrimaryMap::from(vec![false; func.value_count()]);
    let mut visited = PrimaryMap::from(vec![false; func.block_count()]);
    let mut has_unused = false;
    // Backwards, so that all uses are visited before the definition.
    for &block in graph.order.iter().rev() {
        if let Some(terminator) = &func.blocks[block].terminator {
            terminator.for_each_operand(|value| used[value] = true);
            terminator.for_each_block(|to, args| {
                let params = &func.blocks[to].params;
                for (param, arg) in params.iter().zip(args) {
                    if used[*param] || !visited[to] {
                        used[*arg] = true;
                    }
                }
            });
        }
        visited[block] = true;
        let data = &mut func.blocks[block];
        let mut kept = data.insts.len();
        for at in (0..data.insts.len()).rev() {
            let inst = data.insts[at];
            let instruction = &func.insts[inst];
            let wanted = func.results[inst].is_some_and(|value| used[value]);
            if wanted || instruction.has_effect() {
                instruction.for_each_arg(|value| used[value] = true);
                kept -= 1;
                data.insts[kept] = inst;
            }
        }
        data.insts.drain(..kept);
        has_unused |= data.params.iter().any(|&param| !used[param]);
    }
    if has_unused {
        drop_params(func, &graph, &used);
    }
}

/// Drops the parameters of reachable blocks that are not used, with what is passed for them.
fn drop_params(func: &mut FuncData, graph: &Graph, used: &PrimaryMap<Value, bool>) {
    let is_used = |value: &Value| used[*value];
    for block in func.blocks.keys() {
        let Some(mut terminator) = func.blocks[block].terminator.take() else { continue };
        terminator.for_each_call_mut(|call| {
            if graph.is_reachable(call.block) {
                let mut params = func.blocks[call.block].params.iter();
                call.args.retain(|_| params.next().is_none_or(is_used));
            }
        });
        func.blocks[block].terminator = Some(terminator);
    }
    for &block in &graph.order {
        let mut params = std::mem::take(&mut func.blocks[block].params);
        params.retain(is_used);
        for (at, &param) in params.iter().enumerate() {
            func.values[param].def = ValueDef::Param(block, at as u32);
        }
        func.blocks[block].params = params;
    }
}
