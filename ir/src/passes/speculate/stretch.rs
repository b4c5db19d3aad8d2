//! Stretches, for the pass [`speculate`](super::speculate): the instructions of a statement from its beginning, or from
//! after an effect, to the next effect. If no more than two instructions are left from there on, they belong to the stretch too.
//!
//! A stretch may need several integrality checks one after the other, for example one of a variable
//! that gives an index, and one of a sum with the element at that index. If each had a cold block of its own,
//! control would come back from it after the instructions that depend on the check, and nothing would be known
//! there of the integers. Instead all checks of the stretch share one cold block, which executes the stretch again from
//! its beginning as it was. So the checks come before its first effect.
//!
//! ```text
//! P(800+(P1%64))=(P2+P3)%10
//!
//! v0: f64 = load p:8                 v0: f64 = load p:8
//! v1: f64 = … v0                     v9: … the integrality check of v0
//! v2: f64 = load p:16                    brif v9, block2, block1
//! v3: f64 = load p:24           block1:  … the index, of integers
//! v4: f64 = fadd v2, v3    ==>       v4: f64 = fadd v2, v3
//! v5: f64 = … v4                     v10: … the integrality check of v4
//! store p:6400[v1 * 8, 224], v5          brif v10, block2, block3
//!                               block3:  … the remainder, of integers, and the store
//!                                        jump block4
//!                               block2 cold: the statement as it was
//!                                        jump block4
//! ```

use plcc_abi::IntegerForm;

use super::super::float_range::FloatRange;
use super::super::thresholds::speculate::{MAX_CHECKS, MAX_COPIED_FROM_EFFECT};
use super::checks::{Check, Checks, KnownInteger, MAX_STRETCH};
use super::row::Row;
use super::{OutputTail, Speculate, replace_all};
use crate::InstBuilder;
use crate::tables::FastMap;
use crate::{
    BinaryOp, Block, BlockCall, Inst, InstData, StatementId, Terminator, Type, Value, ValueDef,
};

/// The operands of an operation are followed back through this many instructions to the loads that
/// they are computed from.
const MAX_STEPS: u32 = 5;

/// A check that was written, and whose result no branch has tested yet.
struct WaitingCheck {
    /// The value that is checked.
    checked: Value,
    /// The double, converted from an integer, that takes its place if the check succeeds.
    double: Value,
    /// Whether that is the nearest integer, which takes its place only where operations round it.
    is_rounded: bool,
    /// Whether the check succeeds.
    holds: Value,
}

/// What takes the place of values in the copy of a statement.
#[derive(Default)]
struct Copies {
    /// Everywhere.
    all: Vec<(Value, Value)>,
    /// As operands of operations that round them: their nearest integers.
    rounded: Vec<(Value, Value)>,
}

impl Speculate<'_> {
    /// Writes the stretch that begins with the first of some instructions twice, if it gains by that. `insts` are what is left
    /// of a statement, `end` is the place after them among the instructions of the block, and `after` are those that are
    /// there. Returns how many instructions were copied; `None` if nothing was done.
    pub(super) fn stretch(
        &mut self,
        insts: &[Inst],
        after: &[Inst],
        end: usize,
        rest: &mut OutputTail,
    ) -> Option<usize> {
        let is_last = after.is_empty();
        let row = self.row_before(insts, is_last, rest);
        let checks = self.find_checks(insts, row.as_ref())?;
        if row.is_none() && checks.values.is_empty() {
            return None;
        }
        let (copied, following) = insts.split_at_checked(checks.end)?;
        let passed = self.used_later(copied, end - following.len());
        let ends_block = is_last
            && following.is_empty()
            && passed.is_empty()
            && matches!(rest.terminator, Some(Terminator::Brif { .. } | Terminator::Jump(_)));
        let mut passed = if ends_block { passed } else { self.with_terminator(copied, passed) };
        // A constant that is used after the copies is written once more there, so that it stays known.
        let is_constant = |value: &Value| self.func.constant(*value).is_some();
        let constants: Vec<Value> = passed.extract_if(.., |value| is_constant(value)).collect();
        let is_kept =
            |inst: &&Inst| self.func.result(**inst).is_some_and(|it| constants.contains(&it));
        let kept: Vec<Inst> = copied.iter().filter(is_kept).copied().collect();
        let cold = self.new_block(true);
        let fast = self.copy_with_checks(copied, &checks, cold, rest);
        if let Some(row) = &row {
            self.link(row, cold);
        }
        let (mut insts, mut slow) = (vec![], vec![]);
        for &inst in copied {
            self.copy_inst(inst, &mut slow, &mut insts);
        }
        let join = (!ends_block).then(|| self.new_block(false));
        let terminator_for = |copies: &[(Value, Value)]| match join {
            Some(block) => {
                let mut args = passed.clone();
                replace_all(copies, |f| args.iter_mut().for_each(f));
                Some(Terminator::Jump(BlockCall { block, args }))
            }
            None => {
                let mut terminator = rest.terminator.clone();
                if let Some(terminator) = &mut terminator {
                    replace_all(copies, |f| terminator.for_each_arg_mut(f));
                }
                terminator
            }
        };
        if let Some(join) = join.filter(|_| following.is_empty() && passed.is_empty()) {
            self.add_to_row(row, &checks, copied, &fast, [cold, join]);
        }
        let (fast, slow) = (terminator_for(&fast), terminator_for(&slow));
        let data = &mut self.func.blocks[cold];
        (data.insts, data.terminator) = (insts, slow);
        let Some(join) = join else {
            rest.terminator = fast;
            return Some(checks.end);
        };
        let data = &mut self.func.blocks[rest.block];
        (data.insts, data.terminator) = (std::mem::take(&mut rest.out), fast);
        // What is used after the copies becomes a parameter of the block after them.
        for (at, &value) in passed.iter().enumerate() {
            self.func.values[value].def = ValueDef::Param(join, at as u32);
        }
        self.func.blocks[join].params = passed;
        rest.block = join;
        rest.out.extend(kept);
        Some(checks.end)
    }

    /// The stretch that begins with the first of some instructions, and the checks that it needs. `None` if it has no
    /// operation that is faster on integers.
    fn find_checks<'a>(&self, insts: &'a [Inst], row: Option<&Row>) -> Option<Checks<'a>> {
        let short = insts.get(..MAX_STRETCH).unwrap_or(insts);
        let has_effect = |&inst: &Inst| self.func.inst(inst).has_effect();
        let effect = short.iter().position(has_effect).unwrap_or(short.len());
        let (before, rest) = insts.split_at_checked(effect)?;
        if !before.iter().any(|&inst| self.is_faster_on_integers(self.func.inst(inst))) {
            return None;
        }
        let end = if rest.len() <= MAX_COPIED_FROM_EFFECT { insts.len() } else { effect };
        let same = self.repeated_loads(before);
        let known = row.map_or(vec![], |row| self.known_loads(before, &row.known));
        let mut checks = Checks { insts: before, same, known, values: vec![], end };
        for (at, &inst) in before.iter().enumerate() {
            let data = self.func.inst(inst);
            let count = checks.values.len();
            if self.is_faster_on_integers(data) {
                self.add_checks(data, &mut checks);
            }
            if checks.values.len() > MAX_CHECKS && count > 0 {
                // The stretch ends before this operation.
                checks.values.truncate(count);
                (checks.insts, checks.end) = (before.get(..at)?, at);
                break;
            }
        }
        Some(checks)
    }

    /// The loads among some instructions of variables that are known to hold integers.
    fn known_loads(&self, insts: &[Inst], known: &[KnownInteger]) -> Vec<(Value, KnownInteger)> {
        let find = |&inst: &Inst| match *self.func.inst(inst) {
            InstData::Load { ty: Type::F64, at } => {
                let found = known.iter().find(|variable| variable.at == at)?;
                Some((self.func.result(inst)?, *found))
            }
            _ => None,
        };
        insts.iter().filter_map(find).collect()
    }

    /// The loads among some instructions that read the same as an earlier one of them, each with that one. None of
    /// the instructions has an effect.
    fn repeated_loads(&self, insts: &[Inst]) -> Vec<(Value, Value)> {
        let mut first: FastMap<InstData, Value> = FastMap::default();
        let mut same = vec![];
        for &inst in insts {
            if let (data @ InstData::Load { .. }, Some(result)) =
                (self.func.inst(inst), self.func.result(inst))
            {
                let value = *first.entry(*data).or_insert(result);
                if value != result {
                    same.push((result, value));
                }
            }
        }
        same
    }

    /// Adds the checks that an operation needs to those of the operations before it.
    fn add_checks(&self, data: &InstData, checks: &mut Checks<'_>) {
        let mut operands = vec![];
        data.for_each_arg(|value| {
            let value = checks.first_load(value);
            let range = self.range_after_checks(value, checks, MAX_STEPS);
            if !range.is_int32() && checks.check(value).is_none() && !operands.contains(&value) {
                operands.push(value);
            }
        });
        let Some(check) = self.check_for(data.integer_form(), &operands) else { return };
        for operand in operands {
            let mut loads = vec![];
            self.unchecked_loads(operand, checks, MAX_STEPS, &mut loads);
            let range = self.range_after_checks(operand, checks, MAX_STEPS);
            if loads.is_empty() && is_short(range) {
                continue;
            }
            // It is the same number of checks whether the operand is checked or the only variable that
            // it depends on; then all that follows from the variable is known, too.
            if let [load] = loads.as_slice()
                && check != Check::Rounded
            {
                checks.values.push((*load, Check::Narrow));
                let range = self.range_after_checks(operand, checks, MAX_STEPS);
                if is_short(range) || self.is_variable(*load) && range.integers().is_some() {
                    continue;
                }
                checks.values.pop();
            }
            checks.values.push((operand, check));
        }
    }

    /// Whether a value was loaded from a fixed place.
    fn is_variable(&self, value: Value) -> bool {
        matches!(self.func.def_inst(value), Some(InstData::Load { at, .. }) if at.index.is_none())
    }

    /// The range of a double where the checks have succeeded. Its definition is followed back through
    /// at most `steps` instructions.
    pub(super) fn range_after_checks(
        &self,
        value: Value,
        checks: &Checks<'_>,
        steps: u32,
    ) -> FloatRange {
        if let Some(known) = checks.known(value) {
            return known.range;
        }
        match checks.check(value) {
            Some(Check::Narrow) => return FloatRange::INT32,
            Some(Check::Wide) => return FloatRange::int(-(1 << 50), 1 << 50),
            Some(Check::Rounded) | None => {}
        }
        match self.func.def_inst(value) {
            Some(data) if steps > 0 && self.func.ty(value) == Type::F64 => {
                let range = |value| self.range_after_checks(value, checks, steps - 1);
                self.floats.of_operands(self.func, &self.integers, data, range)
            }
            _ => self.floats.get(value),
        }
    }

    /// Adds the loads that a double is computed from by sums, differences and products to a list,
    /// without those that are checked.
    fn unchecked_loads(
        &self,
        value: Value,
        checks: &Checks<'_>,
        steps: u32,
        loads: &mut Vec<Value>,
    ) {
        let value = checks.first_load(value);
        if self.range_after_checks(value, checks, steps).integers().is_some() {
            return;
        }
        match self.func.def_inst(value) {
            Some(data @ InstData::Load { .. }) if self.floats.is_finite_load(data) => {
                if !loads.contains(&value) {
                    loads.push(value);
                }
            }
            Some(&InstData::Binary {
                op: BinaryOp::Fadd | BinaryOp::Fsub | BinaryOp::Fmul,
                args,
            }) if steps > 0 => {
                for arg in args {
                    self.unchecked_loads(arg, checks, steps - 1, loads);
                }
            }
            // It is not computed from loads alone. It is entered twice, so that the list is not that of a single load.
            _ => loads.extend([value, value]),
        }
    }

    /// Copies instructions, with the checks of some of their results, to the block that is being
    /// filled; a check that fails leads to the cold block. Gives the copy of each result.
    fn copy_with_checks(
        &mut self,
        insts: &[Inst],
        checks: &Checks<'_>,
        cold: Block,
        rest: &mut OutputTail,
    ) -> Vec<(Value, Value)> {
        let mut copies = Copies::default();
        // The checks whose results no branch has tested yet.
        let mut waiting: Vec<WaitingCheck> = vec![];
        let mut repeated = vec![];
        let mut loc = insts.first().map_or(StatementId::NONE, |&inst| self.func.loc(inst));
        let is_own =
            |this: &Self, value| insts.iter().any(|&inst| this.func.result(inst) == Some(value));
        for &(value, check) in &checks.values {
            if !is_own(self, value) {
                waiting.push(self.write_check(value, value, check, rest, loc));
            }
        }
        for &inst in insts {
            if let Some(again) = self.func.result(inst).filter(|&v| checks.first_load(v) != v) {
                repeated.push(again);
                continue;
            }
            if let Some(load) = self.func.result(inst)
                && let Some(known) = checks.known(load)
            {
                copies.all.push((load, known.double));
                continue;
            }
            let mut data = *self.func.inst(inst);
            loc = self.func.loc(inst);
            data.for_each_arg_mut(|arg| *arg = checks.first_load(*arg));
            let mut needs_check = data.has_effect();
            data.for_each_arg(|arg| {
                needs_check |= waiting.iter().any(|check| check.checked == arg)
            });
            if needs_check {
                self.branch_on(&mut waiting, cold, rest, &mut copies, loc);
            }
            if data.integer_form() == Some(IntegerForm::Bits) {
                replace_all(&copies.rounded, |f| data.for_each_arg_mut(f));
            }
            replace_all(&copies.all, |f| data.for_each_arg_mut(f));
            let new = self.cursor(&mut rest.out, loc).build(data);
            let Some(old) = self.func.result(inst) else { continue };
            copies.all.push((old, new));
            if let Some(check) = checks.check(old) {
                waiting.push(self.write_check(old, new, check, rest, loc));
            }
        }
        self.branch_on(&mut waiting, cold, rest, &mut copies, loc);
        let mut copies = copies.all;
        for again in repeated {
            let first = checks.first_load(again);
            let copy = copies.iter().rev().find(|(old, _)| *old == first).map(|&(_, copy)| copy);
            copies.extend(copy.map(|copy| (again, copy)));
        }
        self.changed = true;
        copies
    }

    /// Writes the check of a value, of which `new` is the copy.
    fn write_check(
        &mut self,
        checked: Value,
        new: Value,
        check: Check,
        rest: &mut OutputTail,
        loc: StatementId,
    ) -> WaitingCheck {
        let never_nan = !self.floats.get(checked).may_be_nan();
        let mut out = self.cursor(&mut rest.out, loc);
        let (double, holds) = check.insert(&mut out, new, never_nan);
        WaitingCheck { checked, double, is_rounded: check == Check::Rounded, holds }
    }

    /// Ends the block that is being filled by a branch that goes to the cold block if one of the waiting checks fails,
    /// and begins another block. Does nothing if no check waits.
    fn branch_on(
        &mut self,
        waiting: &mut Vec<WaitingCheck>,
        cold: Block,
        rest: &mut OutputTail,
        copies: &mut Copies,
        loc: StatementId,
    ) {
        let mut all = None;
        for WaitingCheck { checked, double, is_rounded, holds } in waiting.drain(..) {
            let list = if is_rounded { &mut copies.rounded } else { &mut copies.all };
            list.push((checked, double));
            let mut out = self.cursor(&mut rest.out, loc);
            all = Some(match all {
                None => holds,
                Some(others) => out.binary(BinaryOp::And, others, holds),
            });
        }
        let Some(cond) = all else { return };
        let next = self.new_block(false);
        let (then, otherwise) = (BlockCall::plain(next), BlockCall::plain(cold));
        let data = &mut self.func.blocks[rest.block];
        data.insts = std::mem::take(&mut rest.out);
        data.terminator = Some(Terminator::Brif { cond, then, otherwise });
        rest.block = next;
    }
}

/// Whether all numbers of a range are integers of little more than 32 bits, such as the sum of one of 32 bits and a
/// constant. They are divided without a division.
fn is_short(range: FloatRange) -> bool {
    const MOST: u64 = (1 << 31) + (1 << 20);
    range.integers().is_some_and(|(low, high)| low.unsigned_abs().max(high.unsigned_abs()) <= MOST)
}
