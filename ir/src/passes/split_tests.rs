//! Prepares rows of conditions on the number of a state for the pass [`thread_tests`](super::thread_tests), which
//! takes tests of a variable alone.
//!
//! Where each transition of a state machine is a condition of its own, as in `IF ((S=1)&I3) S=2 ENDIF`, the
//! branch is of an AND. If the row has at least [`MIN_TESTS`] such conditions on one variable, each comparison of the
//! variable gets a branch of its own, and what else the AND has is tested after it:
//!
//! ```text
//! block1: v0: i16 = load vars:0             block1: v0: i16 = load vars:0
//!         v1: i1 = icmp eq v0, 1                    v1: i1 = icmp eq v0, 1
//!         v2: i1 = load bits:3      ==>             brif v1, block9, block3
//!         v3: i1 = and v1, v2               block9: v2: i1 = load bits:3
//!         brif v3, block2, block3                   brif v2, block2, block3
//! ```
//!
//! So the other operands are computed only where the comparison holds; they have no effects.
//!
//! Where the contact comes first, as in `IF (I3) IF (S=1) S=2 ENDIF ENDIF`, the two branches are made one of an AND
//! before, if nothing happens between them and both lead to the same block where they fail.

use std::iter::repeat_n;

use super::cursor::Cursor;
use super::graph::Graph;
use super::switches::compared_field;
use super::thresholds::split_tests::MIN_TESTS;
use crate::InstBuilder;
use crate::tables::FastMap;
use crate::{
    Address, BinaryOp, Block, BlockCall, BlockData, Field, FloatCond, FuncData, Inst, InstData,
    IntCond, PrimaryMap, StatementId, Terminator, Type, Value,
};

/// A block with more instructions than this does not become part of the one before it.
const MAX_JOINED: usize = 16;
/// How many operands an AND may have.
const MAX_OPERANDS: usize = 12;

/// A block that ends with a branch of a comparison of a variable with a constant, alone or in an AND.
struct Condition {
    /// The address of the variable, its type, and the field of it that is compared.
    variable: (Address, Type, Field),
    /// The comparison.
    comparison: Value,
    /// The other operands of the AND; none if the branch is of the comparison alone.
    others: Vec<Value>,
    /// The instructions that compute the AND.
    ands: Vec<Inst>,
    otherwise: Block,
    /// The block that has the comparison, if the block itself tests something else before.
    inner: Option<Block>,
}

/// Splits the comparisons off the conditions of all rows; returns whether there were any.
pub(super) fn run(func: &mut FuncData) -> bool {
    let graph = Graph::new(func);
    let mut uses = uses(func);
    let condition_of =
        |block| condition(func, block, &uses).or_else(|| nested(func, &graph, block, &uses));
    let mut conditions: PrimaryMap<Block, Option<Condition>> =
        func.blocks.keys().map(condition_of).collect();
    let next_of = |conditions: &PrimaryMap<Block, Option<Condition>>, block: Block| {
        let condition = conditions[block].as_ref()?;
        let next = conditions[condition.otherwise].as_ref()?;
        (next.variable == condition.variable).then_some(condition.otherwise)
    };
    // How many conditions a row has from a block on, and then how many the row has that the block is in.
    let mut lengths = PrimaryMap::from(vec![0; func.block_count()]);
    for &block in graph.order.iter().rev() {
        if conditions[block].is_some() {
            let rest = next_of(&conditions, block).map_or(0, |next| lengths[next]);
            lengths[block] = rest + 1;
        }
    }
    for &block in &graph.order {
        if let Some(next) = next_of(&conditions, block) {
            lengths[next] = lengths[next].max(lengths[block]);
        }
    }
    let mut changed = false;
    for &block in &graph.order {
        if lengths[block] >= MIN_TESTS
            && let Some(mut condition) = conditions[block].take()
        {
            if let Some(inner) = condition.inner {
                join(func, block, inner, &mut uses);
                changed = true;
                conditions[inner] = None;
                match self::condition(func, block, &uses) {
                    Some(joined) => condition = joined,
                    None => continue,
                }
            }
            if condition.others.is_empty() {
                continue;
            }
            split(func, block, &condition, &mut uses);
            changed = true;
        }
    }
    changed
}

/// How often each value is used.
fn uses(func: &FuncData) -> PrimaryMap<Value, u32> {
    let mut uses = PrimaryMap::from(vec![0; func.value_count()]);
    for (_, data) in func.blocks() {
        for &inst in &data.insts {
            func.inst(inst).for_each_arg(|value| uses[value] += 1);
        }
        if let Some(terminator) = &data.terminator {
            terminator.for_each_arg(|value| uses[value] += 1);
        }
    }
    uses
}

/// The condition with which a block ends; `None` if it is of another form.
fn condition(func: &FuncData, block: Block, uses: &PrimaryMap<Value, u32>) -> Option<Condition> {
    let data = func.block(block);
    let Some(Terminator::Brif { cond, then, otherwise }) = &data.terminator else { return None };
    if !then.args.is_empty() || !otherwise.args.is_empty() {
        return None;
    }
    let (mut ands, mut others, mut comparison) = (vec![], vec![], None);
    let mut open = vec![*cond];
    while let Some(value) = open.pop() {
        match func.def_inst(value) {
            Some(InstData::Binary { op: BinaryOp::And, args })
                if uses[value] == 1 && func.ty(value) == Type::I1 =>
            {
                let inst = func.definition(value)?;
                if !data.insts.contains(&inst) {
                    return None;
                }
                ands.push(inst);
                open.extend([args[1], args[0]]);
            }
            _ if comparison.is_none() => match compared_variable(func, block, value) {
                Some(variable) => comparison = Some((variable, value)),
                None => others.push(value),
            },
            _ => others.push(value),
        }
        if others.len() > MAX_OPERANDS {
            return None;
        }
    }
    let (variable, comparison) = comparison?;
    Some(Condition { variable, comparison, others, ands, otherwise: otherwise.block, inner: None })
}

/// The condition of the block that a block leads to if what it tests itself holds; `None` if they can't be one.
fn nested(
    func: &FuncData,
    graph: &Graph,
    block: Block,
    uses: &PrimaryMap<Value, u32>,
) -> Option<Condition> {
    let data = func.block(block);
    let Some(Terminator::Brif { cond: _, then, otherwise }) = &data.terminator else { return None };
    let inner = then.block;
    let inside = func.block(inner);
    let is_inside = graph.sole_predecessor[inner] == Some(block)
        && then.args.is_empty()
        && otherwise.args.is_empty()
        && (inside.cold, inside.optimize_for_size) == (data.cold, data.optimize_for_size)
        && inside.insts.len() <= MAX_JOINED
        && !inside.insts.iter().any(|&inst| func.inst(inst).has_effect());
    if !is_inside {
        return None;
    }
    let condition = condition(func, inner, uses)?;
    (condition.otherwise == otherwise.block)
        .then_some(Condition { inner: Some(inner), ..condition })
}

/// Makes one block of two, whose branches become one of an AND.
fn join(func: &mut FuncData, block: Block, inner: Block, uses: &mut PrimaryMap<Value, u32>) {
    let ends = (&func.block(block).terminator, &func.block(inner).terminator);
    let (Some(Terminator::Brif { cond: first, .. }), Some(Terminator::Brif { cond, then, .. })) =
        ends
    else {
        return;
    };
    let (args, then) = ([*cond, *first], then.clone());
    let loc = func.definition(*cond).map_or(StatementId::NONE, |inst| func.loc(inst));
    let (and, both) = func.append(InstData::Binary { op: BinaryOp::And, args }, loc);
    // The result is used by the branch alone.
    uses.extend(repeat_n(1, func.value_count() - uses.len()));
    let left = BlockData { terminator: Some(Terminator::Return), ..BlockData::default() };
    let insts = std::mem::replace(&mut func.blocks[inner], left).insts;
    let data = &mut func.blocks[block];
    data.insts.extend(insts);
    data.insts.push(and);
    if let Some(Terminator::Brif { cond, then: to, .. }) = &mut data.terminator {
        *to = then;
        *cond = both;
    }
}

/// The variable that a value compares with a constant for equality, if it still holds at the end of the block what
/// was loaded.
fn compared_variable(
    func: &FuncData,
    block: Block,
    value: Value,
) -> Option<(Address, Type, Field)> {
    let (InstData::Icmp { cond: IntCond::Eq, args } | InstData::Fcmp { cond: FloatCond::Eq, args }) =
        func.def_inst(value)?
    else {
        return None;
    };
    let (loaded, field, _) = compared_field(func, args[0], func.constant(args[1])?);
    let InstData::Load { ty, at } = *func.def_inst(loaded)? else { return None };
    let definition = func.definition(loaded)?;
    let mut after = func.block(block).insts.iter().rev();
    let is_unchanged = after.find(|&&inst| func.inst(inst).has_effect() || inst == definition)
        == Some(&definition);
    (at.index.is_none() && !at.volatile && is_unchanged).then_some((at, ty, field))
}

/// Splits the comparison off the AND with which a block ends.
fn split(
    func: &mut FuncData,
    block: Block,
    condition: &Condition,
    uses: &mut PrimaryMap<Value, u32>,
) {
    let data = &mut func.blocks[block];
    let mut insts = std::mem::take(&mut data.insts);
    let (cold, optimize_for_size) = (data.cold, data.optimize_for_size);
    let Some(Terminator::Brif { cond, then, otherwise }) = data.terminator.take() else { return };
    let loc = func.definition(cond).map_or(StatementId::NONE, |inst| func.loc(inst));

    // The instructions that nothing but the other operands needs go to the new block, as far as no effect comes
    // after them. What only the comparison needed is dropped: it is computed again, for itself.
    uses[condition.comparison] -= 1;
    let mut uses_there: FastMap<Value, u32> = FastMap::default();
    for &other in &condition.others {
        *uses_there.entry(other).or_default() += 1;
    }
    let mut there = vec![];
    let mut here = vec![];
    while let Some(inst) = insts.pop() {
        if condition.ands.contains(&inst) {
            continue;
        }
        if func.inst(inst).has_effect() {
            insts.push(inst);
            break;
        }
        let result = func.result(inst);
        let count = result.map_or(0, |result| uses[result]);
        if count == 0 {
            func.inst(inst).for_each_arg(|value| uses[value] -= 1);
        } else if result.and_then(|result| uses_there.get(&result)) == Some(&count) {
            func.inst(inst).for_each_arg(|value| *uses_there.entry(value).or_default() += 1);
            there.push(inst);
        } else {
            here.push(inst);
        }
    }
    there.reverse();
    insts.extend(here.into_iter().rev());
    let comparison = copy(func, condition.comparison, &mut insts);
    let mut all = condition.others.first().copied().unwrap_or(comparison);
    for &other in condition.others.iter().skip(1) {
        all = Cursor { func, out: &mut there, loc }.binary(BinaryOp::And, all, other);
    }
    let terminator = Terminator::Brif { cond: all, then, otherwise: otherwise.clone() };
    let second = func.blocks.push(BlockData {
        params: vec![],
        insts: there,
        cold,
        optimize_for_size,
        terminator: Some(terminator),
    });
    let data = &mut func.blocks[block];
    data.insts = insts;
    data.terminator =
        Some(Terminator::Brif { cond: comparison, then: BlockCall::plain(second), otherwise });
    uses.extend(repeat_n(1, func.value_count() - uses.len()));
}

/// Computes a comparison of a variable with a constant once more at the end of `insts`.
fn copy(func: &mut FuncData, value: Value, insts: &mut Vec<Inst>) -> Value {
    let Some(definition) = func.definition(value) else { return value };
    let mut data = *func.inst(definition);
    data.for_each_arg_mut(|operand| *operand = copy(func, *operand, insts));
    let loc = func.loc(definition);
    Cursor { func, out: insts, loc }.build(data)
}
