//! Speculates that the variables of a function hold integers: checks each of them once where the function is
//! entered.
//!
//! ```text
//!                                         block9 (L0):
//!                                             v10: f64 = load p:0       the integrality check of P0;
//! block0 (L0):                                v11: i32 = ftoi v10       a block for each variable
//!     P1=P0&7                                 v13: i1 = is_integer_or_nan v10
//!     P2=P0&56                   ==>          v12: f64 = itof v11
//!     P0=P1|P2                                brif v13, block10, block0
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
//! after a store to a computed place, it loads the variable again, and `speculate` checks it there.
//!
//! The function must have a single entry, no loop, and no call of a host function that is not pure outside of
//! cold blocks. The number of loads that need no check any more must be at least
//! [`LOADS_PER_VARIABLE`] times that of the variables, and nearly all operations of the copy must get integers.

mod copy;
mod guard;
mod operations;

use copy::Copy;
use guard::{GuardBlock, add_guard};
use operations::{is_faster_on_integers, keeps_integers};

use super::float_range::FloatRanges;
use super::graph::Graph;
use super::thresholds::speculate_variables::{GAINING_PER_OTHER, LOADS_PER_VARIABLE, MIN_LOADS};
use super::value_range::ValueRanges;
use crate::tables::FastMap;
use crate::{Address, Block, FuncData, Inst, InstData, PrimaryMap, RegionId, StatementId};

/// No more variables than this are checked.
const MAX_VARIABLES: usize = 64;

/// Runs the pass; returns whether it changed anything. `finite_regions` are those of the module.
pub(super) fn run(func: &mut FuncData, finite_regions: &[RegionId]) -> bool {
    let &[(label, entry)] = func.entries() else { return false };
    let graph = Graph::new(func);
    let floats = FloatRanges::new(func, finite_regions);
    let variables = variables_to_check(func, &graph, &floats);
    if variables.is_empty() || !is_suitable(func, &graph, entry) {
        return false;
    }
    let loc = func.block(entry).insts.first().map_or(StatementId::NONE, |&inst| func.loc(inst));
    let mut copy = Copy {
        integers: ValueRanges::new(func),
        floats,
        values: vec![None; func.value_count()].into(),
        blocks: vec![None; func.block_count()].into(),
        variables,
        bits: FastMap::default(),
        gaining: 0,
        other_operands: 0,
        out: vec![],
        loc,
        func,
    };
    let variables = copy.variables.clone();
    let checks: Vec<GuardBlock> = variables.into_iter().map(|at| copy.check(at, loc)).collect();
    let count = copy.func.block_count();
    copy.blocks(&graph, entry, &checks);
    let (gaining, others) = (copy.gaining, copy.other_operands);
    let fast = copy.blocks[entry];
    let Some(fast) = fast.filter(|_| others * GAINING_PER_OTHER <= gaining) else {
        let mut blocks = Vec::from(std::mem::take(&mut func.blocks));
        blocks.truncate(count);
        func.blocks = blocks.into();
        return false;
    };
    let guard = add_guard(func, checks, entry, fast);
    func.entries = vec![(label, guard)];
    for &block in &graph.order {
        func.blocks[block].cold = true;
    }
    true
}

/// Whether a function has the form that the pass can copy.
fn is_suitable(func: &FuncData, graph: &Graph, entry: Block) -> bool {
    let mut places = PrimaryMap::from(vec![0; func.block_count()]);
    for (place, &block) in graph.order.iter().enumerate() {
        places[block] = place;
    }
    let is_suitable = |&block: &Block| {
        let data = func.block(block);
        let mut goes_on = true;
        if let Some(terminator) = &data.terminator {
            let place = places[block];
            terminator.for_each_block(|next, _| goes_on &= places[next] > place);
        }
        let calls_host = |&inst: &Inst| match func.inst(inst) {
            InstData::HostCall { function, args: _ } => !function.is_pure(),
            _ => false,
        };
        goes_on && !data.optimize_for_size && (data.cold || !data.insts.iter().any(calls_host))
    };
    graph.edges[entry] == 1 && graph.order.iter().all(is_suitable)
}

/// The variables that are worth being checked, in the order of their addresses; none if it does not pay.
fn variables_to_check(func: &FuncData, graph: &Graph, floats: &FloatRanges<'_>) -> Vec<Address> {
    let mut needed = PrimaryMap::from(vec![false; func.value_count()]);
    let mut counts: FastMap<(RegionId, u32), usize> = FastMap::default();
    // How many operations are faster on integers, and how many of their operands come from something other than
    // variables.
    let (mut gaining, mut others) = (0, 0);
    for &block in graph.order.iter().rev().filter(|block| !func.block(**block).cold) {
        for &inst in func.block(block).insts.iter().rev() {
            let data = func.inst(inst);
            let is_needed = func.result(inst).is_some_and(|value| needed[value]);
            match *data {
                InstData::Load { ty: _, at } if is_needed && is_variable(floats, data) => {
                    *counts.entry((at.region, at.offset)).or_default() += 1;
                }
                _ if is_faster_on_integers(func, data)
                    || is_needed && keeps_integers(func, data) =>
                {
                    gaining += usize::from(is_faster_on_integers(func, data));
                    data.for_each_arg(|value| needed[value] = true);
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
    if !pays || others * GAINING_PER_OTHER > gaining {
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
