//! Numbers blocks, instructions and values again without gaps, and drops blocks that control cannot
//! reach.
//!
//! Passes drop instructions from the lists of their blocks and leave them in the tables of the
//! [function](crate::func). This pass makes new tables that hold only what is left, in the order in
//! which it stands (in text `block0: v3, v7` becomes `block0: v0, v1`), so that code generation and
//! later passes do not visit the rest. It changes nothing else; entries keep their labels.

use super::graph::Graph;
use crate::func::ValueData;
use crate::{Block, FuncData, Inst, Value, ValueDef};

/// Runs the pass.
pub(super) fn run(func: &mut FuncData) {
    let graph = Graph::new(func);
    let mut blocks = vec![Block(0); func.block_count()];
    let mut count = 0;
    for (index, slot) in blocks.iter_mut().enumerate() {
        if graph.is_reachable(Block(index as u32)) {
            *slot = Block(count);
            count += 1;
        }
    }
    let mut index = 0;
    func.blocks.retain(|_| {
        index += 1;
        graph.is_reachable(Block(index - 1))
    });
    for (_, block) in &mut func.entries {
        *block = blocks[block.index()];
    }
    let total = func.blocks.iter().map(|block| block.insts.len()).sum();
    // A value without a definition stays one that the verifier refuses.
    let mut values = vec![Value::NONE; func.value_count()];
    let mut new = FuncData {
        insts: Vec::with_capacity(total),
        locs: Vec::with_capacity(total),
        results: Vec::with_capacity(total),
        values: Vec::with_capacity(total),
        ..FuncData::default()
    };
    // Definitions get their new numbers first. Then uses are replaced, some of which stand before
    // their definition in the order of the blocks.
    for (number, block) in func.blocks.iter_mut().enumerate() {
        for (at, param) in block.params.iter_mut().enumerate() {
            let def = ValueDef::Param(Block(number as u32), at as u32);
            let ty = func.values[param.index()].ty;
            values[param.index()] = push(&mut new.values, ValueData { ty, def });
            *param = values[param.index()];
        }
        for inst in &mut block.insts {
            let old = inst.index();
            *inst = Inst(new.insts.len() as u32);
            let result = func.results[old].map(|value| {
                let ty = func.values[value.index()].ty;
                let data = ValueData { ty, def: ValueDef::Result(*inst) };
                values[value.index()] = push(&mut new.values, data);
                values[value.index()]
            });
            new.insts.push(func.insts[old]);
            new.locs.push(func.locs[old]);
            new.results.push(result);
        }
    }
    for block in &mut func.blocks {
        for inst in &block.insts {
            new.insts[inst.index()].for_each_arg_mut(|value| *value = values[value.index()]);
        }
        if let Some(terminator) = &mut block.terminator {
            terminator.for_each_arg_mut(|value| *value = values[value.index()]);
            terminator.for_each_block_mut(|block| *block = blocks[block.index()]);
        }
    }
    func.insts = new.insts;
    func.locs = new.locs;
    func.results = new.results;
    func.values = new.values;
}

fn push(values: &mut Vec<ValueData>, data: ValueData) -> Value {
    values.push(data);
    Value(values.len() as u32 - 1)
}
