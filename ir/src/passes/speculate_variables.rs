//! Speculates that the variables of a function hold integers: checks each of them once where the function is
//! entered.
//!
//! ```text
//!                                         block9 (L0):
//!                                             v10: f64 = load p:0       the integrality check of P0;
//! block0 (L0):                                v11: i32 = ftoi v10       a block for each variable
//!     P1=P0&7                                 v12: f64 = itof v11
//!     P2=P0&56                   ==>          v13: i1 = fcmp ordered_ne v12, v10
//!     P0=P1|P2                                brif v13, block0, block10
//!                                         block10: the same statements, with v12 for P0, and with
//!                                                  what was stored in P1 and P2 for these
//!                                         block0 cold: the statements as they were
//! ```
//!
//! The pass [`speculate`](super::speculate) checks operands in each statement. In functions that use their
//! variables often, this pass makes a copy of all blocks instead, to which control goes if all variables hold
//! integers of 32 bits. In the copy no load of such a variable is left: what was checked, or what
//! was stored since, takes its place, as a parameter of a block where control flow joins. So the pass
//! [`integers`](super::integers) makes integer arithmetic of the whole copy. Every store stays in its place.
//! What the copy computes does not depend on what a variable holds later: where integers are not known, as
//! behind a store to a computed place, it loads the variable again, and `speculate` checks it there.
//!
//! The function must have a single entry, no loop, and no call of a host function that is not pure outside of
//! cold blocks. The number of loads that need no check any more must be at least
//! [`LOADS_PER_VARIABLE`] times that of the variables, and nearly all operations of the copy must get integers.

use std::collections::HashMap;

use plcc_abi::IntegerForm;

use super::float_range::{FloatRange, FloatRanges};
use super::graph::Graph;
use super::speculation_plan::called_integer_form;
use super::value_range::ValueRanges;
use crate::func::ValueData;
use crate::{
    Address, BinaryOp, Block, BlockCall, BlockData, ConvertOp, FloatCond, FuncData, Inst, InstData,
    IntCond, RegionId, SourceLoc, Terminator, Type, UnaryOp, Value, ValueDef,
};

/// So often must the checked variables be loaded on the average, or else a check of each costs more than it
/// saves.
const LOADS_PER_VARIABLE: usize = 2;

/// The least number of loads for which the code is copied.
const MIN_LOADS: usize = 24;

/// The copy is of use only if not more than one in so many operations still has operands that must be
/// checked: behind a check that may fail, a result is not known to be an integer any more.
const MIN_GAIN: usize = 8;

/// No more variables than this are checked.
const MAX_VARIABLES: usize = 64;

/// The bounds of an index are found through so many instructions.
const MAX_STEPS: u32 = 6;

/// The bytes of a double.
const SIZE: u64 = 8;

/// What is known of each variable at a place of the copy: the double that it holds.
type Known = Vec<Option<Value>>;

/// Runs the pass; gives whether it changed anything. `finite_regions` are those of the module.
pub(super) fn run(func: &mut FuncData, finite_regions: &[RegionId]) -> bool {
    let &[(label, entry)] = func.entries() else { return false };
    let graph = Graph::new(func);
    let floats = FloatRanges::new(func, finite_regions);
    let variables = variables_to_check(func, &graph, &floats);
    if variables.is_empty() || !is_suitable(func, &graph, entry) {
        return false;
    }
    let loc = func.block(entry).insts.first().map_or(SourceLoc::NONE, |&inst| func.loc(inst));
    let mut copy = Copy {
        integers: ValueRanges::new(func),
        floats,
        values: vec![None; func.value_count()],
        blocks: vec![None; func.block_count()],
        variables,
        bits: HashMap::new(),
        gaining: 0,
        other_operands: 0,
        func,
    };
    let checks: Vec<Check> = (0..copy.variables.len()).filter_map(|n| copy.check(n, loc)).collect();
    if checks.len() != copy.variables.len() {
        return false;
    }
    let count = copy.func.block_count();
    copy.blocks(&graph, entry, &checks);
    let (gaining, others) = (copy.gaining, copy.other_operands);
    let fast = copy.blocks.get(entry.index()).copied().flatten();
    let Some(fast) = fast.filter(|_| others * MIN_GAIN <= gaining) else {
        func.blocks.truncate(count);
        return false;
    };
    let guard = add_guard(func, checks, entry, fast);
    func.entries = vec![(label, guard)];
    for &block in &graph.order {
        func.blocks[block.index()].cold = true;
    }
    true
}

/// Whether a function has the form that the pass can copy.
fn is_suitable(func: &FuncData, graph: &Graph, entry: Block) -> bool {
    let mut places = vec![0; func.block_count()];
    for (place, &block) in graph.order.iter().enumerate() {
        places[block.index()] = place;
    }
    let is_suitable = |&block: &Block| {
        let data = func.block(block);
        let mut goes_on = true;
        if let Some(terminator) = &data.terminator {
            let place = places[block.index()];
            terminator.for_each_block(|next, _| goes_on &= places[next.index()] > place);
        }
        let calls_host = |&inst: &Inst| match func.inst(inst) {
            InstData::HostCall { function, args: _ } => !function.is_pure(),
            _ => false,
        };
        goes_on && !data.optimize_for_size && (data.cold || !data.insts.iter().any(calls_host))
    };
    graph.edges[entry.index()] == 1 && graph.order.iter().all(is_suitable)
}

/// The variables that are worth being checked, in the order of their addresses; none if it does not pay.
fn variables_to_check(func: &FuncData, graph: &Graph, floats: &FloatRanges<'_>) -> Vec<Address> {
    let mut needed = vec![false; func.value_count()];
    let mut counts: HashMap<(RegionId, u32), usize> = HashMap::new();
    // How many operations are faster on integers, and how many operands of these do not come from
    // variables.
    let (mut gaining, mut others) = (0, 0);
    for &block in graph.order.iter().rev().filter(|block| !func.block(**block).cold) {
        for &inst in func.block(block).insts.iter().rev() {
            let data = func.inst(inst);
            let is_needed = func.result(inst).is_some_and(|value| needed[value.index()]);
            match *data {
                InstData::Load { ty: _, at } if is_needed && is_variable(floats, data) => {
                    *counts.entry((at.region, at.offset)).or_default() += 1;
                }
                _ if gains(func, data) || is_needed && keeps_integers(func, data) => {
                    gaining += usize::from(gains(func, data));
                    data.for_each_arg(|value| needed[value.index()] = true);
                }
                InstData::Load { .. } | InstData::Binary { .. } if is_needed => others += 1,
                _ => {}
            }
        }
    }
    let mut found: Vec<((RegionId, u32), usize)> = counts.into_iter().collect();
    found.sort_unstable_by_key(|&((region, offset), count)| {
        (std::cmp::Reverse(count), region.index(), offset)
    });
    found.truncate(MAX_VARIABLES);
    let loads: usize = found.iter().map(|&(_, count)| count).sum();
    let pays = loads >= MIN_LOADS.max(LOADS_PER_VARIABLE * found.len());
    if !pays || others * MIN_GAIN > gaining {
        return vec![];
    }
    found.sort_unstable_by_key(|&((region, offset), _)| (region.index(), offset));
    found.into_iter().map(|((region, offset), _)| Address::fixed(region, offset)).collect()
}

/// Whether an instruction loads a double from a fixed place, which is finite and not -0.
fn is_variable(floats: &FloatRanges<'_>, data: &InstData) -> bool {
    match data {
        InstData::Load { ty: _, at } => {
            at.index.is_none() && !at.volatile && floats.is_finite_load(data)
        }
        _ => false,
    }
}

/// Whether an operation is faster on integers.
fn gains(func: &FuncData, data: &InstData) -> bool {
    let InstData::HostCall { function: _, args } = data else { return false };
    match called_integer_form(data) {
        Some(IntegerForm::Modulo) => {
            let by = args.as_slice().get(1).and_then(|&by| func.constant(by));
            by.is_some_and(|by| is_integer(by) && f64::from_bits(by as u64) != 0.0)
        }
        Some(IntegerForm::Range) | None => false,
        Some(_) => true,
    }
}

/// Whether an operation on integers gives an integer.
fn keeps_integers(func: &FuncData, data: &InstData) -> bool {
    match *data {
        InstData::Unary { op: UnaryOp::Fneg | UnaryOp::Fabs | UnaryOp::Ffinite, arg: _ } => true,
        InstData::Binary { op: BinaryOp::Fadd | BinaryOp::Fsub | BinaryOp::Fmul, args } => {
            args.iter().all(|&arg| func.constant(arg).is_none_or(is_integer))
        }
        _ => false,
    }
}

/// Whether the bits of a double are those of an integer.
fn is_integer(bits: i64) -> bool {
    FloatRange::constant(bits as u64).integers().is_some()
}

/// The integrality check of a variable.
struct Check {
    insts: Vec<Inst>,
    /// The double that takes the variable's place.
    double: Value,
    /// Whether the check fails.
    fails: Value,
}

/// Adds the blocks that make the checks, those that are used; gives the first. They go to `slow` if
/// one fails, and else to `fast`. Each check is a block of its own, so that no double must be kept until all
/// are checked.
fn add_guard(func: &mut FuncData, checks: Vec<Check>, slow: Block, fast: Block) -> Block {
    // The checks stand in no block yet, so these are the uses in the copy.
    let counts = func.use_counts();
    let mut next = fast;
    for check in checks.into_iter().rev() {
        if counts.get(check.double.index()).is_none_or(|&count| count == 0) {
            continue;
        }
        let (then, otherwise) = (BlockCall::plain(slow), BlockCall::plain(next));
        let terminator = Some(Terminator::Brif { cond: check.fails, then, otherwise });
        func.blocks.push(BlockData { insts: check.insts, terminator, ..BlockData::default() });
        next = Block(func.blocks.len() as u32 - 1);
    }
    next
}

/// A function whose blocks are being copied.
struct Copy<'a> {
    func: &'a mut FuncData,
    integers: ValueRanges,
    floats: FloatRanges<'a>,
    /// For each value of the original its copy.
    values: Vec<Option<Value>>,
    /// For each block of the original its copy.
    blocks: Vec<Option<Block>>,
    /// The variables that are checked.
    variables: Vec<Address>,
    /// For values of the copy that are the bits of a variable, as an `i64`, the double.
    bits: HashMap<Value, Value>,
    /// How many operations of the copy are faster on integers, and how many of these have operands that are
    /// not known to be integers.
    gaining: usize,
    other_operands: usize,
}

impl Copy<'_> {
    /// Makes the check of a variable, by its number.
    fn check(&mut self, number: usize, loc: SourceLoc) -> Option<Check> {
        let at = *self.variables.get(number)?;
        let mut insts = vec![];
        let load = self.append(InstData::Load { ty: Type::F64, at }, loc, &mut insts)?;
        let integer = ConvertOp::FloatToInt;
        let integer = InstData::Convert { op: integer, to: Type::I32, arg: load };
        let integer = self.append(integer, loc, &mut insts)?;
        let double = ConvertOp::IntToFloat;
        let double = InstData::Convert { op: double, to: Type::F64, arg: integer };
        let double = self.append(double, loc, &mut insts)?;
        let fails = InstData::Fcmp { cond: FloatCond::OrderedNe, args: [double, load] };
        let fails = self.append(fails, loc, &mut insts)?;
        Some(Check { insts, double, fails })
    }

    /// Appends an instruction to a list; gives its result.
    fn append(&mut self, data: InstData, loc: SourceLoc, out: &mut Vec<Inst>) -> Option<Value> {
        let inst = self.func.append(data, loc);
        out.push(inst);
        let result = self.func.result(inst)?;
        match self.func.ty(result) {
            Type::F64 => self.floats.note(self.func, &self.integers, result, &data),
            _ => self.integers.note(self.func, result, &data),
        }
        Some(result)
    }

    /// Copies all blocks.
    fn blocks(&mut self, graph: &Graph, entry: Block, checks: &[Check]) {
        let before = graph.predecessors(self.func);
        let mut ends: Vec<Known> = vec![vec![]; self.func.block_count()];
        for &block in &graph.order {
            let cold = self.func.block(block).cold;
            self.func.blocks.push(BlockData { cold, ..BlockData::default() });
            self.blocks[block.index()] = Some(Block(self.func.blocks.len() as u32 - 1));
        }
        for &block in &graph.order {
            let Some(copy) = self.blocks.get(block.index()).copied().flatten() else { continue };
            let params = self.func.block(block).params.clone();
            for param in params {
                let ty = self.func.ty(param);
                let value = self.add_param(copy, ty);
                self.values[param.index()] = Some(value);
            }
            let mut known: Known = match block == entry {
                true => checks.iter().map(|check| Some(check.double)).collect(),
                false => self.known_at(copy, &before[block.index()], &ends),
            };
            let mut out = vec![];
            for inst in self.func.block(block).insts.clone() {
                self.inst(inst, &mut known, &mut out);
            }
            let mut terminator = self.func.block(block).terminator.clone();
            if let Some(terminator) = &mut terminator {
                terminator.for_each_arg_mut(|value| *value = self.copied(*value));
                terminator.for_each_block_mut(|block| {
                    if let Some(copy) = self.blocks.get(block.index()).copied().flatten() {
                        *block = copy;
                    }
                });
            }
            let data = &mut self.func.blocks[copy.index()];
            (data.insts, data.terminator) = (out, terminator);
            ends[block.index()] = known;
        }
    }

    /// Adds a parameter to a block.
    fn add_param(&mut self, block: Block, ty: Type) -> Value {
        let value = Value(self.func.values.len() as u32);
        let number = self.func.block(block).params.len() as u32;
        self.func.values.push(ValueData { ty, def: ValueDef::Param(block, number) });
        self.func.blocks[block.index()].params.push(value);
        value
    }

    /// What is known at the beginning of a copied block. `before` are the blocks of the original from which
    /// control comes; `ends` says what is known at their ends. A variable of which they say different
    /// things becomes a parameter.
    fn known_at(&mut self, copy: Block, before: &[Block], ends: &[Known]) -> Known {
        let mut known: Known = vec![None; self.variables.len()];
        let is_switch = |block: &Block| {
            matches!(self.func.block(*block).terminator, Some(Terminator::Switch { .. }))
        };
        let takes_params = !before.iter().any(is_switch);
        for (number, known) in known.iter_mut().enumerate() {
            let values = before.iter().map(|block| ends[block.index()].get(number).copied()?);
            let Some(values) = values.collect::<Option<Vec<Value>>>() else { continue };
            let Some(&first) = values.first() else { continue };
            if values.iter().all(|&value| value == first) {
                *known = Some(first);
            } else if takes_params {
                let param = self.add_param(copy, Type::F64);
                let range = values.iter().map(|&value| self.floats.get(value));
                if let Some(range) = range.reduce(FloatRange::join) {
                    self.floats.set(param, range);
                }
                for (block, value) in before.iter().zip(values) {
                    self.pass(*block, copy, value);
                }
                *known = Some(param);
            }
        }
        known
    }

    /// Lets the copy of a block pass one more value to another copy.
    fn pass(&mut self, from: Block, to: Block, value: Value) {
        let Some(from) = self.blocks.get(from.index()).copied().flatten() else { return };
        let add = |call: &mut BlockCall| {
            if call.block == to {
                call.args.push(value);
            }
        };
        match &mut self.func.blocks[from.index()].terminator {
            Some(Terminator::Jump(call)) => add(call),
            Some(Terminator::Brif { cond: _, then, otherwise }) => {
                add(then);
                add(otherwise);
            }
            _ => {}
        }
    }

    /// The copy of a value.
    fn copied(&self, value: Value) -> Value {
        self.values.get(value.index()).copied().flatten().unwrap_or(value)
    }

    /// The number of the variable that an access of 8 bytes reads or writes.
    fn variable(&self, at: &Address) -> Option<usize> {
        let key = |at: &Address| (at.region.index(), at.offset);
        let fixed = at.index.is_none() && !at.volatile;
        fixed.then(|| self.variables.binary_search_by_key(&key(at), key).ok()).flatten()
    }

    /// Copies an instruction.
    fn inst(&mut self, inst: Inst, known: &mut Known, out: &mut Vec<Inst>) {
        let mut data = *self.func.inst(inst);
        data.for_each_arg_mut(|value| *value = self.copied(*value));
        let (loc, result) = (self.func.loc(inst), self.func.result(inst));
        let mut double = None;
        match data {
            InstData::Load { ty: Type::F64, at } => {
                let value = self.variable(&at).and_then(|number| known[number]);
                if let (Some(result), Some(value)) = (result, value) {
                    self.values[result.index()] = Some(value);
                    return;
                }
            }
            InstData::Load { ty: Type::I64, at } => {
                double = self.variable(&at).and_then(|number| known[number]);
            }
            InstData::Icmp { cond, args } => {
                if let Some(compared) = self.compare(cond, args, loc, out) {
                    data = compared;
                }
            }
            InstData::Store { at, value } => self.store(&at, value, loc, known, out),
            InstData::HostCall { function, args: _ } if !function.is_pure() => known.fill(None),
            _ => {}
        }
        if gains(self.func, &data) {
            self.gaining += 1;
            let mut all = true;
            data.for_each_arg(|arg| all &= self.floats.get(arg).integers().is_some());
            self.other_operands += usize::from(!all);
        }
        let new = self.append(data, loc, out);
        if let (Some(result), Some(new)) = (result, new) {
            self.values[result.index()] = Some(new);
            self.bits.extend(double.map(|double| (new, double)));
        }
    }

    /// Enters what is known of the variables behind a store.
    fn store(
        &mut self,
        at: &Address,
        value: Value,
        loc: SourceLoc,
        known: &mut Known,
        out: &mut Vec<Inst>,
    ) {
        let ty = self.func.ty(value);
        let mut written = at.extent(ty);
        if let Some(index) = at.index
            && let Some((low, high)) = self.index_bounds(index.value, MAX_STEPS)
            && low >= 0
            && high < i64::from(index.count)
        {
            let of = |number: i64| u64::from(at.offset) + number as u64 * u64::from(index.scale);
            written = of(low)..of(high) + u64::from(ty.bytes());
        }
        for (variable, known) in self.variables.iter().zip(known.iter_mut()) {
            let start = u64::from(variable.offset);
            let overlaps = start < written.end && written.start < start + SIZE;
            if variable.region == at.region && overlaps {
                *known = None;
            }
        }
        if let Some(number) = self.variable(at) {
            known[number] = match ty {
                Type::F64 => Some(value),
                Type::I64 => self.double_of(value, loc, out),
                _ => None,
            };
        }
    }

    /// The double whose bits an `i64` is, if it is known.
    fn double_of(&mut self, bits: Value, loc: SourceLoc, out: &mut Vec<Inst>) -> Option<Value> {
        match self.func.constant(bits) {
            Some(bits) => self.append(InstData::Fconst { bits: bits as u64 }, loc, out),
            None => self.bits.get(&bits).copied(),
        }
    }

    /// A comparison of the bits of variables, or of those of a variable with a constant, as one of the
    /// doubles: the order of the bits of doubles that are finite and not -0 is that of the
    /// doubles, if they are not negative; if they are, it is the reverse.
    fn compare(
        &mut self,
        cond: IntCond,
        args: [Value; 2],
        loc: SourceLoc,
        out: &mut Vec<Inst>,
    ) -> Option<InstData> {
        if !args.iter().any(|arg| self.bits.contains_key(arg)) {
            return None;
        }
        let number = args.iter().find_map(|&arg| self.func.constant(arg));
        let negative = number.map(|bits| f64::from_bits(bits as u64).is_sign_negative());
        let cond = match (cond, negative) {
            (IntCond::Eq, _) => FloatCond::Eq,
            (IntCond::Ne, _) => FloatCond::Ne,
            (IntCond::Sgt, Some(false)) | (IntCond::Ult, Some(true)) => FloatCond::Gt,
            (IntCond::Sge, Some(false)) | (IntCond::Ule, Some(true)) => FloatCond::Ge,
            (IntCond::Slt, Some(false)) | (IntCond::Ugt, Some(true)) => FloatCond::Lt,
            (IntCond::Sle, Some(false)) | (IntCond::Uge, Some(true)) => FloatCond::Le,
            _ => return None,
        };
        let is_plain = |bits: i64| f64::from_bits(bits as u64).is_finite() && bits != i64::MIN;
        if !number.is_none_or(is_plain) {
            return None;
        }
        let [a, b] = args.map(|arg| self.double_of(arg, loc, out));
        let args = [a?, b?];
        let has_order = |arg: &Value| {
            let range = self.floats.get(*arg);
            range.is_finite() && !range.may_be_minus_zero()
        };
        args.iter().all(has_order).then_some(InstData::Fcmp { cond, args })
    }

    /// The bounds of the index of an access; `None` if nothing is known. It is followed back through at
    /// most `steps` instructions.
    fn index_bounds(&self, value: Value, steps: u32) -> Option<(i64, i64)> {
        let next = |value| self.index_bounds(value, steps.checked_sub(1)?);
        match *self.func.def_inst(value)? {
            InstData::Iconst { ty: _, value } => Some((value, value)),
            InstData::HostCall { args, .. }
                if called_integer_form(self.func.def_inst(value)?) == Some(IntegerForm::Bits) =>
            {
                self.floats.get(*args.as_slice().first()?).integers()
            }
            InstData::Convert { op: ConvertOp::Trunc, to: Type::I32, arg } => {
                let within = |&(low, high): &(i64, i64)| {
                    i32::try_from(low).is_ok() && i32::try_from(high).is_ok()
                };
                next(arg).filter(within)
            }
            // An AND with all lower bits changes no number that has no others.
            InstData::Binary { op: BinaryOp::And, args: [x, by] } => {
                let most = self.func.constant(by).filter(|by| *by >= 0 && by & (by + 1) == 0)?;
                next(x).filter(|&(low, high)| low >= 0 && high <= most)
            }
            _ => None,
        }
    }
}
