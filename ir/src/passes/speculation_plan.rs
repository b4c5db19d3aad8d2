//! Plans for the pass [`speculate`](super::speculate): which doubles of a statement are checked, and
//! which instructions depend on them, so that they are written twice.
//!
//! ```text
//! v0: f64 = load p:0
//! v1: f64 = load p:8
//! v2: f64 = hostcall pmac_and(v0, v3)        checked: v0, which v2 and v4 are computed from
//! v4: f64 = hostcall pmac_or(v2, v5)         written twice: v2, v4
//! v6: f64 = fadd v4, v1                      v1 need not be an integer
//! store p:16, v6
//! ```

use plcc_abi::IntegerForm;

use super::float_range::FloatRange;
use super::speculate::Speculate;
use crate::{ConvertOp, Inst, InstData, Type, Value};

/// A statement speculates on no more loads than this: each costs an integrality check.
pub(super) const MAX_CHECKED: usize = 6;

/// What a call of a host function comes to for integers.
pub(super) fn form(data: &InstData) -> Option<IntegerForm> {
    match data {
        InstData::HostCall { function, args: _ } => function.integer_form(),
        _ => None,
    }
}

/// What is known of a value while its statement is examined.
#[derive(Clone, Copy, Default)]
pub(super) struct Mark {
    /// Its range if the loads of the statement give integers.
    assumed: Option<FloatRange>,
    /// Whether it depends on a load that may be checked.
    depends: bool,
    /// Whether an operation that gains by integers needs it to be one.
    needed: bool,
}

/// What is to be done with a statement, or with the rest of one.
pub(super) struct Plan {
    /// The doubles that are checked.
    pub(super) checked: Vec<Value>,
    /// Further loads of the same variables, each with the one that is checked.
    pub(super) same: Vec<(Value, Value)>,
    /// The instructions of the statement that come before the check.
    pub(super) before: Vec<Inst>,
    /// Those that are written twice.
    pub(super) twice: Vec<Inst>,
    /// How many instructions of the statement the two have together; those behind follow the copies.
    pub(super) end: usize,
}

impl Speculate<'_> {
    /// Whether an operation is faster on integers, and single operands of it may be checked.
    pub(super) fn gains(&self, data: &InstData) -> bool {
        let InstData::HostCall { function: _, args } = data else { return false };
        match form(data) {
            Some(IntegerForm::And | IntegerForm::Or | IntegerForm::Xor | IntegerForm::Bits) => true,
            Some(IntegerForm::Modulo) => {
                let by = args.as_slice().get(1).and_then(|&by| self.floats.get(by).integers());
                by.is_some_and(|(low, high)| low == high && low != 0)
            }
            _ => false,
        }
    }

    fn mark(&self, value: Value) -> Mark {
        self.marks.get(value.index()).copied().unwrap_or_default()
    }

    fn mark_mut(&mut self, value: Value) -> &mut Mark {
        if value.index() >= self.marks.len() {
            self.marks.resize(value.index() + 1, Mark::default());
        }
        &mut self.marks[value.index()]
    }

    /// The range of a double, if the loads that may be checked give integers.
    fn assumed(&self, value: Value) -> FloatRange {
        self.mark(value).assumed.unwrap_or_else(|| self.floats.get(value))
    }

    /// How to compute a statement with integers while all variables that it loads for that are
    /// integers; `None` if it can't be, or if fewer checks do.
    pub(super) fn plan_statement(&mut self, insts: &[Inst]) -> Option<Plan> {
        if !insts.iter().any(|&inst| self.gains(self.func.inst(inst))) {
            return None;
        }
        let mut loads: Vec<(Value, crate::Address, usize)> = vec![];
        let mut same: Vec<(Value, Value)> = vec![];
        // The first instruction that writes to the image, and the first call that integers do not
        // replace behind the last operation that gains.
        let mut first_write = insts.len();
        let (mut gain, mut barrier) = (None, insts.len());
        let mut replaced = vec![];
        let mut single_checks = 0;
        for (at, &inst) in insts.iter().enumerate() {
            let data = *self.func.inst(inst);
            let writes = match data {
                InstData::Store { .. } => true,
                InstData::HostCall { function, args: _ } => !function.is_pure(),
                _ => false,
            };
            if writes {
                first_write = first_write.min(at);
            }
            let mut depends = false;
            data.for_each_arg(|value| depends |= self.mark(value).depends);
            let mut assumed = None;
            if let InstData::Load { ty: _, at: address } = data
                && let Some(result) = self.func.result(inst)
                && self.floats.is_finite_load(&data)
                && !address.volatile
                && !depends
                && first_write == insts.len()
            {
                match loads.iter().find(|(_, other, _)| *other == address) {
                    Some(&(first, _, _)) => same.push((result, first)),
                    None => loads.push((result, address, at)),
                }
                (assumed, depends) = (Some(FloatRange::INT32), true);
            } else if let Some(result) = self.func.result(inst)
                && self.func.ty(result) == Type::F64
                && depends
            {
                assumed = Some(self.assumed_of(&data));
            }
            if let InstData::HostCall { function: _, args } = data {
                let integer = |value: Value| self.assumed(value).integers().is_some();
                let form = form(&data);
                let is_replaced = depends
                    && args.as_slice().iter().all(|&arg| integer(arg))
                    && match form {
                        Some(IntegerForm::Range) => self.range_keeps(args.as_slice()),
                        Some(IntegerForm::Bits) => true,
                        Some(_) => assumed.is_some_and(|range| range.integers().is_some()),
                        None => false,
                    };
                if self.gains(&data) {
                    single_checks += self.operands_to_check(&data).len();
                }
                if !is_replaced {
                    barrier = barrier.min(at);
                } else if barrier == insts.len() {
                    replaced.push(inst);
                    if !matches!(form, Some(IntegerForm::Bits | IntegerForm::Range)) {
                        gain = Some(at);
                    }
                }
            }
            if let Some(result) = self.func.result(inst) {
                *self.mark_mut(result) = Mark { assumed, depends, needed: false };
            }
        }
        let last_gain = gain?;
        // What the calls that integers replace are computed from.
        for &inst in &replaced {
            let data = *self.func.inst(inst);
            data.for_each_arg(|value| self.mark_mut(value).needed = true);
        }
        for &inst in insts.iter().rev() {
            let Some(result) = self.func.result(inst) else { continue };
            if self.mark(result).needed && self.func.ty(result) == Type::F64 {
                let data = *self.func.inst(inst);
                if !matches!(data, InstData::Load { .. }) {
                    data.for_each_arg(|value| self.mark_mut(value).needed = true);
                }
            }
        }
        for &(again, first) in &same {
            if self.mark(again).needed {
                self.mark_mut(first).needed = true;
            }
        }
        loads.retain(|&(value, _, _)| self.mark(value).needed);
        same.retain(|&(_, first)| self.mark(first).needed);
        if loads.is_empty() || loads.len() > MAX_CHECKED || loads.len() > single_checks {
            return None;
        }
        // Stores are not written twice: what they store is passed to a common one.
        let store = insts
            .iter()
            .skip(last_gain)
            .position(|&inst| matches!(self.func.inst(inst), InstData::Store { .. }));
        let end = store.map_or(insts.len(), |at| last_gain + at).min(barrier);
        let checked: Vec<Value> = loads.iter().map(|&(value, _, _)| value).collect();
        self.split(insts, end, checked, same)
    }

    /// Whether a number is in its range, which are the operands of [`IntegerForm::Range`], if the
    /// loads that may be checked give integers.
    fn range_keeps(&self, args: &[Value]) -> bool {
        let &[x, low, high] = args else { return false };
        let [x, low, high] = [x, low, high].map(|value| self.assumed(value).integers());
        match (x, low, high) {
            (Some((least, most)), Some((_, low)), Some((high, _))) => low <= least && most <= high,
            _ => false,
        }
    }

    /// What is known of an operation's result if the loads that may be checked give integers.
    fn assumed_of(&self, data: &InstData) -> FloatRange {
        self.floats.of_operands(self.func, &self.integers, data, |value| self.assumed(value))
    }

    /// Divides the first `end` instructions of a statement into those that come before the check of
    /// some doubles and those that depend on one.
    fn split(
        &mut self,
        insts: &[Inst],
        end: usize,
        checked: Vec<Value>,
        same: Vec<(Value, Value)>,
    ) -> Option<Plan> {
        let (mut before, mut twice) = (vec![], vec![]);
        let mut is_written = false;
        let mut dependent: Vec<Value> = checked.clone();
        dependent.extend(same.iter().map(|&(again, _)| again));
        let leaves = dependent.len();
        for &inst in insts.get(..end)? {
            let data = self.func.inst(inst);
            let result = self.func.result(inst);
            let is_leaf =
                result.is_some_and(|r| dependent.iter().take(leaves).any(|&leaf| leaf == r));
            let mut depends = false;
            data.for_each_arg(|value| depends |= dependent.contains(&value));
            is_written |= matches!(data, InstData::Store { .. });
            let follows_store = is_written && matches!(data, InstData::Load { .. });
            let follows_copy = !twice.is_empty() && data.has_effect();
            if !is_leaf && (depends || follows_store || follows_copy) {
                twice.push(inst);
                dependent.extend(result);
            } else {
                before.push(inst);
            }
        }
        Some(Plan { checked, same, before, twice, end })
    }

    /// The operands of a call that have to be checked if it alone is computed with integers.
    fn operands_to_check(&self, data: &InstData) -> Vec<Value> {
        let mut found = vec![];
        data.for_each_arg(|value| {
            let known = self.floats.get(value).integers().is_some_and(|(low, high)| {
                i32::try_from(low).is_ok() && i32::try_from(high).is_ok()
            });
            if !known && !found.contains(&value) {
                found.push(value);
            }
        });
        found
    }

    /// How to compute a single call with integers while its operands are integers; `at` is its
    /// number among the instructions.
    pub(super) fn plan_call(&mut self, insts: &[Inst], at: usize) -> Plan {
        let call = insts.get(at).copied();
        let mut twice: Vec<Inst> = call.into_iter().collect();
        let checked = call.map_or(vec![], |call| self.operands_to_check(self.func.inst(call)));
        let mut end = at + 1;
        // The low bits of a number follow the call that gives all of them.
        let result = call.and_then(|call| self.func.result(call));
        if let (Some(result), Some(&next)) = (result, insts.get(end))
            && self.uses.counts.get(result.index()) == Some(&1)
            && matches!(*self.func.inst(next), InstData::Convert { op: ConvertOp::Trunc, to: _, arg }
                if arg == result)
        {
            twice.push(next);
            end += 1;
        }
        let before = insts.get(..at).unwrap_or_default().to_vec();
        Plan { checked, same: vec![], before, twice, end }
    }
}
