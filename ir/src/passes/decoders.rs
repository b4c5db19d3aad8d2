//! Tests of whether a number is one of several become one test of a mask. Decoders have such tests: an output that is on
//! for some places of a tool turret, or for some of the functions that the control sends.
//!
//! ```text
//! v3: i1 = icmp eq v0, 3                v10: i32 = zext v0
//! v5: i1 = icmp eq v0, 4                v12: i32 = shl 1, v10
//! v6: i1 = or v3, v5             ==>    v14: i32 = and v12, 536870936
//! v8: i1 = icmp eq v0, 29               v9: i1 = icmp ne v14, 0
//! v9: i1 = or v6, v8
//! ```
//!
//! The numbers are 0 to 63. A shift by a greater distance gives 0, as for numbers that are none of them. The shifted 1 is
//! the same for all tests of one number, and `cse` leaves one of them. So what it costs is shared by the tests of a
//! number in a block, and tests are changed only where there are enough comparisons for it. The number may be a field of
//! a word.
//!
//! It may also be a double, as a PMAC's variables are, or the bits of one, compared as an integer of 64 bits. It is
//! converted to an integer and back, and whether that gives the same number, which is 1 or 0, is shifted in the place of
//! the 1: a double that is not an integer of 32 bits is none of the numbers.

use super::cursor::Cursor;
use super::graph::Graph;
use super::switches::compared_field;
use super::thresholds::{
    BITS_COMPARISON_COST, COMPARISON_COST, DECODER_COST, DECODER_TEST_COST, DOUBLE_COMPARISON_COST,
    DOUBLE_DECODER_COST,
};
use super::value_range::mask;
use crate::InstBuilder;
use crate::tables::FastMap;
use crate::{
    BinaryOp, Block, ConvertOp, ExtractOp, Field, FloatCond, FuncData, Inst, InstData, IntCond,
    PrimaryMap, Type, Value,
};

/// What is compared: a field of a word, or a double, or its bits.
type Number = (Value, Field);

/// A test of whether a field is one of some numbers.
#[derive(Clone, Copy)]
struct Members {
    field: Number,
    /// A bit for each number.
    set: u64,
    /// How many comparisons compute it.
    comparisons: u32,
}

/// Runs the pass; returns whether it changed anything.
pub(super) fn run(func: &mut FuncData) -> bool {
    let graph = Graph::new(func);
    let mut members = PrimaryMap::from(vec![None; func.value_count()]);
    let mut has_unions = false;
    for &block in &graph.order {
        for &inst in &func.block(block).insts {
            if let Some(found) = test(func, inst, &members)
                && let Some(result) = func.result(inst)
            {
                has_unions |= found.comparisons > 1;
                members[result] = Some(found);
            }
        }
    }
    if !has_unions {
        return false;
    }
    let is_part = parts(func, &graph, &members);
    let mut changed = false;
    for &block in &graph.order {
        changed |= write(func, block, &members, &is_part);
    }
    changed
}

/// The test that an instruction is: a comparison with a number, or an OR of tests of one field.
fn test(
    func: &FuncData,
    inst: Inst,
    members: &PrimaryMap<Value, Option<Members>>,
) -> Option<Members> {
    match *func.inst(inst) {
        InstData::Icmp { cond: IntCond::Eq, args: [value, number] } => {
            let ty = func.ty(value);
            if ty == Type::I64 {
                // No integer has the bits of -0.
                let number = small_integer(func.constant(number).filter(|&bits| bits >= 0)?)?;
                let field = (value, Field::whole(ty));
                return Some(Members { field, set: 1 << number, comparisons: 1 });
            }
            if !matches!(ty, Type::I8 | Type::I16 | Type::I32) {
                return None;
            }
            let (word, field, number) = compared_field(func, value, func.constant(number)?);
            let number = number as u64 & mask(ty);
            (number < 64).then(|| Members {
                field: (word, field),
                set: 1 << number,
                comparisons: 1,
            })
        }
        InstData::Fcmp { cond: FloatCond::Eq, args: [a, b] } => {
            let (double, number) = match (func.constant(a), func.constant(b)) {
                (None, Some(number)) => (a, number),
                (Some(number), None) => (b, number),
                _ => return None,
            };
            let number = small_integer(number)?;
            let field = (double, Field::whole(Type::F64));
            Some(Members { field, set: 1 << number, comparisons: 1 })
        }
        InstData::Binary { op: BinaryOp::Or, args } => {
            let [a, b] = args.map(|arg| members[arg]);
            let (a, b) = (a?, b?);
            let comparisons = a.comparisons.saturating_add(b.comparisons);
            let both = Members { set: a.set | b.set, comparisons, ..a };
            (a.field == b.field).then_some(both)
        }
        _ => None,
    }
}

/// The integer from 0 to 63 that a double with certain bits is.
fn small_integer(bits: i64) -> Option<u32> {
    let number = f64::from_bits(bits as u64);
    let is_small = (0.0..64.0).contains(&number) && number.fract() == 0.0;
    is_small.then_some(number as u32)
}

/// Whether a number that is compared is a double or the bits of one.
fn is_double(func: &FuncData, number: Value) -> bool {
    matches!(func.ty(number), Type::F64 | Type::I64)
}

/// For each value whether all its uses are ORs that are tests themselves.
fn parts(
    func: &FuncData,
    graph: &Graph,
    members: &PrimaryMap<Value, Option<Members>>,
) -> PrimaryMap<Value, bool> {
    let mut is_part = PrimaryMap::from(vec![true; func.value_count()]);
    for &block in &graph.order {
        let data = func.block(block);
        for &inst in &data.insts {
            let result = func.result(inst);
            if result.is_none_or(|result| members[result].is_none()) {
                func.inst(inst).for_each_arg(|arg| is_part[arg] = false);
            }
        }
        if let Some(terminator) = &data.terminator {
            terminator.for_each_arg(|arg| is_part[arg] = false);
        }
    }
    is_part
}

/// Writes the tests of a block again, where it pays; returns whether there were any.
fn write(
    func: &mut FuncData,
    block: Block,
    members: &PrimaryMap<Value, Option<Members>>,
    is_part: &PrimaryMap<Value, bool>,
) -> bool {
    let outermost = |func: &FuncData, inst: Inst| {
        let result = func.result(inst)?;
        let found = members[result]?;
        // A comparison of an integer is shorter than a test, and one of a double longer.
        let is_long = found.comparisons > 1 || is_double(func, found.field.0);
        (is_long && !is_part[result]).then_some(found)
    };
    // For each field how many comparisons and tests there are, and all numbers.
    let mut fields: FastMap<Number, (u32, u32, u64)> = FastMap::default();
    for &inst in &func.block(block).insts {
        let Some(found) = outermost(func, inst) else { continue };
        let (comparisons, tests, set) = fields.entry(found.field).or_default();
        *comparisons += found.comparisons;
        *tests += 1;
        *set |= found.set;
    }
    fields.retain(|&(number, _), &mut (comparisons, tests, _)| {
        let (comparison, shift) = match func.ty(number) {
            Type::F64 => (DOUBLE_COMPARISON_COST, DECODER_COST + DOUBLE_DECODER_COST),
            Type::I64 => (BITS_COMPARISON_COST, DECODER_COST + DOUBLE_DECODER_COST),
            _ => (COMPARISON_COST, DECODER_COST),
        };
        // One more instruction combines a comparison with another one.
        let before = (comparison + 1).saturating_mul(comparisons) - tests;
        before > shift + DECODER_TEST_COST * tests
    });
    if fields.is_empty() {
        return false;
    }
    let insts = std::mem::take(&mut func.blocks[block].insts);
    let mut out = Vec::with_capacity(insts.len());
    for inst in insts {
        if let Some(found) = outermost(func, inst)
            && let Some(&(.., all)) = fields.get(&found.field)
        {
            func.insts[inst] = mask_test(func, inst, found, all, &mut out);
        }
        out.push(inst);
    }
    func.blocks[block].insts = out;
    true
}

/// The test of a mask for a set of numbers, before which come the instructions that it needs. `all` are the numbers of
/// all tests of the field.
fn mask_test(
    func: &mut FuncData,
    inst: Inst,
    found: Members,
    all: u64,
    out: &mut Vec<Inst>,
) -> InstData {
    let loc = func.loc(inst);
    let mut out = Cursor { func, out, loc };
    let (mut number, field) = found.field;
    let mut is_integer = None;
    if is_double(out.func, number) {
        let (integer, holds) = out.integrality_check_of_bits(number);
        is_integer = Some(holds);
        number = integer;
    }
    let from = out.func.ty(number);
    if is_integer.is_none() && field != Field::whole(from) {
        number = out.build(InstData::Extract { op: ExtractOp::Unsigned, arg: number, field });
    }
    let ty = if all >> 32 == 0 { Type::I32 } else { Type::I64 };
    if from != ty {
        number = out.convert(ConvertOp::Zext, ty, number);
    }
    let one = match is_integer {
        Some(is_integer) => out.convert(ConvertOp::Zext, ty, is_integer),
        None => out.constant(ty, 1),
    };
    let shifted = out.binary(BinaryOp::Shl, one, number);
    let common = out.binary_imm(BinaryOp::And, shifted, found.set as i64);
    let none = out.constant(ty, 0);
    InstData::Icmp { cond: IntCond::Ne, args: [common, none] }
}
