//! The checks that a function's variables hold integers, which the pass `speculate-variables` puts where the function is
//! entered, as vectors.
//!
//! ```text
//! block9 (L0):                        for each pair of neighbours:
//!     v0: f64 = load p:0                  both doubles are loaded, truncated to integers of 32 bits,
//!     v1: i32 = ftoi v0                   converted back, and compared; the integers are stored in the
//!     v2: i1 = is_integer_or_nan v0       stack frame
//!     v3: f64 = itof v1
//!     brif v2, block10, block0        then one branch for all: to block0 if any is not an integer
//! block10: the same for p:8
//! ```
//!
//! There are mostly more variables than registers. So the integers are loaded from the stack frame where they are used,
//! and often that load is part of the instruction that uses it.
//!
//! A lane of such a check fails also where the double is NaN. So only doubles of regions in which none is NaN are checked in
//! this way.

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{
    Endianness, InstBuilder, MemFlagsData, StackSlot, StackSlotData, StackSlotKind,
    Value as ClifValue, types,
};
use plcc_ir::passes::thresholds::variable_checks::MIN_CHECKS;
use plcc_ir::tables::{FastMap, FastSet};
use plcc_ir::{
    Address, Block, ConvertOp, FuncData, InstData, Module, PrimaryMap, SecondaryMap, Terminator,
    Type, Value,
};

use super::memory::flags;
use super::{LowerResult, Lowering};
use crate::CodegenOptions;

/// The bytes of a double.
const DOUBLE: u32 = 8;
/// The bytes of the two integers of a pair.
const PAIR: u32 = 8;
/// The bytes of an integer.
const INTEGER: u32 = 4;

/// A check: a block that does nothing else.
struct Check {
    at: Address,
    /// The variable as an integer, and that as a double, where they are used.
    integer: Option<Value>,
    double: Option<Value>,
    /// Where control goes if it holds none.
    slow: Block,
    /// Where control goes otherwise.
    next: Block,
}

/// The checks of a function that are made in vectors.
#[derive(Default)]
pub(super) struct VariableChecks {
    /// The block in which all of them are made, and those whose checks are made there.
    first: Option<Block>,
    others: FastSet<Block>,
    checks: Vec<Check>,
    /// The stack slot of the integers, once they are stored, and the offset of each.
    slot: Option<StackSlot>,
    offsets: FastMap<Value, u32>,
}

impl VariableChecks {
    /// For a function of a module; `uses` says how often each value is used.
    pub(super) fn new(
        module: &Module,
        func: &FuncData,
        uses: &SecondaryMap<Value, u32>,
        options: CodegenOptions,
    ) -> Self {
        let &[(_, first)] = func.entries() else { return Self::default() };
        if !options.vectors {
            return Self::default();
        }
        let Some(first_check) = check(module, func, uses, first) else {
            return Self::default();
        };
        let edges = edges(func);
        let is_reached_once = |block: Block| edges[block] == 1;
        let slow = first_check.slow;
        let mut next = first_check.next;
        let (mut checks, mut others) = (vec![first_check], FastSet::default());
        while let Some(found) = check(module, func, uses, next).filter(|found| found.slow == slow)
            && is_reached_once(next)
        {
            others.insert(next);
            next = found.next;
            checks.push(found);
        }
        // Nothing but the entry leads to the first one.
        if checks.len() < MIN_CHECKS || edges[first] != 0 {
            return Self::default();
        }
        Self { first: Some(first), others, checks, ..Self::default() }
    }
}

/// How often each block is the target of a branch.
fn edges(func: &FuncData) -> PrimaryMap<Block, u32> {
    let mut edges = PrimaryMap::from(vec![0; func.block_count()]);
    for (_, block) in func.blocks() {
        if let Some(terminator) = &block.terminator {
            terminator.for_each_block(|block, _| edges[block] += 1);
        }
    }
    edges
}

/// The check that a block is, if it is one. `uses` says how often each value is used.
fn check(
    module: &Module,
    func: &FuncData,
    uses: &SecondaryMap<Value, u32>,
    block: Block,
) -> Option<Check> {
    let data = func.block(block);
    let (&load, rest) = data.insts.split_first()?;
    let InstData::Load { ty: Type::F64, at } = *func.inst(load) else { return None };
    let variable = func.result(load)?;
    let Some(Terminator::Brif { cond, then, otherwise }) = &data.terminator else { return None };
    let (mut integer, mut double, mut is_checked) = (None, None, false);
    for &inst in rest {
        let &InstData::Convert { op, to: _, arg } = func.inst(inst) else { return None };
        let result = func.result(inst);
        match op {
            ConvertOp::FloatToInt if arg == variable => integer = result,
            ConvertOp::IntToFloat if Some(arg) == integer => double = result,
            ConvertOp::IsIntegerOrNan if arg == variable && result == Some(*cond) => {
                is_checked = true;
            }
            _ => return None,
        }
    }
    let is_plain = data.params.is_empty() && then.args.is_empty() && otherwise.args.is_empty();
    // The integer and its double may be used elsewhere, but not what the image holds, and whether the check fails.
    let conversions = if integer.is_some() { 2 } else { 1 };
    let is_closed = uses[variable] == conversions && uses[*cond] == 1;
    let is_fixed = at.index.is_none() && !at.volatile && module.finite_regions.contains(&at.region);
    (is_checked && is_plain && is_closed && is_fixed).then_some(Check {
        at,
        integer,
        double,
        slow: otherwise.block,
        next: then.block,
    })
}

impl Lowering<'_> {
    /// Makes all checks, if a block is the first of them; returns whether the block is one of them.
    pub(super) fn variable_checks(&mut self, block: Block) -> LowerResult<bool> {
        if self.variable_checks.others.contains(&block) {
            return Ok(true);
        }
        if self.variable_checks.first != Some(block) {
            return Ok(false);
        }
        let checks = std::mem::take(&mut self.variable_checks.checks);
        let Some(&Check { slow, .. }) = checks.first() else { return Ok(false) };
        let loc = self.func.block(block).insts.first().map_or(0, |&inst| self.func.loc(inst).0);
        self.builder.set_srcloc(cranelift_codegen::ir::SourceLoc::new(loc));
        let clif = self.clif_block(block)?;
        self.builder.switch_to_block(clif);
        (self.ir_block, self.cold) = (block, false);
        let pairs = pairs(&checks);
        let size = pairs.len() as u32 * PAIR;
        let data = StackSlotData::new(StackSlotKind::ExplicitSlot, size, 3);
        let slot = self.builder.create_sized_stack_slot(data);
        self.variable_checks.slot = Some(slot);
        let mut fails = None;
        for (pair, offset) in pairs.into_iter().zip((0..).step_by(PAIR as usize)) {
            let failing = self.check_pair(pair, (slot, offset))?;
            fails = Some(match fails {
                Some(before) => self.builder.ins().bor(before, failing),
                None => failing,
            });
        }
        let next = checks.last().map_or(slow, |check| check.next);
        let (slow, next) = (self.clif_block(slow)?, self.clif_block(next)?);
        if let Some(fails) = fails {
            let any = self.builder.ins().vany_true(fails);
            self.builder.ins().brif(any, slow, &[], next, &[]);
        }
        Ok(true)
    }

    /// Checks two variables, or one; stores the integers in the stack frame. Gives a vector in which a lane is not 0 if its
    /// variable holds no integer.
    fn check_pair(
        &mut self,
        (check, other): (&Check, Option<&Check>),
        (slot, offset): (StackSlot, u32),
    ) -> LowerResult<ClifValue> {
        let doubles = match other {
            Some(other) if are_neighbours(&check.at, &other.at) => {
                let (base, distance) = self.address(Type::F64, check.at)?;
                // This says that the second double lies in its region, too.
                self.place(Type::F64, other.at)?;
                self.builder.ins().load(types::F64X2, flags(), base, distance)
            }
            _ => {
                let double = self.load(Type::F64, check.at)?;
                let both = self.builder.ins().splat(types::F64X2, double);
                match other {
                    Some(other) => {
                        let double = self.load(Type::F64, other.at)?;
                        self.builder.ins().insertlane(both, double, 1)
                    }
                    None => both,
                }
            }
        };
        let lanes = self.truncated_lanes(doubles);
        let plain = MemFlagsData::new().with_endianness(Endianness::Little);
        let both = self.builder.ins().bitcast(types::F64X2, plain, lanes);
        let both = self.builder.ins().extractlane(both, 0);
        let pointer = self.builder.func.dfg.value_type(self.context);
        self.builder.ins().stack_store(pointer, both, slot, offset as i32);
        for (check, offset) in [Some(check), other].into_iter().zip([offset, offset + INTEGER]) {
            let Some(check) = check else { continue };
            let offsets = &mut self.variable_checks.offsets;
            offsets.extend(check.integer.into_iter().chain(check.double).map(|v| (v, offset)));
        }
        let wide = self.builder.ins().swiden_low(lanes);
        let converted = self.builder.ins().fcvt_from_sint(types::F64X2, wide);
        Ok(self.builder.ins().fcmp(FloatCC::NotEqual, converted, doubles))
    }

    /// An integer that was stored when its variable was checked, or that as a double.
    pub(super) fn checked_integer(&mut self, value: Value) -> Option<ClifValue> {
        let slot = self.variable_checks.slot?;
        let &offset = self.variable_checks.offsets.get(&value)?;
        let pointer = self.builder.func.dfg.value_type(self.context);
        let integer = self.builder.ins().stack_load(pointer, types::I32, slot, offset as i32);
        Some(match self.func.ty(value) {
            Type::F64 => self.builder.ins().fcvt_from_sint(types::F64, integer),
            _ => integer,
        })
    }

    /// The same, extended to 64 bits with its sign.
    pub(super) fn checked_integer_extended(&mut self, value: Value) -> Option<ClifValue> {
        let slot = self.variable_checks.slot?;
        let &offset = self.variable_checks.offsets.get(&value)?;
        let pointer = self.builder.func.dfg.value_type(self.context);
        let at = self.builder.ins().stack_addr(pointer, slot, offset as i32);
        Some(self.builder.ins().sload32(flags(), at, 0))
    }
}

/// Checks two by two: first those of neighbours, then the others.
fn pairs(checks: &[Check]) -> Vec<(&Check, Option<&Check>)> {
    let (mut pairs, mut single) = (vec![], vec![]);
    let mut rest = checks;
    while let [check, others @ ..] = rest {
        rest = others;
        match others.first().filter(|other| are_neighbours(&check.at, &other.at)) {
            Some(other) => {
                pairs.push((check, Some(other)));
                rest = others.get(1..).unwrap_or_default();
            }
            None => single.push(check),
        }
    }
    for chunk in single.chunks(2) {
        if let Some(&first) = chunk.first() {
            pairs.push((first, chunk.get(1).copied()));
        }
    }
    pairs
}

/// Whether the second double follows the first.
fn are_neighbours(a: &Address, b: &Address) -> bool {
    a.region == b.region && a.offset.checked_add(DOUBLE) == Some(b.offset)
}
