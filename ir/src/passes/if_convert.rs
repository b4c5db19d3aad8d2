//! Turns short branches into selects (if-conversion).
//!
//! ```text
//! block0: brif v0, block1, block2       block0: v2: i8 = load vars:0
//! block1: store vars:0, v1        ==>           v3: i8 = select v0, v1, v2
//!         jump block2                           store vars:0, v3
//! block2: …                                     …
//! ```
//!
//! If the two ways of a branch meet again after a few instructions, the instructions of both ways
//! are executed and selects choose between the results. So no branch can be predicted wrongly. All
//! operations are total, so it does no harm to execute them for nothing. A store of the way that is
//! not taken writes back the value that it finds, which does no harm either.
//!
//! Volatile accesses, host calls, stores through an index, and operations that take long must stay
//! behind their branch. Stores keep their order.

use super::graph::Graph;
use crate::{
    BinaryOp, Block, BlockCall, BlockData, ConvertOp, FuncData, Inst, InstData, Terminator, Type,
    UnaryOp, Value,
};

/// The instructions of both ways may cost no more than this together, in cycles, roughly. It is
/// about half of what a wrongly predicted branch costs.
const MAX_COST: u32 = 8;

/// One way of a branch: through a block of its own, or straight to the block where the ways meet.
struct Arm {
    block: Option<Block>,
    to: BlockCall,
}

/// Runs the pass; gives whether it changed anything.
pub(super) fn run(func: &mut FuncData) -> bool {
    let Graph { order, mut edges, sole_predecessor: _ } = Graph::new(func);
    let mut changed = false;
    // Backwards, so that inner branches come before those around them.
    for &block in order.iter().rev() {
        if edges[block.index()] > 0 {
            changed |= convert(func, block, &mut edges);
        }
    }
    changed
}

/// Converts the branch at the end of a block; gives whether that was possible.
fn convert(func: &mut FuncData, block: Block, edges: &mut [u32]) -> bool {
    let Some(Terminator::Brif { cond, then, otherwise }) = &func.block(block).terminator else {
        return false;
    };
    let cond = *cond;
    let through_block = |call: &BlockCall| arm(func, call, edges);
    let straight = |call: &BlockCall| Some(Arm { block: None, to: call.clone() });
    let ways = [
        (straight(then), through_block(otherwise)),
        (through_block(then), straight(otherwise)),
        (through_block(then), through_block(otherwise)),
    ];
    let meets = |(a, b): (Option<Arm>, Option<Arm>)| {
        let (a, b) = (a?, b?);
        let own = [a.block, b.block, Some(block)];
        (a.to.block == b.to.block && !own.contains(&Some(a.to.block))).then_some((a, b))
    };
    let Some((then, otherwise)) = ways.into_iter().find_map(meets) else { return false };
    let cost = |arm: &Arm| arm.block.map_or(Some(0), |block| cost(func, block));
    let (Some(a), Some(b)) = (cost(&then), cost(&otherwise)) else { return false };
    if a + b > MAX_COST {
        return false;
    }
    let mut insts = std::mem::take(&mut func.blocks[block.index()].insts);
    for (arm, taken_if) in [(&then, true), (&otherwise, false)] {
        let Some(block) = arm.block else { continue };
        let dropped = BlockData { terminator: Some(Terminator::Return), ..BlockData::default() };
        let data = std::mem::replace(&mut func.blocks[block.index()], dropped);
        edges[block.index()] = 0;
        for inst in data.insts {
            append_arm_inst(func, &mut insts, inst, cond, taken_if);
        }
    }
    let to = then.to.block;
    let loc = insts.last().map_or(crate::SourceLoc::NONE, |&inst| func.loc(inst));
    let mut args = vec![];
    for (&a, &b) in then.to.args.iter().zip(&otherwise.to.args) {
        let chosen = if a == b {
            None
        } else {
            let inst = func.append(InstData::Select { cond, args: [a, b] }, loc);
            insts.push(inst);
            func.result(inst)
        };
        args.push(chosen.unwrap_or(a));
    }
    edges[to.index()] -= 1;
    let data = &mut func.blocks[block.index()];
    data.insts = insts;
    data.terminator = Some(Terminator::Jump(BlockCall { block: to, args }));
    // The block where the ways meet is appended, so that a branch around all this can be converted
    // too.
    if edges[to.index()] == 1 && func.block(to).params.is_empty() {
        let dropped = BlockData { terminator: Some(Terminator::Return), ..BlockData::default() };
        let next = std::mem::replace(&mut func.blocks[to.index()], dropped);
        edges[to.index()] = 0;
        let data = &mut func.blocks[block.index()];
        data.insts.extend(next.insts);
        data.terminator = next.terminator;
    }
    true
}

/// A way through a block, if control reaches the block from this branch only and the block ends
/// with a jump.
fn arm(func: &FuncData, call: &BlockCall, edges: &[u32]) -> Option<Arm> {
    let data = func.block(call.block);
    match &data.terminator {
        Some(Terminator::Jump(to)) if edges[call.block.index()] == 1 && data.params.is_empty() => {
            Some(Arm { block: Some(call.block), to: to.clone() })
        }
        _ => None,
    }
}

/// The cost of a block's instructions; `None` if they must not be executed for nothing.
fn cost(func: &FuncData, block: Block) -> Option<u32> {
    let mut sum = 0;
    for &inst in &func.block(block).insts {
        sum += inst_cost(func, func.inst(inst))?;
        if sum > MAX_COST {
            return None;
        }
    }
    Some(sum)
}

fn inst_cost(func: &FuncData, data: &InstData) -> Option<u32> {
    match *data {
        // Machines choose between doubles by a branch, so there is nothing to gain.
        InstData::Select { cond: _, args: [value, _] } | InstData::Store { at: _, value }
            if func.ty(value) == Type::F64 =>
        {
            None
        }
        InstData::Iconst { .. } | InstData::Fconst { .. } => Some(0),
        InstData::Unary { op: UnaryOp::Fsqrt, arg: _ } => None,
        InstData::Unary { op: UnaryOp::Not | UnaryOp::Neg, arg: _ } => Some(1),
        InstData::Unary { .. } => Some(3),
        InstData::Binary { op, args: _ } => match op {
            BinaryOp::Sdiv
            | BinaryOp::Srem
            | BinaryOp::Smod
            | BinaryOp::Udiv
            | BinaryOp::Urem
            | BinaryOp::Fdiv => None,
            BinaryOp::Mul => Some(2),
            BinaryOp::Fadd | BinaryOp::Fsub | BinaryOp::Fmul => Some(3),
            _ => Some(1),
        },
        InstData::Icmp { .. } | InstData::Fcmp { .. } | InstData::Select { .. } => Some(1),
        InstData::Convert { op: ConvertOp::IntToFloat | ConvertOp::FloatToInt, .. } => Some(3),
        InstData::Convert { .. } => Some(1),
        InstData::Load { ty: _, at } if !at.volatile => {
            Some(if at.index.is_some() { 3 } else { 1 })
        }
        InstData::Store { at, value: _ } if !at.volatile && at.index.is_none() => Some(3),
        InstData::Load { .. } | InstData::Store { .. } | InstData::HostCall { .. } => None,
    }
}

/// Appends an instruction of a way that is taken if the condition has the value `taken_if`. If the
/// instruction is a store, it writes back the value that it finds when the other way is taken.
fn append_arm_inst(
    func: &mut FuncData,
    insts: &mut Vec<Inst>,
    inst: Inst,
    cond: Value,
    taken_if: bool,
) {
    if let InstData::Store { at, value } = *func.inst(inst) {
        let loc = func.loc(inst);
        let load = func.append(InstData::Load { ty: func.ty(value), at }, loc);
        insts.push(load);
        if let Some(old) = func.result(load) {
            let args = if taken_if { [value, old] } else { [old, value] };
            let select = func.append(InstData::Select { cond, args }, loc);
            insts.push(select);
            if let Some(value) = func.result(select) {
                func.insts[inst.index()] = InstData::Store { at, value };
            }
        }
    }
    insts.push(inst);
}
