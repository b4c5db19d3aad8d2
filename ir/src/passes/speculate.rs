//! Speculates that doubles are integers: computes with integers behind an integrality check, and
//! with doubles where the check fails.
//!
//! ```text
//! v0: f64 = load p:0                        v0: f64 = load p:0
//! v1: f64 = fconst 7.0                      v1: f64 = fconst 7.0
//! v2: f64 = hostcall pmac_and(v0, v1)       v3: i32 = ftoi v0          (the integrality check)
//! store p:8, v2                             v4: f64 = itof v3
//!                                           v5: i1 = fcmp ordered_ne v4, v0
//!                                ==>        brif v5, block2, block1
//!                                       block1:
//!                                           v6: f64 = hostcall pmac_and(v4, v1)
//!                                           jump block3(v6)
//!                                       block2 cold:
//!                                           v7: f64 = hostcall pmac_and(v0, v1)
//!                                           jump block3(v7)
//!                                       block3(v2: f64):
//!                                           store p:8, v2
//! ```
//!
//! Variables of some controls are doubles that nearly always hold integers, and their bit operators
//! and remainders are host functions that are simple for integers only
//! ([`HostFn::integer_form`](plcc_abi::HostFn::integer_form)). The pass writes the instructions that
//! depend on the checked doubles twice. In the first copy the checked doubles are conversions of
//! integers, from which the pass [`integers`](super::integers) makes integer arithmetic of the
//! whole copy. The second is as it was, in a cold block.
//!
//! Either the doubles that a statement loads are checked, at most [`MAX_CHECKED`] of them, or the
//! operands of a single host function, whichever takes fewer checks. Of loads it must be known that
//! nothing writes to them between the check and the load. Blocks that are cold or optimised for
//! size stay as they are.

use plcc_abi::IntegerForm;

use super::float_range::{FloatRange, FloatRanges};
use super::graph::Graph;
use super::integers::PassedRanges;
use super::value_range::ValueRanges;
use crate::{
    BinaryOp, Block, BlockCall, BlockData, ConvertOp, FloatCond, FuncData, Inst, InstData,
    RegionId, SourceLoc, Terminator, Type, Value, ValueDef,
};

/// A statement speculates on no more loads than this: each costs an integrality check.
const MAX_CHECKED: usize = 6;

/// Runs the pass; gives whether it changed anything. `finite_regions` are those of the module.
pub(super) fn run(func: &mut FuncData, finite_regions: &[RegionId]) -> bool {
    let gains = |inst: &InstData| form(inst).is_some_and(|form| form != IntegerForm::Range);
    if !func.blocks.iter().any(|block| block.insts.iter().any(|&i| gains(func.inst(i)))) {
        return false;
    }
    let graph = Graph::new(func);
    let (integers, floats) = analyse(func, &graph, finite_regions);
    let uses = Uses::new(func);
    let marks = vec![Mark::default(); func.value_count()];
    let mut this = Speculate { func, integers, floats, uses, marks, changed: false };
    for &block in &graph.order {
        let data = this.func.block(block);
        if !data.cold && !data.optimize_for_size {
            this.block(block);
        }
    }
    this.changed
}

/// What is known of each integer and double of a function.
fn analyse<'a>(
    func: &FuncData,
    graph: &Graph,
    finite_regions: &'a [RegionId],
) -> (ValueRanges, FloatRanges<'a>) {
    let mut integers = ValueRanges::new(func);
    let mut floats = FloatRanges::new(func, finite_regions);
    let mut passed = PassedRanges::new(graph);
    for &block in &graph.order {
        let data = func.block(block);
        for (at, &param) in data.params.iter().enumerate() {
            floats.set(param, passed.param(block, at));
        }
        for &inst in &data.insts {
            let Some(result) = func.result(inst) else { continue };
            match func.ty(result) {
                Type::F64 => floats.note(func, &integers, result, func.inst(inst)),
                _ => integers.note(func, result, func.inst(inst)),
            }
        }
        if let Some(terminator) = &data.terminator {
            passed.note(terminator, &floats);
        }
    }
    (integers, floats)
}

/// What a call of a host function comes to for integers.
fn form(data: &InstData) -> Option<IntegerForm> {
    match data {
        InstData::HostCall { function, args: _ } => function.integer_form(),
        _ => None,
    }
}

/// Where values are used.
struct Uses {
    /// For each value how often.
    counts: Vec<u32>,
    /// For each value whether an instruction of another block or another statement uses it, or the
    /// terminator of another block.
    elsewhere: Vec<bool>,
    /// For each value whether its own block's terminator uses it.
    by_terminator: Vec<bool>,
}

impl Uses {
    fn new(func: &FuncData) -> Self {
        let count = func.value_count();
        let mut uses = Self {
            counts: vec![0; count],
            elsewhere: vec![false; count],
            by_terminator: vec![false; count],
        };
        let mut home = vec![(u32::MAX, SourceLoc::NONE); count];
        for (block, data) in func.blocks() {
            for &inst in &data.insts {
                if let Some(result) = func.result(inst) {
                    home[result.index()] = (block.0, func.loc(inst));
                }
            }
        }
        for (block, data) in func.blocks() {
            for &inst in &data.insts {
                func.inst(inst).for_each_arg(|value| {
                    uses.counts[value.index()] += 1;
                    uses.elsewhere[value.index()] |=
                        home[value.index()] != (block.0, func.loc(inst));
                });
            }
            if let Some(terminator) = &data.terminator {
                terminator.for_each_arg(|value| {
                    uses.counts[value.index()] += 1;
                    let own = home[value.index()].0 == block.0;
                    uses.by_terminator[value.index()] |= own;
                    uses.elsewhere[value.index()] |= !own;
                });
            }
        }
        uses
    }
}

/// What is known of a value while its statement is examined.
#[derive(Clone, Copy, Default)]
struct Mark {
    /// Its range if the loads of the statement give integers.
    assumed: Option<FloatRange>,
    /// Whether it depends on a load that may be checked.
    depends: bool,
    /// Whether an operation that gains by integers needs it to be one.
    needed: bool,
}

/// What is to be done with a statement, or with the rest of one.
struct Plan {
    /// The doubles that are checked.
    checked: Vec<Value>,
    /// Further loads of the same variables, each with the one that is checked.
    same: Vec<(Value, Value)>,
    /// The instructions of the statement that come before the check.
    before: Vec<Inst>,
    /// Those that are written twice.
    twice: Vec<Inst>,
    /// How many instructions of the statement the two have together; those behind follow the copies.
    end: usize,
}

struct Speculate<'a> {
    func: &'a mut FuncData,
    integers: ValueRanges,
    floats: FloatRanges<'a>,
    uses: Uses,
    marks: Vec<Mark>,
    changed: bool,
}

impl Speculate<'_> {
    /// Examines the statements of a block.
    fn block(&mut self, block: Block) {
        let insts = std::mem::take(&mut self.func.blocks[block.index()].insts);
        let terminator = self.func.blocks[block.index()].terminator.take();
        let mut rest = Rest { block, out: Vec::with_capacity(insts.len()), terminator };
        let mut from = 0;
        while let Some(&first) = insts.get(from) {
            let loc = self.func.loc(first);
            let same = insts.iter().skip(from).take_while(|&&inst| self.func.loc(inst) == loc);
            let end = from + same.count();
            let statement = insts.get(from..end).unwrap_or_default();
            self.statement(statement, end == insts.len(), &mut rest);
            from = end;
        }
        let data = &mut self.func.blocks[rest.block.index()];
        data.insts = rest.out;
        data.terminator = rest.terminator;
    }

    /// Examines a statement; `is_last` says that no other follows in its block.
    fn statement(&mut self, mut insts: &[Inst], is_last: bool, rest: &mut Rest) {
        if let Some(plan) = self.plan_statement(insts) {
            let (done, behind) = insts.split_at(plan.end.min(insts.len()));
            self.carry_out(&plan, done, behind, is_last, rest);
            insts = behind;
        }
        while let Some(at) = insts.iter().position(|&inst| self.gains(self.func.inst(inst))) {
            let plan = self.plan_call(insts, at);
            let (done, behind) = insts.split_at(plan.end.min(insts.len()));
            self.carry_out(&plan, done, behind, is_last, rest);
            insts = behind;
        }
        rest.out.extend(insts);
    }

    /// Whether an operation is faster on integers, and single operands of it may be checked.
    fn gains(&self, data: &InstData) -> bool {
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
    fn plan_statement(&mut self, insts: &[Inst]) -> Option<Plan> {
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
    fn plan_call(&mut self, insts: &[Inst], at: usize) -> Plan {
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

    /// Does what a plan says with the instructions `done`, the first of a statement; `behind` are
    /// those of it that follow.
    fn carry_out(
        &mut self,
        plan: &Plan,
        done: &[Inst],
        behind: &[Inst],
        is_last: bool,
        rest: &mut Rest,
    ) {
        if plan.checked.is_empty() {
            rest.out.extend(done);
            return;
        }
        self.changed = true;
        rest.out.extend(&plan.before);
        let loc = plan.twice.first().map_or(SourceLoc::NONE, |&inst| self.func.loc(inst));
        let never_nan = plan.checked.iter().all(|&value| !self.floats.get(value).may_be_nan());
        let (cond, join) = match never_nan {
            true => (FloatCond::OrderedNe, BinaryOp::Or),
            false => (FloatCond::Eq, BinaryOp::And),
        };
        let mut all = None;
        let mut integers = vec![];
        for &value in &plan.checked {
            let out = &mut rest.out;
            let narrow = InstData::Convert { op: ConvertOp::FloatToInt, to: Type::I32, arg: value };
            let Some(narrow) = self.append(out, narrow, loc) else { return };
            let back = InstData::Convert { op: ConvertOp::IntToFloat, to: Type::F64, arg: narrow };
            let Some(back) = self.append(out, back, loc) else { return };
            let Some(truth) = self.append(out, InstData::Fcmp { cond, args: [back, value] }, loc)
            else {
                return;
            };
            integers.push((value, back));
            all = match all {
                None => Some(truth),
                Some(others) => {
                    self.append(out, InstData::Binary { op: join, args: [others, truth] }, loc)
                }
            };
        }
        let Some(cond) = all else { return };
        for &(again, first) in &plan.same {
            let known = integers.iter().find(|(value, _)| *value == first).map(|&(_, back)| back);
            integers.extend(known.map(|back| (again, back)));
        }
        let ends_block = is_last
            && behind.is_empty()
            && matches!(rest.terminator, Some(Terminator::Brif { .. } | Terminator::Jump(_)));
        let results: Vec<Value> =
            plan.twice.iter().filter_map(|&inst| self.func.result(inst)).collect();
        let used_behind = |value: Value| {
            let mut used = false;
            for &inst in behind {
                self.func.inst(inst).for_each_arg(|arg| used |= arg == value);
            }
            used
        };
        let set = |flags: &[bool], value: Value| flags.get(value.index()).copied().unwrap_or(false);
        let is_used = |value: Value| set(&self.uses.elsewhere, value) || used_behind(value);
        // The copies can end the block only if nothing behind it uses what they compute.
        let ends_block = ends_block && !results.iter().any(|&value| is_used(value));
        let is_passed =
            |value: Value| is_used(value) || !ends_block && set(&self.uses.by_terminator, value);
        let passed: Vec<Value> = results.iter().copied().filter(|&v| is_passed(v)).collect();
        let [hot, cold] = [false, true].map(|cold| self.new_block(cold));
        let join = (!ends_block).then(|| self.new_block(false));
        for (block, mut copies) in [(hot, integers), (cold, vec![])] {
            let mut insts = vec![];
            for &inst in &plan.twice {
                let mut data = *self.func.inst(inst);
                replace_all(&copies, |f| data.for_each_arg_mut(f));
                let (loc, old) = (self.func.loc(inst), self.func.result(inst));
                let new = self.append(&mut insts, data, loc);
                copies.extend(old.zip(new));
            }
            let terminator = match join {
                Some(join) => {
                    let mut args = passed.clone();
                    replace_all(&copies, |f| args.iter_mut().for_each(f));
                    Some(Terminator::Jump(BlockCall { block: join, args }))
                }
                None => {
                    let mut terminator = rest.terminator.clone();
                    if let Some(terminator) = &mut terminator {
                        replace_all(&copies, |f| terminator.for_each_arg_mut(f));
                    }
                    terminator
                }
            };
            let data = &mut self.func.blocks[block.index()];
            (data.insts, data.terminator) = (insts, terminator);
        }
        let (then, otherwise) = if never_nan { (cold, hot) } else { (hot, cold) };
        let (then, otherwise) = (BlockCall::plain(then), BlockCall::plain(otherwise));
        let guard = Terminator::Brif { cond, then, otherwise };
        let Some(join) = join else {
            // The copies have ended the block.
            rest.terminator = Some(guard);
            return;
        };
        let data = &mut self.func.blocks[rest.block.index()];
        (data.insts, data.terminator) = (std::mem::take(&mut rest.out), Some(guard));
        // What is used behind the copies becomes a parameter of the block behind them.
        for (at, &value) in passed.iter().enumerate() {
            self.func.values[value.index()].def = ValueDef::Param(join, at as u32);
        }
        self.func.blocks[join.index()].params = passed;
        rest.block = join;
    }

    fn new_block(&mut self, cold: bool) -> Block {
        self.func.blocks.push(BlockData { cold, ..BlockData::default() });
        Block(self.func.blocks.len() as u32 - 1)
    }

    /// Appends an instruction to a list; gives its result.
    fn append(&mut self, out: &mut Vec<Inst>, data: InstData, loc: SourceLoc) -> Option<Value> {
        let inst = self.func.append(data, loc);
        out.push(inst);
        self.func.result(inst)
    }
}

/// The part of a block that was not finished yet.
struct Rest {
    /// The block that gets the instructions.
    block: Block,
    /// Its instructions so far.
    out: Vec<Inst>,
    /// Its terminator.
    terminator: Option<Terminator>,
}

/// Replaces operands by their copies. `visit` calls what it is given for each operand.
fn replace_all(copies: &[(Value, Value)], visit: impl FnOnce(&mut dyn FnMut(&mut Value))) {
    visit(&mut |value: &mut Value| {
        if let Some(&(_, copy)) = copies.iter().rev().find(|(old, _)| old == value) {
            *value = copy;
        }
    });
}
