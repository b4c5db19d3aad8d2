//! A function as logic: what it leaves behind on each way out of it.

use plcc_abi::TrapCode;
use plcc_ir::{Block, Func, FuncData, Label, StatementId, Terminator, Value};
use rustc_hash::{FxHashMap, FxHashSet};

use super::cuts::end_of_row;
use super::join::{add, joined};
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

/// How many operands and results functions that are not computed may have.
const MOST_OPERANDS: usize = 50_000_000;

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

/// What comes to each way out of a function.
type Exits = Vec<(Way, Vec<Place>)>;

/// Something that happens in the order of the program: its application and the condition.
#[derive(Clone, Copy, Debug)]
pub(super) struct Happening {
    pub(super) application: usize,
    pub(super) cond: Lit,
}

/// What comes to a block, or to a way out of the function.
#[derive(Clone)]
pub(super) struct Place {
    pub(super) arrival: Arrival,
    pub(super) history: Lit,
    pub(super) local: Memory,
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

    /// Whether the function is cut at a block, or at the one to which it only leads.
    pub(super) fn is_cut(&self, block: Block) -> bool {
        self.cuts.contains_key(&end_of_row(self.data, block))
    }

    /// The blocks to which control may come from a label on.
    pub(super) fn reach(&self, label: Label) -> Vec<Block> {
        let mut seen = vec![false; self.data.block_count()];
        let mut open: Vec<Block> = self.labels.get(&label).copied().into_iter().collect();
        let mut all = vec![];
        while let Some(block) = open.pop() {
            match seen.get_mut(block.index()) {
                Some(slot) if !*slot => *slot = true,
                _ => continue,
            }
            all.push(block);
            let mut next = vec![];
            match &self.data.block(block).terminator {
                Some(Terminator::Goto(label)) => next.extend(self.labels.get(label)),
                Some(Terminator::GotoIndirect(_)) => next.extend(self.labels.values()),
                Some(terminator) => terminator.for_each_block(|to, args| {
                    next.push(if args.is_empty() { end_of_row(self.data, to) } else { to });
                }),
                None => {}
            }
            open.extend(next.into_iter().filter(|to| !self.cuts.contains_key(to)));
        }
        all
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
        let mut exits: Exits = vec![];
        let mut happenings = vec![];
        let Some(&start) = self.labels.get(&label) else { return Ok((vec![], happenings)) };
        let arrival =
            Arrival { cond: TRUE, memory: memory.clone(), values: Default::default(), passed: 0 };
        let mut local = Memory::of_bytes(&[]);
        local.grow(self.data.local_bits() as usize + 64);
        let mut now: Vec<Vec<Place>> = vec![vec![]; self.data.block_count()];
        let mut next = now.clone();
        if let Some(slot) = now.get_mut(start.index()) {
            slot.push(Place { arrival, history: FALSE, local });
        }
        let mut executed = 0;
        for round in 0.. {
            for &block in &self.order {
                let places = now.get_mut(block.index()).map(std::mem::take).unwrap_or_default();
                for place in self.apart(context, block, places) {
                    if place.arrival.cond == FALSE {
                        continue;
                    }
                    executed += 1;
                    if round > ROUNDS || executed > MOST_BLOCKS {
                        let text = "goes round more often than is unrolled here";
                        return Err(self.code.reason(text, self.statement(block)));
                    }
                    self.within_limits(context, block)?;
                    let Place { arrival, mut history, mut local } = place;
                    let Some(mut state) = State::of_function(self.code, self.func, arrival) else {
                        continue;
                    };
                    let rest = (&mut history, &mut local, &mut happenings);
                    self.execute(context, block, &mut state, rest)?;
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
                                add(graph, slot, place);
                            }
                        },
                    );
                }
            }
            if next.iter().all(Vec::is_empty) {
                break;
            }
            std::mem::swap(&mut now, &mut next);
        }
        let graph = &mut context.builder.graph;
        let exit = |(way, places): (Way, Vec<Place>)| {
            // The words of the way are a value.
            let Place { arrival, history, .. } = joined(graph, places)?;
            let words = arrival.values.get(&0).cloned().unwrap_or_default();
            Some(Exit { way, cond: arrival.cond, memory: arrival.memory, history, words })
        };
        Ok((exits.into_iter().filter_map(exit).collect(), happenings))
    }

    /// Executes the instructions of a block; `rest` is what happened before, the local bits and all that happens.
    ///
    /// # Errors
    /// Where the function takes more than is looked at.
    pub(super) fn execute(
        &self,
        context: &mut Context<'_>,
        block: Block,
        state: &mut State<'c, 'm>,
        (history, local, happenings): (&mut Lit, &mut Memory, &mut Vec<Happening>),
    ) -> Result<(), Reason> {
        for &inst in &self.data.block(block).insts {
            self.within_limits(context, block)?;
            let mut step = Step { context, version: self, state, history, local, happenings };
            step.instruction(inst);
        }
        Ok(())
    }

    fn within_limits(&self, context: &Context<'_>, block: Block) -> Result<(), Reason> {
        let text = if context.builder.graph.len() > MOST_NODES || context.terms.size > MOST_OPERANDS
        {
            "makes the function take more gates than are looked at"
        } else if context.deadline.is_over() {
            "is where the time was up"
        } else {
            return Ok(());
        };
        Err(self.code.reason(text, self.statement(block)))
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
        exits: &mut Exits,
        mut go: impl FnMut(Block, Place, &mut Graph),
    ) {
        let cond = state.arrival.cond;
        let memory = &state.arrival.memory;
        let mut exit = |graph: &mut Graph, way: Way, cond: Lit, words: Vec<Lit>| {
            let values = [(0, words)].into();
            let arrival = Arrival { cond, memory: memory.clone(), values, passed: 0 };
            let new = Place { arrival, history, local: Memory::of_bytes(&[]) };
            match exits.iter_mut().find(|exit| exit.0 == way) {
                Some(old) => add(graph, &mut old.1, new),
                None => exits.push((way, vec![new])),
            }
        };
        let mut to_block =
            |context: &mut Context<'_>, taken: Lit, to: Block, args: &[Value], leaves: bool| {
                let Context { builder, terms, .. } = context;
                let graph = &mut builder.graph;
                let cond = graph.and(cond, taken);
                let cond = terms.truth(graph, cond);
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
            Some(Terminator::Jump(call)) => to_block(context, TRUE, call.block, &call.args, false),
            Some(Terminator::Brif { cond, then, otherwise }) => {
                let bit = state.bits(*cond).first().copied().unwrap_or(FALSE);
                to_block(context, bit, then.block, &then.args, false);
                to_block(context, !bit, otherwise.block, &otherwise.args, false);
            }
            Some(Terminator::Switch { arg, targets, default }) => {
                let arg = state.bits(*arg);
                for (which, &target) in targets.iter().enumerate() {
                    let this = context.builder.graph.number(arg.len(), which as i64);
                    let taken = context.builder.graph.equal(&arg, &this);
                    to_block(context, taken, target, &[], false);
                }
                let all = context.builder.graph.number(arg.len(), targets.len() as i64);
                let taken = !context.builder.graph.less_unsigned(&arg, &all);
                to_block(context, taken, *default, &[], false);
            }
            Some(Terminator::Goto(label)) => match to_label(*label) {
                Some(to) => to_block(context, TRUE, to, &[], true),
                None => exit(&mut context.builder.graph, Way::Goto(*label), cond, vec![]),
            },
            Some(Terminator::GotoIndirect(value)) => {
                let words = state.bits(*value);
                let known = number(&words).and_then(|label| u32::try_from(label).ok());
                match known.map(Label) {
                    Some(label) => match to_label(label) {
                        Some(to) => to_block(context, TRUE, to, &[], true),
                        None => exit(&mut context.builder.graph, Way::Goto(label), cond, vec![]),
                    },
                    None => exit(&mut context.builder.graph, Way::GotoIndirect, cond, words),
                }
            }
            Some(Terminator::Suspend(label)) => {
                exit(&mut context.builder.graph, Way::Suspend(*label), cond, vec![])
            }
            Some(Terminator::Return) | None => {
                exit(&mut context.builder.graph, Way::Return, cond, vec![])
            }
            Some(Terminator::Trap(code)) => {
                exit(&mut context.builder.graph, Way::Trap(*code), cond, vec![])
            }
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
                exit(&mut context.builder.graph, Way::TrapAt, cond, words);
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
