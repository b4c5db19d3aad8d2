//! Skips instructions that change only bits that nobody uses (demanded bits): a mask before a
//! narrower mask, and a sign that is extended and then cut off again.
//!
//! ```text
//! v1: i32 = and v0, 0xFFFF
//! v2: i32 = and v1, 0xFF    ==>    v2: i32 = and v0, 0xFF
//! ```
//!
//! The pass visits instructions backwards and collects for each value which of its bits its uses
//! demand. If an instruction leaves the demanded bits as they are in its operand, its use becomes a
//! use of the operand. An instruction that nothing uses any more is dropped by `dce`. Of values
//! that are passed to parameters of blocks all bits count as demanded, since not all uses of the
//! parameters have been visited.

use super::graph::Graph;
use super::value_range::{ValueRanges, mask};
use crate::{
    BinaryOp, ConvertOp, ExtractOp, Field, FuncData, InstData, PrimaryMap, Type, UnaryOp, Value,
};

/// At one use no more instructions than this are skipped.
const MAX_SKIPPED: usize = 32;

/// Runs the pass.
pub(super) fn run(func: &mut FuncData) {
    let graph = Graph::new(func);
    let mut ranges = ValueRanges::new(func);
    for &block in &graph.order {
        for &inst in &func.block(block).insts {
            if let Some(result) = func.result(inst) {
                ranges.note(func, result, func.inst(inst));
            }
        }
    }
    // For each value the bits that its uses demand.
    let mut demanded_bits = PrimaryMap::from(vec![0u64; func.value_count()]);
    for &block in graph.order.iter().rev() {
        let data = &func.blocks[block];
        if let Some(terminator) = &data.terminator {
            terminator.for_each_arg(|value| demanded_bits[value] = u64::MAX);
        }
        for at in (0..data.insts.len()).rev() {
            let inst = func.blocks[block].insts[at];
            let mut data = *func.inst(inst);
            let bits = match func.result(inst) {
                Some(result) => demanded_bits[result],
                None => u64::MAX,
            };
            if bits == 0 && !data.has_effect() {
                continue;
            }
            let mut number = 0;
            let original = data;
            data.for_each_arg_mut(|value| {
                let bits = demanded(func, &original, number, bits);
                *value = without_unneeded(func, &ranges, *value, bits);
                demanded_bits[*value] |= bits;
                number += 1;
            });
            func.insts[inst] = data;
        }
    }
}

/// A mask of the highest bit that is 1 and all bits below it. These are the bits of the operands on
/// which the given bits of a sum or product depend.
fn up_to_highest_bit(bits: u64) -> u64 {
    u64::MAX.checked_shr(bits.leading_zeros()).unwrap_or(0)
}

/// The distance of a shift, if it is a constant below the width.
fn distance(func: &FuncData, by: Value, ty: Type) -> Option<u32> {
    let by = u32::try_from(func.constant(by)?).ok()?;
    (by < ty.bits()).then_some(by)
}

/// The bits that an instruction demands of its operand with this number, when `bits` of its own
/// result are demanded.
fn demanded(func: &FuncData, data: &InstData, number: usize, bits: u64) -> u64 {
    match *data {
        InstData::Binary { op, args } => demanded_by_binary(func, op, args, number, bits),
        InstData::Unary { op: UnaryOp::Not, arg: _ } => bits,
        InstData::Unary { op: UnaryOp::Neg, arg: _ } => up_to_highest_bit(bits),
        InstData::Select { .. } if number > 0 => bits,
        InstData::Bit { arg: _, number } => 1 << number,
        InstData::Extract { op, arg: _, field } => {
            let uses_sign = op == ExtractOp::Signed && bits & !field.ones() != 0;
            let sign = if uses_sign { Field::bit(field.width - 1).mask() } else { 0 };
            (bits & field.ones() | sign) << field.first
        }
        InstData::Insert { args: _, field } if number == 0 => bits & !field.mask(),
        InstData::Insert { args: _, field } => bits >> field.first & field.ones(),
        InstData::Convert { op: ConvertOp::Trunc, to, arg: _ } => bits & mask(to),
        InstData::Convert { op: ConvertOp::Zext, to: _, arg } => bits & mask(func.ty(arg)),
        InstData::Convert { op: ConvertOp::Sext, to: _, arg } => {
            let from = func.ty(arg);
            let sign = if bits & !mask(from) == 0 { 0 } else { sign_bit(from) };
            bits & mask(from) | sign
        }
        _ => u64::MAX,
    }
}

fn sign_bit(ty: Type) -> u64 {
    1 << (ty.bits() - 1)
}

/// The bits that an operation on two operands demands of one of them; see [`demanded`].
fn demanded_by_binary(
    func: &FuncData,
    op: BinaryOp,
    [a, b]: [Value; 2],
    number: usize,
    bits: u64,
) -> u64 {
    let ty = func.ty(a);
    let bits = bits & mask(ty);
    let other = func.constant(if number == 0 { b } else { a }).map(|other| other as u64);
    match op {
        BinaryOp::And => bits & other.unwrap_or(u64::MAX),
        BinaryOp::Or => bits & !other.unwrap_or(0),
        BinaryOp::Xor => bits,
        BinaryOp::Add | BinaryOp::Sub | BinaryOp::Mul => up_to_highest_bit(bits),
        BinaryOp::Shl if number == 0 => distance(func, b, ty).map_or(u64::MAX, |by| bits >> by),
        BinaryOp::Lshr if number == 0 => {
            distance(func, b, ty).map_or(u64::MAX, |by| bits << by & mask(ty))
        }
        BinaryOp::Ashr if number == 0 => distance(func, b, ty).map_or(u64::MAX, |by| {
            let right = bits << by & mask(ty);
            if right >> by == bits { right } else { right | sign_bit(ty) }
        }),
        _ => u64::MAX,
    }
}

/// A value that has the same bits in the places of `bits`, but is computed by fewer instructions.
fn without_unneeded(func: &FuncData, ranges: &ValueRanges, mut value: Value, bits: u64) -> Value {
    for _ in 0..MAX_SKIPPED {
        match operand_with_same_bits(func, ranges, value, bits & mask(func.ty(value))) {
            Some(next) => value = next,
            None => break,
        }
    }
    value
}

/// The operand of the instruction that defines a value, if the instruction changes none of `bits`.
fn operand_with_same_bits(
    func: &FuncData,
    ranges: &ValueRanges,
    value: Value,
    bits: u64,
) -> Option<Value> {
    let (op, [a, b]) = match *func.def_inst(value)? {
        InstData::Binary { op, args } => (op, args),
        // Of a field that begins with the lowest bit only the bits above it differ from the word's.
        InstData::Extract { op: _, arg, field } => {
            return (field.first == 0 && bits & !field.ones() == 0).then_some(arg);
        }
        _ => return None,
    };
    if matches!(op, BinaryOp::Or | BinaryOp::Xor) {
        // One operand has none of the bits: they come from the other.
        if ranges.possible_ones(b) & bits == 0 {
            return Some(a);
        }
        if ranges.possible_ones(a) & bits == 0 {
            return Some(b);
        }
    }
    let number = func.constant(b)? as u64;
    (op == BinaryOp::And && bits & !number == 0).then_some(a)
}
