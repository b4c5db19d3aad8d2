//! Computes with truth values instead of integers of which only the lowest bit matters. NCT's
//! register OP has 16 bits, and most programs keep truth values in it.
//!
//! ```text
//! v2: i16 = zext v0
//! v3: i16 = zext v1
//! v4: i16 = and v2, v3      ==>   v6: i1 = and v0, v1
//! v5: i1 = bit v4, 0              (v5 is replaced by v6)
//! ```
//!
//! The pass first finds, backwards, of which integers only the lowest bit is demanded. Then it
//! visits instructions forwards and keeps for integers the truth value that is their lowest bit.
//! An AND, OR, XOR or NOT gets a truth value of its own if all its operands have one, and if
//! nothing demands its other bits or these are surely 0. `dce` drops the integers that are not used any
//! more, and nothing is computed both as an integer and as a truth value: where the other bits are
//! demanded, the integer becomes a conversion of the truth value.

use super::cursor::Cursor;
use super::graph::Graph;
use super::substitution::Substitution;
use super::value_range::ValueRanges;
use crate::InstBuilder;
use crate::{
    BinaryOp, ConvertOp, FuncData, InstData, PrimaryMap, SecondaryMap, Type, UnaryOp, Value,
};

/// Runs the pass; returns whether it changed anything.
pub(super) fn run(func: &mut FuncData) -> bool {
    let graph = Graph::new(func);
    let demanded = demanded_above_lowest(func, &graph);
    let mut ranges = ValueRanges::new(func);
    let mut bits = SecondaryMap::from(vec![None; func.value_count()]);
    let mut values = Substitution::new(func);
    let mut changed = false;
    for &block in &graph.order {
        let insts = std::mem::take(&mut func.blocks[block].insts);
        let mut out = Vec::with_capacity(insts.len());
        for inst in insts {
            let mut data = *func.inst(inst);
            values.inst(&mut data);
            func.insts[inst] = data;
            let Some(result) = func.result(inst) else {
                out.push(inst);
                continue;
            };
            ranges.note(func, result, &data);
            let ty = func.ty(result);
            if ty == Type::I1 {
                if let InstData::Bit { arg, number: 0 } = data
                    && let Some(bit) = bits[arg]
                {
                    values.replace(result, bit);
                    changed = true;
                    continue;
                }
            } else if ty.is_int() {
                let is_demanded = demanded[result];
                let is_truth = ranges.possible_ones(result) <= 1;
                let loc = func.loc(inst);
                let mut cursor = Cursor { func, out: &mut out, loc };
                let bit = cursor.lowest_bit(&data, &bits, !is_demanded || is_truth);
                bits[result] = bit;
                let is_logic = matches!(data, InstData::Binary { .. });
                if let Some(arg) = bit.filter(|_| is_logic && is_demanded) {
                    // All other bits are 0.
                    func.insts[inst] = InstData::Convert { op: ConvertOp::Zext, to: ty, arg };
                    changed = true;
                }
            }
            out.push(inst);
        }
        let data = &mut func.blocks[block];
        data.insts = out;
        if let Some(terminator) = &mut data.terminator {
            values.terminator(terminator);
        }
    }
    // Blocks that control cannot reach were not visited, and may use what was replaced.
    if changed {
        for data in func.blocks.values_mut() {
            for &inst in &data.insts {
                values.inst(&mut func.insts[inst]);
            }
            if let Some(terminator) = &mut data.terminator {
                values.terminator(terminator);
            }
        }
    }
    changed
}

/// For each value whether a use demands more than its lowest bit.
fn demanded_above_lowest(func: &FuncData, graph: &Graph) -> PrimaryMap<Value, bool> {
    let mut demanded = PrimaryMap::from(vec![false; func.value_count()]);
    for &block in graph.order.iter().rev() {
        let data = &func.blocks[block];
        if let Some(terminator) = &data.terminator {
            terminator.for_each_arg(|value| demanded[value] = true);
        }
        for &inst in data.insts.iter().rev() {
            let data = func.inst(inst);
            let passes_on = match data {
                InstData::Bit { arg: _, number: 0 } => false,
                InstData::Binary { op: BinaryOp::And | BinaryOp::Or | BinaryOp::Xor, .. }
                | InstData::Unary { op: UnaryOp::Not, arg: _ }
                | InstData::Convert { op: ConvertOp::Zext | ConvertOp::Trunc, .. } => {
                    func.result(inst).is_none_or(|result| demanded[result])
                }
                _ => true,
            };
            if passes_on {
                data.for_each_arg(|value| demanded[value] = true);
            }
        }
    }
    demanded
}

impl Cursor<'_> {
    /// The lowest bit of the result of an instruction, if that is known without new instructions,
    /// or if `may_compute` and it can be computed from lowest bits.
    fn lowest_bit(
        &mut self,
        data: &InstData,
        bits: &SecondaryMap<Value, Option<Value>>,
        may_compute: bool,
    ) -> Option<Value> {
        let known = |value: Value| bits[value];
        match *data {
            InstData::Convert { op: ConvertOp::Zext, to: _, arg }
                if self.func.ty(arg) == Type::I1 =>
            {
                Some(arg)
            }
            InstData::Convert { op: ConvertOp::Zext | ConvertOp::Trunc, to: _, arg } => known(arg),
            InstData::Iconst { ty: _, value } => Some(self.constant(Type::I1, value & 1)),
            InstData::Binary {
                op: op @ (BinaryOp::And | BinaryOp::Or | BinaryOp::Xor),
                args: [a, b],
            } if may_compute => {
                let (a, b) = (known(a)?, known(b)?);
                Some(self.binary(op, a, b))
            }
            InstData::Unary { op: UnaryOp::Not, arg } if may_compute => {
                let arg = known(arg)?;
                Some(self.not(arg))
            }
            _ => None,
        }
    }
}
