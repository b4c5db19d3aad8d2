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

use super::super::float_range::FloatRange;
use super::super::thresholds::speculate::MAX_CHECKED;
use super::Speculate;
use crate::{BinaryOp, ConvertOp, Inst, InstData, Type, UnaryOp, Value};

/// In statements of more instructions than this only single operands are checked, so that the pass
/// takes time in proportion to the length of a function.
pub(super) const MAX_STATEMENT: usize = 200;

/// To see how a double is computed, its definition is followed back this far.
const MAX_STEPS: u32 = 4;

/// How it is checked whether a double is an integer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Check {
    /// Whether it is an integer of 32 bits. This takes the shortest code.
    Narrow,
    /// Whether it is an integer from -2^50 to 2^50 - 1.
    Wide,
    /// Whether it is less than 0.5 away from such an integer, which then takes its place as the operand of
    /// operations that round it to the nearest integer ([`IntegerForm::Bits`]), and nowhere else.
    Rounded,
}

/// How a double is computed, as far as it shows what numbers to expect.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum ValueClass {
    /// By operations that make integers of 32 bits of integers as small as variables usually hold.
    Plain,
    /// By a product of two variables, among others, which may be a larger integer.
    Product,
    /// By a quotient, a function or a factor with a fraction, among others.
    Fraction,
}

/// What is known of a value while its statement is examined.
#[derive(Clone, Copy, Default)]
pub(super) struct Mark {
    /// Its range if the loads of the statement give integers.
    assumed: Option<FloatRange>,
    /// Whether it depends on a load that may be checked.
    depends: bool,
    /// Whether an operation that is faster on integers needs it to be one.
    needed: bool,
}

/// What is to be done with a statement, or with the rest of one.
pub(super) struct Plan {
    /// The doubles that are checked.
    pub(super) checked: Vec<(Value, Check)>,
    /// Further loads of the same variables, each with the one that is checked.
    pub(super) same: Vec<(Value, Value)>,
    /// The instructions of the statement that come before the check.
    pub(super) before: Vec<Inst>,
    /// Those that are written twice.
    pub(super) twice: Vec<Inst>,
    /// How many instructions of the statement are in `before` and `twice`. Those after them follow
    /// the copies.
    pub(super) end: usize,
}

impl Speculate<'_> {
    /// Whether an operation is faster on integers, and single operands of it may be checked.
    pub(super) fn is_faster_on_integers(&self, data: &InstData) -> bool {
        let InstData::HostCall { function: _, args } = data else { return false };
        match data.integer_form() {
            Some(IntegerForm::And | IntegerForm::Or | IntegerForm::Xor | IntegerForm::Bits) => true,
            Some(IntegerForm::Modulo) => {
                let by = args.as_slice().get(1).and_then(|&by| self.floats.get(by).integers());
                by.is_some_and(|(low, high)| low == high && low != 0)
            }
            _ => false,
        }
    }

    fn mark(&self, value: Value) -> Mark {
        self.marks[value]
    }

    fn mark_mut(&mut self, value: Value) -> &mut Mark {
        &mut self.marks[value]
    }

    /// The range of a double, if the loads that may be checked give integers.
    fn assumed(&self, value: Value) -> FloatRange {
        self.mark(value).assumed.unwrap_or_else(|| self.floats.get(value))
    }

    /// The plan that checks the variables which a statement loads. `None` if no operation would gain by
    /// it, if it takes fewer checks to check the operands of single calls, or if the statement is longer
    /// than [`MAX_STATEMENT`] or would need more than [`MAX_CHECKED`] checks.
    pub(super) fn plan_statement(&mut self, insts: &[Inst]) -> Option<Plan> {
        if insts.len() > MAX_STATEMENT
            || !insts.iter().any(|&inst| self.is_faster_on_integers(self.func.inst(inst)))
        {
            return None;
        }
        let mut loads: Vec<(Value, crate::Address, usize)> = vec![];
        let mut same: Vec<(Value, Value)> = vec![];
        // The first instruction that writes to the image.
        let mut first_write = insts.len();
        // The last operation that is faster on integers, and the first call that stays although the loads are integers:
        // nothing after that is written twice.
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
                let form = data.integer_form();
                let is_replaced = depends
                    && args.as_slice().iter().all(|&arg| integer(arg))
                    && match form {
                        Some(IntegerForm::Range) => self.range_keeps(args.as_slice()),
                        Some(IntegerForm::Bits) => true,
                        Some(_) => assumed.is_some_and(|range| range.integers().is_some()),
                        None => false,
                    };
                if self.is_faster_on_integers(&data) {
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
    /// some doubles and those that are written twice. Loads and calls that do not depend on the
    /// doubles come before it, with what they need, and what is used behind. All else is written
    /// twice: what does not depend on the doubles is often needed in one copy only.
    ///
    /// `None` if one of the doubles would itself be computed in the copies.
    fn split(
        &mut self,
        insts: &[Inst],
        end: usize,
        checked: Vec<Value>,
        same: Vec<(Value, Value)>,
    ) -> Option<Plan> {
        let (copied, behind) = insts.split_at_checked(end)?;
        let is_leaf =
            |value: Value| checked.contains(&value) || same.iter().any(|&(v, _)| v == value);
        let mut dependent: Vec<Value> = vec![];
        // What may come before the check, in the order of the instructions.
        let mut may_come_before = vec![];
        // What the copies contain so far. A store must not move before a load of the copies, nor a load before a
        // store of theirs, nor an effect before an effect. What is only computed holds nothing back.
        let (mut copies_store, mut copies_load, mut copies_effect) = (false, false, false);
        for &inst in copied {
            let data = self.func.inst(inst);
            let result = self.func.result(inst);
            let mut depends = false;
            data.for_each_arg(|value| depends |= dependent.contains(&value) || is_leaf(value));
            let is_load = matches!(data, InstData::Load { .. });
            let follows_effect = data.has_effect() && (copies_effect || copies_load && !is_load);
            let stays = depends || is_load && copies_store || follows_effect;
            if stays {
                copies_store |= matches!(data, InstData::Store { .. });
                copies_load |= is_load;
                copies_effect |= data.has_effect();
                dependent.extend(result);
            }
            may_come_before.push(!stays);
        }
        let is_late = |(&inst, &before): (&Inst, &bool)| {
            !before && self.func.result(inst).is_some_and(is_leaf)
        };
        if copied.iter().zip(&may_come_before).any(is_late) {
            return None;
        }
        let mut needed: Vec<Value> = vec![];
        for &inst in behind {
            self.func.inst(inst).for_each_arg(|value| needed.push(value));
        }
        let (mut before, mut twice) = (vec![], vec![]);
        for (&inst, &may_come_before) in copied.iter().zip(&may_come_before).rev() {
            let data = self.func.inst(inst);
            let is_needed = self.func.result(inst).is_some_and(|result| {
                needed.contains(&result) || self.uses.elsewhere[result] || is_leaf(result)
            });
            let is_long = matches!(data, InstData::Load { .. } | InstData::HostCall { .. });
            if may_come_before && (is_needed || is_long || data.has_effect()) {
                data.for_each_arg(|value| needed.push(value));
                before.push(inst);
            } else {
                twice.push(inst);
            }
        }
        before.reverse();
        twice.reverse();
        let checked = checked.into_iter().map(|value| (value, Check::Narrow)).collect();
        Some(Plan { checked, same, before, twice, end })
    }

    /// Whether several operations of a statement would be checked one by one if one check did not serve them all. These
    /// are indices: what other operations are computed from is found by
    /// [`plan_statement`](Self::plan_statement), which copies less.
    pub(super) fn serves_several(&self, insts: &[Inst]) -> bool {
        let mut operations = 0;
        for &inst in insts {
            let data = self.func.inst(inst);
            if self.is_faster_on_integers(data) {
                if data.integer_form() != Some(IntegerForm::Bits) {
                    return false;
                }
                operations += usize::from(!self.operands_to_check(data).is_empty());
            }
        }
        operations > 1
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

    /// The operands of a call that have to be checked, each with the check that most values pass. The
    /// list is empty, so that nothing is checked, for a remainder whose dividend probably has a
    /// fraction.
    fn checks_of(&self, data: &InstData) -> Vec<(Value, Check)> {
        let operands = self.operands_to_check(data);
        let Some(check) = self.check_for(data.integer_form(), &operands) else {
            return vec![];
        };
        operands.into_iter().map(|value| (value, check)).collect()
    }

    /// The check that most values of an operation's operands pass; `None` for a remainder whose
    /// dividend probably has a fraction.
    pub(super) fn check_for(&self, form: Option<IntegerForm>, operands: &[Value]) -> Option<Check> {
        let nature = operands.iter().map(|&value| self.nature(value, MAX_STEPS)).max();
        match (form, nature.unwrap_or(ValueClass::Plain)) {
            (_, ValueClass::Plain) => Some(Check::Narrow),
            (Some(IntegerForm::Bits), _) => Some(Check::Rounded),
            (Some(IntegerForm::Modulo), ValueClass::Fraction) => None,
            (Some(IntegerForm::Modulo), ValueClass::Product) => Some(Check::Wide),
            // Bit operators are seldom used on fractions and on more than 32 bits.
            _ => Some(Check::Narrow),
        }
    }

    /// How a double is computed. Its definition is followed back through at most `steps`
    /// instructions.
    fn nature(&self, value: Value, steps: u32) -> ValueClass {
        let Some(data) = self.func.def_inst(value) else { return ValueClass::Plain };
        let of = |value| match steps {
            0 => ValueClass::Plain,
            _ => self.nature(value, steps - 1),
        };
        match *data {
            InstData::Fconst { .. } if self.floats.get(value).integers().is_none() => {
                ValueClass::Fraction
            }
            InstData::Unary { op: UnaryOp::Fsqrt, arg: _ } => ValueClass::Fraction,
            InstData::Unary { op: UnaryOp::Ffloor | UnaryOp::Fceil | UnaryOp::Ftrunc, arg: _ } => {
                ValueClass::Plain
            }
            InstData::Unary { op: _, arg } => of(arg),
            InstData::Binary { op: BinaryOp::Fdiv, args: _ } => ValueClass::Fraction,
            InstData::Binary { op, args: [a, b] } => {
                let nature = of(a).max(of(b));
                let is_constant = |value| self.func.constant(value).is_some();
                if op == BinaryOp::Fmul && !is_constant(a) && !is_constant(b) {
                    nature.max(ValueClass::Product)
                } else {
                    nature
                }
            }
            InstData::HostCall { function, args: _ } if function.is_pure() => {
                let integer = function.integer_form().is_some();
                if integer { ValueClass::Plain } else { ValueClass::Fraction }
            }
            _ => ValueClass::Plain,
        }
    }

    /// The plan that checks the operands of a single call; `at` is its place among the instructions.
    pub(super) fn plan_call(&mut self, insts: &[Inst], at: usize) -> Plan {
        let call = insts.get(at).copied();
        let mut twice: Vec<Inst> = call.into_iter().collect();
        let checked = call.map_or(vec![], |call| self.checks_of(self.func.inst(call)));
        let mut end = at + 1;
        // An instruction that takes the low bits of the call's result is written twice with it.
        let result = call.and_then(|call| self.func.result(call));
        if let (Some(result), Some(&next)) = (result, insts.get(end))
            && self.uses.counts[result] == 1
            && matches!(*self.func.inst(next), InstData::Convert { op: ConvertOp::Trunc, to: _, arg }
                if arg == result)
        {
            twice.push(next);
            end += 1;
        }
        let mut before = insts.get(..at).unwrap_or_default().to_vec();
        // So are constants and conversions of integers to doubles that nothing but the call uses: of the copy
        // for integers nothing is left of them.
        if let Some(call) = call.filter(|_| insts.len() <= MAX_STATEMENT) {
            let args = *self.func.inst(call);
            let serves_call = |&inst: &Inst| {
                let mut serves = false;
                if let InstData::Convert { op: ConvertOp::IntToFloat, .. }
                | InstData::Fconst { .. } = self.func.inst(inst)
                {
                    args.for_each_arg(|arg| {
                        let is_checked = checked.iter().any(|&(value, _)| value == arg);
                        let is_arg = self.func.result(inst) == Some(arg) && !is_checked;
                        serves |= is_arg && self.uses.counts[arg] == 1;
                    });
                }
                serves
            };
            let operands: Vec<Inst> = before.iter().copied().filter(serves_call).collect();
            before.retain(|inst| !serves_call(inst));
            twice.splice(0..0, operands);
        }
        Plan { checked, same: vec![], before, twice, end }
    }
}
