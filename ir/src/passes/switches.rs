//! Replaces a row of branches that compare one value with constants by a switch. Programs that keep
//! the number of their state in a variable have such rows.
//!
//! ```text
//! block0: brif (v0 == 1), block9, block1      block0: switch v0, [block5, block9, block8, …], …
//! block1: brif (v0 == 2), block8, block2  ==>
//! block2: …
//! ```
//!
//! There must be at least [`MIN_TESTS`] comparisons. All must test the same number for equality, and the
//! constants must be integers that lie close together. The blocks between two comparisons may hold a few
//! instructions without effects, for example another load of the number; these are executed before the
//! switch.
//!
//! Targets that do the same become one. If then only two blocks are left, as in a decoder whose output is on in some
//! states, no jump through a table is needed: the numbers of one of them are the bits of a mask, from which the branch
//! takes its bit.
//!
//! The number is an integer of at most 32 bits, or a double, which may be compared as the integer
//! with the same bits. A double is converted to an integer and back; if that gives another number, no
//! comparison holds.

use super::cursor::Cursor;
use super::graph::Graph;
use super::thresholds::switches::{
    MAX_EXTRA_ENTRIES, MIN_TESTS, MIN_TESTS_OF_DOUBLES, START_AT_ZERO_BELOW,
};
use crate::InstBuilder;
use crate::{
    BinaryOp, Block, BlockCall, BlockData, ConvertOp, ExtractOp, Field, FloatCond, FuncData,
    InstData, IntCond, Terminator, Type, Value, eval,
};

/// A block between two comparisons may have no more instructions than this, nor one that is compared with others.
const MAX_INSTS: usize = 5;
/// Each target is compared with this many others at most.
const MAX_COMPARED: usize = 8;

/// A branch that compares a value with a number: to `then` if they are equal, else to
/// `otherwise`.
struct Test {
    value: Value,
    /// The field of the value that is compared.
    field: Field,
    number: i64,
    then: Block,
    otherwise: Block,
}

/// Runs the pass; returns whether it changed anything.
pub(super) fn run(func: &mut FuncData) -> bool {
    let graph = Graph::new(func);
    let mut changed = false;
    for &block in &graph.order {
        changed |= convert(func, &graph, block);
    }
    changed
}

/// Replaces the row of branches that begins at the end of a block; returns whether there was one.
fn convert(func: &mut FuncData, graph: &Graph, block: Block) -> bool {
    let Some(first) = test(func, block) else { return false };
    let (value, field) = (first.value, first.field);
    let may_load = has_no_effect_after(func, block, value);
    let mut tests = vec![(first.number, first.then)];
    // The blocks of the row after the first one.
    let mut links = vec![];
    let mut next = first.otherwise;
    while let Some(link) = test(func, next)
        && link.field == field
        && (link.value == value || may_load && is_same_load(func, link.value, value))
        && graph.sole_predecessor[next].is_some()
        && is_cheap(func, next)
    {
        links.push(next);
        tests.push((link.number, link.then));
        next = link.otherwise;
    }
    let ty = func.ty(value);
    let is_double = matches!(ty, Type::I64 | Type::F64);
    let enough = if is_double { MIN_TESTS_OF_DOUBLES } else { MIN_TESTS };
    if tests.len() < enough || ty == Type::I1 {
        return false;
    }
    if is_double {
        for (number, _) in &mut tests {
            let double = f64::from_bits(*number as u64);
            let is_integer = f64::from(double as i32) == double && double.is_sign_positive();
            if !is_integer {
                return false;
            }
            *number = double as i64;
        }
    }
    // A switch takes an unsigned number.
    let mask = (1 << ty.bits().min(32)) - 1;
    for (number, _) in &mut tests {
        *number &= mask;
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
    let mut insts = std::mem::take(&mut func.blocks[block].insts);
    for link in links {
        let dropped = BlockData { terminator: Some(Terminator::Return), ..BlockData::default() };
        insts.extend(std::mem::replace(&mut func.blocks[link], dropped).insts);
    }
    let loc = insts.last().map_or(crate::StatementId::NONE, |&inst| func.loc(inst));
    merge_same(func, &mut targets);
    let mut out = Cursor { func, out: &mut insts, loc };
    let mut arg = value;
    if is_double {
        arg = integer_of(&mut out, value);
    }
    if field != Field::whole(ty) {
        arg = out.build(InstData::Extract { op: ExtractOp::Unsigned, arg, field });
    }
    if matches!(ty, Type::I8 | Type::I16) {
        arg = out.convert(ConvertOp::Zext, Type::I32, arg);
    }
    if low > 0 {
        arg = out.binary_imm(BinaryOp::Sub, arg, low as i64);
    }
    let bit = bit_test(&mut out, arg, &targets, next);
    let data = &mut func.blocks[block];
    data.insts = insts;
    data.terminator = Some(match bit {
        Some((cond, then)) => Terminator::Brif {
            cond,
            then: BlockCall::plain(then),
            otherwise: BlockCall::plain(next),
        },
        None => Terminator::Switch { arg, targets, default: next },
    });
    true
}

/// Replaces targets that do the same as one before them by that one.
fn merge_same(func: &FuncData, targets: &mut [Block]) {
    let mut different: Vec<Block> = vec![];
    for target in targets {
        match different.iter().find(|&&other| other == *target || do_same(func, other, *target)) {
            Some(&other) => *target = other,
            None if different.len() < MAX_COMPARED => different.push(*target),
            None => {}
        }
    }
}

/// Whether two blocks do nothing but store the same constants at the same places, and go on at the same block.
fn do_same(func: &FuncData, a: Block, b: Block) -> bool {
    let (a, b) = (func.block(a), func.block(b));
    let stores = |data: &BlockData| {
        let stored = data.insts.iter().filter_map(|&inst| match *func.inst(inst) {
            InstData::Iconst { .. } | InstData::Fconst { .. } => None,
            InstData::Store { at, value } if at.index.is_none() && !at.volatile => {
                Some(func.constant(value).map(|constant| (at, func.ty(value), constant)))
            }
            _ => Some(None),
        });
        stored.collect::<Option<Vec<_>>>()
    };
    let ends = (&a.terminator, &b.terminator);
    let (Some(Terminator::Jump(to)), Some(Terminator::Jump(other))) = ends else { return false };
    let is_plain = a.params.is_empty() && b.params.is_empty() && to.args.is_empty();
    let is_short = a.insts.len() <= MAX_INSTS && b.insts.len() <= MAX_INSTS;
    is_plain && is_short && to == other && stores(a).is_some_and(|list| stores(b) == Some(list))
}

/// The bit of a mask that says whether control goes to the only target beside the default one, with that target; `None`
/// if there are more targets or numbers.
fn bit_test(
    out: &mut Cursor<'_>,
    arg: Value,
    targets: &[Block],
    default: Block,
) -> Option<(Value, Block)> {
    let then = *targets.iter().find(|&&target| target != default)?;
    let is_mask = targets.iter().all(|&target| target == default || target == then);
    if !is_mask || targets.len() > 64 {
        return None;
    }
    let bits = targets.iter().zip(0..).filter(|(target, _)| **target == then);
    let mask = bits.fold(0u64, |mask, (_, number)| mask | 1 << number) as i64;
    let ty = if targets.len() > 32 { Type::I64 } else { Type::I32 };
    let mask = out.constant(ty, mask);
    let by = match ty {
        Type::I64 => out.convert(ConvertOp::Zext, ty, arg),
        _ => arg,
    };
    // Of a number beyond the mask's bits the shift leaves 0.
    let shifted = out.binary(BinaryOp::Lshr, mask, by);
    Some((out.bit(shifted, 0), then))
}

/// The integer that a double is, an `i32`; -1, which a switch takes as a large number, if it is none.
/// The value is a double, or an `i64` with the bits of one.
fn integer_of(out: &mut Cursor<'_>, value: Value) -> Value {
    let (integer, is_equal) = out.integrality_check_of_bits(value);
    let other = out.constant(Type::I32, -1);
    out.select(is_equal, integer, other)
}

/// Whether a value is computed in a block and no later instruction of the block has an effect, so that the
/// variable that it was loaded from still has that value at the end of the block.
fn has_no_effect_after(func: &FuncData, block: Block, value: Value) -> bool {
    let insts = func.block(block).insts.iter().rev();
    let mut after = insts.take_while(|&&inst| !func.inst(inst).has_effect());
    after.any(|&inst| func.result(inst) == Some(value))
}

/// Whether two values are loads of the same variable.
fn is_same_load(func: &FuncData, a: Value, b: Value) -> bool {
    match (func.def_inst(a), func.def_inst(b)) {
        (Some(InstData::Load { ty, at }), Some(InstData::Load { ty: other, at: from })) => {
            (ty, at) == (other, from) && at.index.is_none() && !at.volatile
        }
        _ => false,
    }
}

/// The word that a comparison with a number takes a field of, the field, and the number as the field holds it, without
/// sign. Of any other value it is the whole.
pub(super) fn compared_field(func: &FuncData, value: Value, number: i64) -> (Value, Field, i64) {
    let ty = func.ty(value);
    let whole = (value, Field::whole(ty), number);
    let (word, op, field) = match func.def_inst(value) {
        Some(&InstData::Extract { op, arg, field }) if ty != Type::I64 => (arg, op, field),
        Some(&InstData::Binary { op: BinaryOp::And, args: [word, by] })
            if matches!(ty, Type::I16 | Type::I32)
                && let Some(mask) = func.constant(by)
                && mask > 0
                && mask & (mask + 1) == 0 =>
        {
            (word, ExtractOp::Unsigned, Field { first: 0, width: mask.trailing_ones() as u8 })
        }
        _ => return whole,
    };
    let held = eval::extract(ExtractOp::Unsigned, ty, Field { first: 0, ..field }, number);
    let read = eval::extract(op, ty, Field { first: 0, ..field }, number);
    if read == number { (word, field, held) } else { whole }
}

/// The terminator of a block as a test; `None` if it is something else.
fn test(func: &FuncData, block: Block) -> Option<Test> {
    let Some(Terminator::Brif { cond, then, otherwise }) = &func.block(block).terminator else {
        return None;
    };
    if !then.args.is_empty() || !otherwise.args.is_empty() {
        return None;
    }
    let (value, number, is_equality) = match *func.def_inst(*cond)? {
        InstData::Icmp { cond: IntCond::Eq, args: [value, number] } => (value, number, true),
        InstData::Icmp { cond: IntCond::Ne, args: [value, number] } => (value, number, false),
        InstData::Fcmp { cond: FloatCond::Eq, args: [value, number] } => (value, number, true),
        InstData::Fcmp { cond: FloatCond::Ne, args: [value, number] } => (value, number, false),
        _ => return None,
    };
    let (value, field, number) = compared_field(func, value, func.constant(number)?);
    let (then, otherwise) = match is_equality {
        true => (then.block, otherwise.block),
        false => (otherwise.block, then.block),
    };
    Some(Test { value, field, number, then, otherwise })
}

/// Whether a block has no parameters and, with its comparison, at most [`MAX_INSTS`] instructions. These may
/// be loads that are neither volatile nor indexed, constants, comparisons and cheap operations on one
/// value; nothing that writes the image or calls the host.
fn is_cheap(func: &FuncData, block: Block) -> bool {
    let data = func.block(block);
    let cheap = |data: &InstData| match data {
        InstData::Load { ty: _, at } => at.index.is_none() && !at.volatile,
        InstData::Binary { op, args: _ } => *op == BinaryOp::And,
        InstData::Iconst { .. }
        | InstData::Extract { .. }
        | InstData::Fconst { .. }
        | InstData::Icmp { .. }
        | InstData::Fcmp { .. }
        | InstData::Unary { .. } => true,
        _ => false,
    };
    data.params.is_empty()
        && data.insts.len() <= MAX_INSTS
        && data.insts.iter().all(|&inst| cheap(func.inst(inst)))
}
