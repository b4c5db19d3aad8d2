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
//! Either the doubles that a statement loads are checked, at most [`MAX_CHECKED`](super::speculation_plan::MAX_CHECKED) of them, or the
//! operands of a single host function, whichever takes fewer checks. Of loads it must be known that
//! nothing writes to them between the check and the load. Blocks that are cold or optimised for
//! size stay as they are.

use plcc_abi::IntegerForm;

use super::float_range::FloatRanges;
use super::graph::Graph;
use super::integers::PassedRanges;
use super::speculation_plan::{Mark, Plan, form};
use super::value_range::ValueRanges;
use crate::{
    BinaryOp, Block, BlockCall, BlockData, ConvertOp, FloatCond, FuncData, Inst, InstData,
    RegionId, SourceLoc, Terminator, Type, Value, ValueDef,
};

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

/// Where values are used.
pub(super) struct Uses {
    /// For each value how often.
    pub(super) counts: Vec<u32>,
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

/// A function being changed.
pub(super) struct Speculate<'a> {
    pub(super) func: &'a mut FuncData,
    pub(super) integers: ValueRanges,
    pub(super) floats: FloatRanges<'a>,
    pub(super) uses: Uses,
    pub(super) marks: Vec<Mark>,
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
