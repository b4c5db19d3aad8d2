//! Numbers blocks, instructions and values again without gaps, and drops blocks that control cannot
//! reach.
//!
//! Passes drop instructions from the lists of their blocks and leave them in the tables of the
//! [function](crate::func). This pass makes new tables that hold only what is left, in the order in
//! which it stands (in text `block0: v3, v7` becomes `block0: v0, v1`), so that code generation and
//! later passes do not visit the rest. It changes nothing else; entries keep their labels.
//!
//! A function that another pass got wrong stays as it is, where numbering it again could hide the mistake from the
//! [verifier](crate::verify), which looks at it before code generation.

use super::graph::Graph;
use crate::func::ValueData;
use crate::{Block, FuncData, PrimaryMap, Value, ValueDef};

/// Runs the pass; returns whether it changed anything.
pub(super) fn run(func: &mut FuncData) -> bool {
    let graph = Graph::new(func);
    if !has_plain_numbers(func, &graph) {
        return false;
    }
    let mut blocks = PrimaryMap::from(vec![Block(0); func.block_count()]);
    let mut count = 0;
    for (block, slot) in &mut blocks {
        if graph.is_reachable(block) {
            *slot = Block(count);
            count += 1;
        }
    }
    let mut data = Vec::from(std::mem::take(&mut func.blocks));
    let mut old = graph.edges.keys();
    data.retain(|_| old.next().is_some_and(|block| graph.is_reachable(block)));
    func.blocks = data.into();
    for (_, block) in &mut func.entries {
        *block = blocks[*block];
    }
    let total: usize = func.blocks.values().map(|block| block.insts.len()).sum();
    // A value without a definition stays one that the verifier refuses.
    let mut values = PrimaryMap::from(vec![Value::NONE; func.value_count()]);
    // The passes after this one add a few instructions.
    let mut new = FuncData::default();
    new.make_room(total + total / 4);
    // Definitions get their new numbers first. Then uses are replaced, some of which are before
    // their definition in the order of the blocks.
    for (block, data) in &mut func.blocks {
        for (at, param) in data.params.iter_mut().enumerate() {
            let def = ValueDef::Param(block, at as u32);
            let ty = func.values[*param].ty;
            values[*param] = new.values.push(ValueData { ty, def });
            *param = values[*param];
        }
        for inst in &mut data.insts {
            let old = *inst;
            *inst = new.insts.next_key();
            let result = func.results[old].map(|value| {
                let ty = func.values[value].ty;
                let data = ValueData { ty, def: ValueDef::Result(*inst) };
                values[value] = new.values.push(data);
                values[value]
            });
            new.insts.push(func.insts[old]);
            new.locs.push(func.locs[old]);
            new.results.push(result);
        }
    }
    for block in func.blocks.values_mut() {
        for inst in &block.insts {
            new.insts[*inst].for_each_arg_mut(|value| *value = values[*value]);
        }
        if let Some(terminator) = &mut block.terminator {
            terminator.for_each_arg_mut(|value| *value = values[*value]);
            terminator.for_each_block_mut(|block| *block = blocks[*block]);
        }
    }
    func.insts = new.insts;
    func.locs = new.locs;
    func.results = new.results;
    func.values = new.values;
    true
}

/// Whether each instruction stands once, and each operand is the number of a value.
fn has_plain_numbers(func: &FuncData, graph: &Graph) -> bool {
    let mut seen = vec![false; func.insts.len()];
    let mut plain = true;
    let mut check = |value: Value| plain &= value.index() < func.value_count();
    for &block in &graph.order {
        let data = func.block(block);
        for &inst in &data.insts {
            match seen.get_mut(inst.index()) {
                Some(seen @ false) => *seen = true,
                _ => return false,
            }
            func.inst(inst).for_each_arg(&mut check);
        }
        if let Some(terminator) = &data.terminator {
            terminator.for_each_arg(&mut check);
        }
    }
    plain
}
