//! A function as logic: what it leaves behind on each way out of it.

use plcc_abi::TrapCode;
use plcc_ir::{Block, Func, FuncData, Label, StatementId, Terminator, Value};
use rustc_hash::{FxHashMap, FxHashSet};

use super::cuts::end_of_row;
use super::step::Step;
use super::terms::Terms;
use super::universe::Universe;
use crate::logic::{FALSE, Graph, Lit, Memory, TRUE};
use crate::scan::instruction::{State, number};
use crate::scan::{Arrival, Builder, Code, Reason};

/// How often a way that goes round is unrolled.
const ROUNDS: usize = 80;

/// How many blocks are executed at most.
const MOST_BLOCKS: usize = 20_000;

/// How large the graph of a function may become.
const MOST_NODES: usize = 3_000_000;

/// How a function is left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    Goto(Label),
    GotoIndirect,
    Suspend(Label),
    Return,
    Trap(TrapCode),
    TrapAt,
}

/// What a function leaves behind on a way out of it.
#[derive(Clone, Debug)]
pub(super) struct Exit {
    pub(super) way: Way,
    pub(super) cond: Lit,
    pub(super) memory: Memory,
    /// What happened in the order of the program, as a bit that depends on all of it.
    pub(super) history: Lit,
    /// What the way itself needs: a label's number, or a trap site and an index.
    pub(super) words: Vec<Lit>,
}

/// Something that happens in the order of the program: its application and the condition.
#[derive(Clone, Copy, Debug)]
pub(super) struct Happening {
    pub(super) application: usize,
    pub(super) cond: Lit,
}

/// What comes to a block.
#[derive(Clone)]
struct Place {
    arrival: Arrival,
    history: Lit,
    local: Memory,
}

/// What two versions of a function have in common.
pub(super) struct Context<'u> {
    pub(super) builder: Builder,
    pub(super) terms: Terms,
    pub(super) universe: &'u Universe,
    pub(super) deadline: crate::solve::Deadline,
}

/// A version of a function.
pub(super) struct Version<'c, 'm> {
    pub(super) code: &'c Code<'m>,
    pub(super) func: Func,
    pub(super) data: &'m FuncData,
    order: Vec<Block>,
    rank: Vec<usize>,
    /// The blocks at which it is cut, with the labels at them.
    cuts: FxHashMap<Block, Label>,
    labels: FxHashMap<Label, Block>,
}

impl<'c, 'm> Version<'c, 'm> {
    /// A function of some code that is cut at labels; `first` gives the one that stands for a label.
    pub(super) fn new(
        code: &'c Code<'m>,
        func: Func,
        first: &FxHashMap<Label, Label>,
        cut_at: &FxHashSet<Label>,
    ) -> Option<Self> {
        let data = code.module.funcs.get(func.index())?;
        let mut cuts: FxHashMap<Block, Label> = FxHashMap::default();
        let mut labels = FxHashMap::default();
        for &(label, block) in data.entries() {
            let block = end_of_row(data, block);
            labels.insert(label, block);
            let first = first.get(&label).copied().unwrap_or(label);
            if cut_at.contains(&first) {
                let slot = cuts.entry(block).or_insert(first);
                *slot = (*slot).min(first);
            }
        }
        let order = order(data);
        let mut rank = vec![usize::MAX; data.block_count()];
        for (at, block) in order.iter().enumerate() {
            if let Some(slot) = rank.get_mut(block.index()) {
                *slot = at;
            }
        }
        Some(Self { code, func, data, order, rank, cuts, labels })
    }

    /// What the function does from a label on.
    ///
    /// # Errors
    /// Where it can't be followed.
    pub(super) fn walk(
        &self,
        context: &mut Context<'_>,
        label: Label,
        memory: &Memory,
    ) -> Result<(Vec<Exit>, Vec<Happening>), Reason> {
        let mut exits = vec![];
        let mut happenings = vec![];
        let Some(&start) = self.labels.get(&label) else { return Ok((exits, happenings)) };
        let arrival =
            Arrival { cond: TRUE, memory: memory.clone(), values: Default::default(), passed: 0 };
        let mut local = Memory::of_bytes(&[]);
        local.grow(self.data.local_bits() as usize + 64);
        let mut now: Vec<Option<Place>> = vec![None; self.data.block_count()];
        let mut next = now.clone();
        if let Some(slot) = now.get_mut(start.index()) {
            *slot = Some(Place { arrival, history: FALSE, local });
        }
        let mut executed = 0;
        for round in 0.. {
            for &block in &self.order {
                let Some(place) = now.get_mut(block.index()).and_then(Option::take) else {
                    continue;
                };
                if place.arrival.cond == FALSE {
                    continue;
                }
                executed += 1;
                let text = if round > ROUNDS || executed > MOST_BLOCKS {
                    Some("goes round more often than is unrolled here")
                } else if context.builder.graph.len() > MOST_NODES {
                    Some("makes the function take more gates than are looked at")
                } else if context.deadline.is_over() {
                    Some("is where the time was up")
                } else {
                    None
                };
                if let Some(text) = text {
                    return Err(self.code.reason(text, self.statement(block)));
                }
                let Place { arrival, mut history, mut local } = place;
                let Some(mut state) = State::of_function(self.code, self.func, arrival) else {
                    continue;
                };
                for &inst in &self.data.block(block).insts {
                    let mut step = Step {
                        context: &mut *context,
                        version: self,
                        state: &mut state,
                        history: &mut history,
                        local: &mut local,
                        happenings: &mut happenings,
                    };
                    step.instruction(inst);
                }
                self.leave(
                    context,
                    &state,
                    block,
                    history,
                    &local,
                    &mut exits,
                    |to, place, graph| {
                        let is_back = self.rank.get(to.index()) <= self.rank.get(block.index());
                        let slots = if is_back { &mut next } else { &mut now };
                        if let Some(slot) = slots.get_mut(to.index()) {
                            join(graph, slot, place);
                        }
                    },
                );
            }
            if next.iter().all(Option::is_none) {
                break;
            }
            std::mem::swap(&mut now, &mut next);
        }
        Ok((exits, happenings))
    }

    fn statement(&self, block: Block) -> StatementId {
        let locs = self.data.block(block).insts.iter().rev().map(|&inst| self.data.loc(inst));
        let mut known = locs.filter(|&loc| loc != StatementId::NONE);
        known.next().unwrap_or(StatementId::NONE)
    }

    /// What happens at the end of a block.
    #[expect(clippy::too_many_arguments, reason = "the parts of a block's state")]
    fn leave(
        &self,
        context: &mut Context<'_>,
        state: &State<'_, '_>,
        block: Block,
        history: Lit,
        local: &Memory,
        exits: &mut Vec<Exit>,
        mut go: impl FnMut(Block, Place, &mut Graph),
    ) {
        let graph = &mut context.builder.graph;
        let cond = state.arrival.cond;
        let memory = &state.arrival.memory;
        let mut exit = |graph: &mut Graph, way: Way, cond: Lit, words: Vec<Lit>| {
            let new = Exit { way, cond, memory: memory.clone(), history, words };
            match exits.iter_mut().find(|exit| exit.way == way) {
                Some(old) => join_exit(graph, old, &new),
                None => exits.push(new),
            }
        };
        let mut to_block =
            |graph: &mut Graph, taken: Lit, to: Block, args: &[Value], leaves: bool| {
                let cond = graph.and(cond, taken);
                if cond == FALSE {
                    return;
                }
                let to = if args.is_empty() { end_of_row(self.data, to) } else { to };
                if let Some(&label) = self.cuts.get(&to) {
                    exit(graph, Way::Goto(label), cond, vec![]);
                    return;
                }
                let mut values = state.arrival.values.clone();
                if leaves {
                    values.clear();
                }
                for (&param, &arg) in self.data.block(to).params.iter().zip(args) {
                    values.insert(param.0, state.bits(arg));
                }
                let arrival = Arrival { cond, memory: memory.clone(), values, passed: 0 };
                go(to, Place { arrival, history, local: local.clone() }, graph);
            };
        let to_label = |label: Label| self.labels.get(&label).copied();
        match &self.data.block(block).terminator {
            Some(Terminator::Jump(call)) => to_block(graph, TRUE, call.block, &call.args, false),
            Some(Terminator::Brif { cond, then, otherwise }) => {
                let bit = state.bits(*cond).first().copied().unwrap_or(FALSE);
                to_block(graph, bit, then.block, &then.args, false);
                to_block(graph, !bit, otherwise.block, &otherwise.args, false);
            }
            Some(Terminator::Switch { arg, targets, default }) => {
                let arg = state.bits(*arg);
                for (which, &target) in targets.iter().enumerate() {
                    let this = graph.number(arg.len(), which as i64);
                    let taken = graph.equal(&arg, &this);
                    to_block(graph, taken, target, &[], false);
                }
                let all = graph.number(arg.len(), targets.len() as i64);
                let taken = !graph.less_unsigned(&arg, &all);
                to_block(graph, taken, *default, &[], false);
            }
            Some(Terminator::Goto(label)) => match to_label(*label) {
                Some(to) => to_block(graph, TRUE, to, &[], true),
                None => exit(graph, Way::Goto(*label), cond, vec![]),
            },
            Some(Terminator::GotoIndirect(value)) => {
                let words = state.bits(*value);
                let known = number(&words).and_then(|label| u32::try_from(label).ok());
                match known.map(Label) {
                    Some(label) => match to_label(label) {
                        Some(to) => to_block(graph, TRUE, to, &[], true),
                        None => exit(graph, Way::Goto(label), cond, vec![]),
                    },
                    None => exit(graph, Way::GotoIndirect, cond, words),
                }
            }
            Some(Terminator::Suspend(label)) => exit(graph, Way::Suspend(*label), cond, vec![]),
            Some(Terminator::Return) | None => exit(graph, Way::Return, cond, vec![]),
            Some(Terminator::Trap(code)) => exit(graph, Way::Trap(*code), cond, vec![]),
            Some(Terminator::TrapAt { site, index }) => {
                // Of the index 16 bits count, and none where the site has no array.
                let site = state.bits(*site);
                let known = number(&site).and_then(|site| usize::try_from(site).ok());
                let known = known.and_then(|site| self.code.module.trap_sites.get(site));
                let mut words = site;
                match known {
                    Some(site) if site.array.is_none() => words.extend([FALSE; 16]),
                    _ => words.extend(state.bits(*index).into_iter().take(16)),
                }
                exit(graph, Way::TrapAt, cond, words);
            }
        }
    }
}

/// The blocks of a function, each before those to which it goes but where that goes round.
fn order(data: &FuncData) -> Vec<Block> {
    let mut seen = vec![false; data.block_count()];
    let mut order = vec![];
    let starts: Vec<Block> = data.entries().iter().map(|&(_, block)| block).rev().collect();
    for start in starts {
        if std::mem::replace(seen.get_mut(start.index()).unwrap_or(&mut true), true) {
            continue;
        }
        let mut open = vec![(start, 0)];
        while let Some((block, which)) = open.last_mut() {
            let (at, number) = (*block, *which);
            *which += 1;
            let successor = data.block(at).terminator.as_ref().and_then(|it| it.successor(number));
            let Some(to) = successor else {
                order.push(at);
                open.pop();
                continue;
            };
            if let Some(slot) = seen.get_mut(to.index()).filter(|slot| !**slot) {
                *slot = true;
                open.push((to, 0));
            }
        }
    }
    order.reverse();
    order
}

/// The factors of a conjunction.
fn factors(graph: &Graph, lit: Lit) -> Vec<Lit> {
    use crate::logic::Node;
    let (mut open, mut all) = (vec![lit], vec![]);
    while let Some(lit) = open.pop() {
        match graph.node(lit.node()) {
            Node::And(a, b) if !lit.is_complement() && all.len() + open.len() < 64 => {
                open.extend([a, b]);
            }
            _ => all.push(lit),
        }
    }
    all.sort_unstable();
    all.dedup();
    all
}

/// Which of two conditions holds, of which at most one does, and whether one does. Factors that both have decide nothing.
fn which(graph: &mut Graph, a: Lit, b: Lit) -> (Lit, Lit) {
    let (of_a, of_b) = (factors(graph, a), factors(graph, b));
    let common: Vec<Lit> =
        of_a.iter().copied().filter(|lit| of_b.binary_search(lit).is_ok()).collect();
    let own = |all: &[Lit], graph: &mut Graph| {
        let rest = all.iter().copied().filter(|lit| common.binary_search(lit).is_err());
        graph.all(rest.collect::<Vec<_>>())
    };
    let (only_a, only_b) = (own(&of_a, graph), own(&of_b, graph));
    let either = graph.or(only_a, only_b);
    let common = graph.all(common.iter().copied());
    // The shorter of the two says it.
    let short = match graph.node(only_b.node()) {
        crate::logic::Node::And(..) => only_a,
        _ => !only_b,
    };
    (short, graph.and(common, either))
}

/// Adds what comes to a block to what came before. Only one of the two can come about.
fn join(graph: &mut Graph, slot: &mut Option<Place>, new: Place) {
    let Some(old) = slot else {
        *slot = Some(new);
        return;
    };
    let (first, either) = which(graph, old.arrival.cond, new.arrival.cond);
    old.arrival.memory.choose(graph, first, &new.arrival.memory);
    old.local.choose(graph, first, &new.local);
    old.history = graph.choose(first, old.history, new.history);
    for (value, bits) in new.arrival.values {
        let both = match old.arrival.values.get(&value) {
            Some(before) => graph.choose_bits(first, before, &bits),
            None => bits,
        };
        old.arrival.values.insert(value, both);
    }
    old.arrival.cond = either;
}

fn join_exit(graph: &mut Graph, old: &mut Exit, new: &Exit) {
    let (first, either) = which(graph, old.cond, new.cond);
    old.memory.choose(graph, first, &new.memory);
    old.history = graph.choose(first, old.history, new.history);
    old.words = graph.choose_bits(first, &old.words, &new.words);
    old.cond = either;
}
