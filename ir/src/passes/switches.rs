//! Replaces a row of branches that compare one value with constants by a switch. Programs that keep
//! the number of their state in a variable have such rows.
//!
//! ```text
//! block0: brif (v0 == 1), block9, block1      block0: switch v0, [block5, block9, block8, …], …
//! block1: brif (v0 == 2), block8, block2  ==>
//! block2: …
//! ```
//!
//! The comparisons must be of equality, of the same integer of at most 32 bits, at least
//! [`MIN_TESTS`] of them, and the constants must lie close together. The blocks between may hold a
//! few instructions without effects; these are done before the switch.

use super::graph::Graph;
use crate::{
    BinaryOp, Block, BlockData, ConvertOp, FuncData, InstData, IntCond, Terminator, Type, Value,
};

/// Fewer comparisons than this stay branches: the machine predicts a branch well, and a jump
/// through a table badly.
const MIN_TESTS: usize = 5;
/// The table of a switch has at most four entries for each comparison, and this many more.
const MAX_EXTRA_ENTRIES: u64 = 8;
/// If the least constant is below this, the table begins at 0, which saves a subtraction.
const START_AT_ZERO_BELOW: u64 = 4;
/// A block between two comparisons may have no more instructions than this.
const MAX_INSTS: usize = 4;

/// A branch that compares a value with a number: to `then` if they are equal, else to
/// `otherwise`.
struct Test {
    value: Value,
    number: i64,
    then: Block,
    otherwise: Block,
}

/// Runs the pass; gives whether it changed anything.
pub(super) fn run(func: &mut FuncData) -> bool {
    let graph = Graph::new(func);
    let mut changed = false;
    for &block in &graph.order {
        changed |= convert(func, &graph, block);
    }
    changed
}

/// Replaces the row of branches that begins at the end of a block; gives whether there was one.
fn convert(func: &mut FuncData, graph: &Graph, block: Block) -> bool {
    let Some(first) = test(func, block) else { return false };
    let value = first.value;
    let mut tests = vec![(first.number, first.then)];
    let mut links = vec![];
    let mut next = first.otherwise;
    while let Some(link) = test(func, next)
        && link.value == value
        && graph.sole_predecessor[next.index()].is_some()
        && is_cheap(func, next)
    {
        links.push(next);
        tests.push((link.number, link.then));
        next = link.otherwise;
    }
    let ty = func.ty(value);
    if tests.len() < MIN_TESTS || !matches!(ty, Type::I8 | Type::I16 | Type::I32) {
        return false;
    }
    // A switch takes an unsigned number. A field of a word is compared with its lowest bit in a
    // higher place; the bits below are 0 in all numbers.
    let mask = (1 << ty.bits()) - 1;
    let shift = shifted_left(func, value);
    if tests.iter().any(|(number, _)| number & ((1 << shift) - 1) != 0) {
        return false;
    }
    for (number, _) in &mut tests {
        *number = (*number & mask) >> shift;
    }
    let numbers = || tests.iter().map(|(number, _)| *number as u64);
    let (low, high) = (numbers().min().unwrap_or(0), numbers().max().unwrap_or(0));
    let low = if low < START_AT_ZERO_BELOW { 0 } else { low };
    if high - low >= 4 * tests.len() as u64 + MAX_EXTRA_ENTRIES {
        return false;
    }
    let mut targets = vec![next; (high - low) as usize + 1];
    // If a number is compared twice, the first comparison decides.
    for &(number, then) in tests.iter().rev() {
        targets[(number as u64 - low) as usize] = then;
    }
    let mut insts = std::mem::take(&mut func.blocks[block.index()].insts);
    for link in links {
        let dropped = BlockData { terminator: Some(Terminator::Return), ..BlockData::default() };
        insts.extend(std::mem::replace(&mut func.blocks[link.index()], dropped).insts);
    }
    let loc = insts.last().map_or(crate::SourceLoc::NONE, |&inst| func.loc(inst));
    let mut push = |func: &mut FuncData, data| {
        let inst = func.append(data, loc);
        insts.push(inst);
        func.result(inst)
    };
    let mut arg = value;
    if shift > 0
        && let Some(by) = push(func, InstData::Iconst { ty, value: shift.into() })
    {
        let moved = InstData::Binary { op: BinaryOp::Lshr, args: [arg, by] };
        arg = push(func, moved).unwrap_or(arg);
    }
    if ty != Type::I32 {
        let wide = InstData::Convert { op: ConvertOp::Zext, to: Type::I32, arg };
        arg = push(func, wide).unwrap_or(arg);
    }
    if low > 0 {
        let less = InstData::Iconst { ty: Type::I32, value: Type::I32.wrap(low as i64) };
        if let Some(less) = push(func, less) {
            let moved = InstData::Binary { op: BinaryOp::Sub, args: [arg, less] };
            arg = push(func, moved).unwrap_or(arg);
        }
    }
    let data = &mut func.blocks[block.index()];
    data.insts = insts;
    data.terminator = Some(Terminator::Switch { arg, targets, default: next });
    true
}

/// How far the value of a shift left by a constant was shifted; 0 for other values.
fn shifted_left(func: &FuncData, value: Value) -> u32 {
    let Some(&InstData::Binary { op: BinaryOp::Shl, args: [_, by] }) = func.def_inst(value) else {
        return 0;
    };
    let by = func.constant(by).and_then(|by| u32::try_from(by).ok());
    by.filter(|&by| by < func.ty(value).bits()).unwrap_or(0)
}

/// The terminator of a block as a test; `None` if it is something else.
fn test(func: &FuncData, block: Block) -> Option<Test> {
    let Some(Terminator::Brif { cond, then, otherwise }) = &func.block(block).terminator else {
        return None;
    };
    if !then.args.is_empty() || !otherwise.args.is_empty() {
        return None;
    }
    let &InstData::Icmp { cond, args: [value, number] } = func.def_inst(*cond)? else {
        return None;
    };
    let number = func.constant(number)?;
    let (then, otherwise) = match cond {
        IntCond::Eq => (then.block, otherwise.block),
        IntCond::Ne => (otherwise.block, then.block),
        _ => return None,
    };
    Some(Test { value, number, then, otherwise })
}

/// Whether a block has no parameters and, with its comparison, at most [`MAX_INSTS`] instructions, none
/// of which reads or writes the image or calls the host.
fn is_cheap(func: &FuncData, block: Block) -> bool {
    let data = func.block(block);
    let cheap = |data: &InstData| {
        matches!(data, InstData::Iconst { .. } | InstData::Icmp { .. } | InstData::Unary { .. })
    };
    data.params.is_empty()
        && data.insts.len() <= MAX_INSTS
        && data.insts.iter().all(|&inst| cheap(func.inst(inst)))
}
