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
//! Where both ways end with a store to the same place, what they compute is done first; then one
//! select chooses between the values, and one store writes the chosen one. Two constant doubles are
//! chosen as integers with the same bits.
//!
//! Volatile accesses, host calls, stores through an index, and operations that take long must stay
//! after their branch. Stores keep their order.

use super::cursor::Cursor;
use super::graph::Graph;
use super::thresholds::if_convert::{MAX_COST, SAVED_BY_COMMON_STORE, STORE_COST};
use crate::InstBuilder;
use crate::{
    Address, BinaryOp, Block, BlockCall, BlockData, ConvertOp, FuncData, Inst, InstData,
    PrimaryMap, Terminator, Type, UnaryOp, Value,
};

/// One way of a branch: through a block of its own, or straight to the block where the ways meet.
struct Arm {
    block: Option<Block>,
    to: BlockCall,
}

/// Runs the pass; returns whether it changed anything.
pub(super) fn run(func: &mut FuncData) -> bool {
    let Graph { order, mut edges, sole_predecessor: _ } = Graph::new(func);
    let mut changed = false;
    // Backwards, so that inner branches come before those around them.
    for &block in order.iter().rev() {
        if edges[block] > 0 {
            changed |= convert(func, block, &mut edges);
        }
    }
    changed
}

/// Converts the branch at the end of a block; returns whether that was possible.
fn convert(func: &mut FuncData, block: Block, edges: &mut PrimaryMap<Block, u32>) -> bool {
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
    if let (Some(a), Some(b)) = (then.block, otherwise.block) {
        store_doubles_as_integers(func, a, b);
    }
    let cost = |arm: &Arm| arm.block.map_or(Some(0), |block| cost(func, block));
    let (Some(a), Some(b)) = (cost(&then), cost(&otherwise)) else { return false };
    let common = match (then.block, otherwise.block) {
        (Some(a), Some(b)) => common_store(func, a, b),
        _ => None,
    };
    if a + b > MAX_COST + if common.is_some() { SAVED_BY_COMMON_STORE } else { 0 } {
        return false;
    }
    let mut insts = std::mem::take(&mut func.blocks[block].insts);
    for (arm, taken_if) in [(&then, true), (&otherwise, false)] {
        let Some(block) = arm.block else { continue };
        let dropped = BlockData { terminator: Some(Terminator::Return), ..BlockData::default() };
        let data = std::mem::replace(&mut func.blocks[block], dropped);
        edges[block] = 0;
        for inst in data.insts {
            match common {
                // The stores of both ways follow as one.
                Some((at, _)) if matches!(func.inst(inst), InstData::Store { at: to, .. } if *to == at) =>
                    {}
                _ => append_arm_inst(func, &mut insts, inst, cond, taken_if),
            }
        }
    }
    if let Some((at, args)) = common {
        let loc = insts.last().map_or(crate::StatementId::NONE, |&inst| func.loc(inst));
        let mut out = Cursor { func, out: &mut insts, loc };
        let value = out.build(InstData::Select { cond, args });
        out.store(at, value);
    }
    let to = then.to.block;
    let loc = insts.last().map_or(crate::StatementId::NONE, |&inst| func.loc(inst));
    let mut args = vec![];
    for (&a, &b) in then.to.args.iter().zip(&otherwise.to.args) {
        let mut out = Cursor { func, out: &mut insts, loc };
        args.push(if a == b { a } else { out.select(cond, a, b) });
    }
    edges[to] -= 1;
    let data = &mut func.blocks[block];
    data.insts = insts;
    data.terminator = Some(Terminator::Jump(BlockCall { block: to, args }));
    // The block where the ways meet is appended, so that a branch around all this can be converted
    // too.
    if edges[to] == 1 && func.block(to).params.is_empty() {
        let dropped = BlockData { terminator: Some(Terminator::Return), ..BlockData::default() };
        let next = std::mem::replace(&mut func.blocks[to], dropped);
        edges[to] = 0;
        let data = &mut func.blocks[block];
        data.insts.extend(next.insts);
        data.terminator = next.terminator;
    }
    true
}

/// A way through a block, if control reaches the block from this branch only and the block ends
/// with a jump.
fn arm(func: &FuncData, call: &BlockCall, edges: &PrimaryMap<Block, u32>) -> Option<Arm> {
    let data = func.block(call.block);
    match &data.terminator {
        Some(Terminator::Jump(to)) if edges[call.block] == 1 && data.params.is_empty() => {
            Some(Arm { block: Some(call.block), to: to.clone() })
        }
        _ => None,
    }
}

/// The cost of a block's instructions; `None` if they must not be executed for nothing, or cost so
/// much that the branch stays in any case.
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

/// The store with which a block ends, if it is the only one and its address is fixed.
fn last_store(func: &FuncData, block: Block) -> Option<(Inst, Address, Value)> {
    let insts = &func.block(block).insts;
    let is_store = |inst: &&Inst| matches!(func.inst(**inst), InstData::Store { .. });
    let &last = insts.last()?;
    match *func.inst(last) {
        InstData::Store { at, value } if at.index.is_none() && !at.volatile => {
            (insts.iter().filter(is_store).count() == 1).then_some((last, at, value))
        }
        _ => None,
    }
}

/// The place to which both ways store last, and the values that they store: then what both compute
/// can be done first, and one store takes the place of two.
fn common_store(func: &FuncData, a: Block, b: Block) -> Option<(Address, [Value; 2])> {
    let ((_, at, x), (_, other, y)) = (last_store(func, a)?, last_store(func, b)?);
    (at == other && func.ty(x) == func.ty(y)).then_some((at, [x, y]))
}

/// If two ways do nothing but store a constant double each, to the same place, they store integers
/// with the same bits instead.
fn store_doubles_as_integers(func: &mut FuncData, a: Block, b: Block) {
    let is_constant = |func: &FuncData, block: Block| {
        let plain = |&inst: &Inst| {
            matches!(func.inst(inst), InstData::Fconst { .. } | InstData::Store { .. })
        };
        let (inst, at, value) = last_store(func, block)?;
        let InstData::Fconst { bits } = *func.def_inst(value)? else { return None };
        func.block(block).insts.iter().all(plain).then_some((inst, at, bits))
    };
    let (Some(x), Some(y)) = (is_constant(func, a), is_constant(func, b)) else { return };
    if x.1 != y.1 {
        return;
    }
    for (block, (inst, at, bits)) in [(a, x), (b, y)] {
        let loc = func.loc(inst);
        let (constant, value) =
            func.append(InstData::Iconst { ty: Type::I64, value: bits as i64 }, loc);
        func.insts[inst] = InstData::Store { at, value };
        func.blocks[block].insts.insert(0, constant);
    }
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
        InstData::Convert { op: ConvertOp::IsInteger | ConvertOp::IsIntegerOrNan, .. } => Some(4),
        // A bit that becomes an integer takes a shift and a mask.
        InstData::Convert { op: _, to: _, arg }
            if matches!(func.def_inst(arg), Some(InstData::Bit { .. })) =>
        {
            Some(0)
        }
        InstData::Convert { .. } => Some(1),
        InstData::Bit { arg: _, number } => Some(1 + u32::from(number > 0)),
        InstData::Extract { .. } => Some(2),
        InstData::Insert { .. } => Some(4),
        InstData::Load { ty: _, at } if !at.volatile => {
            Some(if at.index.is_some() { 3 } else { 1 })
        }
        InstData::Store { at, value: _ } if !at.volatile && at.index.is_none() => Some(STORE_COST),
        InstData::Load { .. }
        | InstData::Store { .. }
        | InstData::Unpack { .. }
        | InstData::Pack { .. }
        | InstData::HostCall { .. }
        | InstData::IsLate => None,
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
        let (loc, ty) = (func.loc(inst), func.ty(value));
        let mut out = Cursor { func, out: insts, loc };
        let old = out.load(ty, at);
        let args = if taken_if { [value, old] } else { [old, value] };
        let value = out.build(InstData::Select { cond, args });
        func.insts[inst] = InstData::Store { at, value };
    }
    insts.push(inst);
}
