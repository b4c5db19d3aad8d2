//! One scan of a task as logic: the IR, executed with literals in the place of bits.
//!
//! The blocks on all ways through the task are executed once each, after all that lead to them. What a block finds, memory and
//! values, is chosen from what its predecessors left by the conditions on which control comes from them. A way that goes
//! round is unrolled until its condition is known to be false, up to a limit. What can't be taken is a free input of the graph,
//! with the line that brought it in, so that everything that the program can do stays possible.

pub(crate) mod functions;
pub(crate) mod instruction;
mod paths;
mod tables;

use std::collections::BTreeMap;
use std::rc::Rc;

use plcc_frontend::common::ReturnStack;
use plcc_ir::{Block, Func, FuncData, Module, StatementId, Terminator, Value};
use rustc_hash::FxHashMap;

use crate::control::Pmac;
use crate::logic::{FALSE, Graph, Lit, Memory, TRUE, Tables};

pub(crate) use functions::range as pmac_range;
pub(crate) use instruction::{MOST_ELEMENTS, number};
pub use paths::Paths;

/// How often a way that goes round is unrolled.
const ROUNDS: u32 = 2_000;

/// How many blocks are executed at most.
const MOST_BLOCKS: usize = 400_000;

/// How large the graph of a scan may become.
const MOST_NODES: usize = 40_000_000;

/// Why something was not taken as it is: a sentence, and the line of the source that it is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reason {
    /// The sentence.
    pub text: String,
    /// File and line.
    pub place: Option<(String, u32)>,
}

/// A graph that is being built, with what of it is not known.
#[derive(Clone, Debug, Default)]
pub struct Builder {
    /// The graph.
    pub graph: Graph,
    /// Inputs that stand for results that are not computed, by their nodes: numbers of reasons.
    pub unknown: FxHashMap<u32, u32>,
    /// The reasons.
    pub reasons: Vec<Reason>,
    /// Conditions on which the program does what the logic does not follow, with the numbers of their reasons.
    pub escapes: Vec<(Lit, u32)>,
    /// What a PMAC does where its programs ask it for something.
    pub(crate) pmac: Option<Rc<Pmac>>,
    /// Numbers about which a few literals decide.
    pub(crate) tables: Tables,
    /// Results of operations that are not computed, so that equal operands give equal results.
    known: FxHashMap<(String, Vec<Lit>), Vec<Lit>>,
}

impl Builder {
    /// The number of a reason.
    pub fn reason(&mut self, reason: Reason) -> u32 {
        let known = self.reasons.iter().position(|known| *known == reason);
        known.unwrap_or_else(|| {
            self.reasons.push(reason);
            self.reasons.len() - 1
        }) as u32
    }

    /// Bits of which nothing is known.
    pub fn unknown(&mut self, width: usize, reason: Reason) -> Vec<Lit> {
        let reason = self.reason(reason);
        let bits = self.graph.inputs(width);
        self.unknown.extend(bits.iter().map(|bit| (bit.node(), reason)));
        bits
    }

    /// The result of an operation that is not computed, of which equal operands are known to give equal results.
    pub fn function(
        &mut self,
        name: String,
        operands: Vec<Lit>,
        width: usize,
        reason: Reason,
    ) -> Vec<Lit> {
        let key = (name, operands);
        if let Some(known) = self.known.get(&key) {
            return known.clone();
        }
        let bits = self.unknown(width, reason);
        self.known.insert(key, bits.clone());
        bits
    }
}

/// How a scan ends.
#[derive(Clone, Debug)]
pub struct Ends {
    /// The condition on which it ends in the ordinary way, and the image then.
    pub end: Option<(Lit, Memory)>,
    /// The condition on which the program is stopped, and the image then.
    pub trap: Option<(Lit, Memory)>,
}

/// What comes to a block.
#[derive(Clone)]
pub(crate) struct Arrival {
    pub(crate) cond: Lit,
    pub(crate) memory: Memory,
    pub(crate) values: BTreeMap<u32, Vec<Lit>>,
    /// How many safepoints were passed at most.
    pub(crate) passed: u32,
}

/// What comes to a block on some ways, of which only one can come about.
#[derive(Clone)]
struct Coming {
    /// All but the condition.
    arrival: Arrival,
    /// The conditions of the ways.
    conds: Vec<Lit>,
}

impl Coming {
    /// What comes to the block on any of the ways.
    fn arrival(self, graph: &mut Graph) -> Arrival {
        Arrival { cond: either(graph, self.conds), ..self.arrival }
    }
}

/// Adds an arrival to those before.
fn join(graph: &mut Graph, slot: &mut Option<Coming>, new: Arrival) {
    let Some(Coming { arrival: old, conds }) = slot else {
        *slot = Some(Coming { conds: vec![new.cond], arrival: new });
        return;
    };
    let mut memory = new.memory;
    memory.choose(graph, new.cond, &old.memory);
    old.memory = memory;
    for (value, bits) in new.values {
        let both = match old.values.get(&value) {
            Some(before) => graph.choose_bits(new.cond, &bits, before),
            None => bits,
        };
        old.values.insert(value, both);
    }
    old.passed = old.passed.max(new.passed);
    conds.push(new.cond);
}

/// The most ways of which pairs are looked for.
const MOST_WAYS: usize = 64;

/// Whether control comes on one of some ways. What a condition has divided is put together again, so that what follows does not depend on it.
fn either(graph: &mut Graph, mut conds: Vec<Lit>) -> Lit {
    let mut is_new = conds.len() > 1 && conds.len() <= MOST_WAYS;
    while std::mem::take(&mut is_new) {
        let mut rest: Vec<Lit> = vec![];
        // What was divided last comes together first.
        while let Some(one) = conds.pop() {
            match conds.iter().rposition(|&other| graph.divided(one, other)) {
                Some(at) => {
                    let other = conds.remove(at);
                    conds.push(graph.or(one, other));
                    is_new = true;
                }
                None => rest.push(one),
            }
        }
        rest.reverse();
        conds = rest;
    }
    graph.any(conds)
}

fn join_end(graph: &mut Graph, slot: &mut Option<(Lit, Memory)>, cond: Lit, memory: Memory) {
    match slot {
        None => *slot = Some((cond, memory)),
        Some((before, kept)) => {
            kept.choose(graph, *before, &memory);
            *before = graph.or(*before, cond);
        }
    }
}

/// The code of a program, with what is known of its ways.
#[derive(Debug)]
pub struct Code<'m> {
    pub(crate) module: &'m Module,
    paths: Paths,
    /// For each function which of its values are used in other blocks than their own.
    crossing: Vec<Vec<bool>>,
}

impl<'m> Code<'m> {
    /// The code of a module whose subroutines keep their return labels in `returns`.
    pub fn new(module: &'m Module, returns: Option<ReturnStack>) -> Self {
        let crossing = module.funcs.iter().map(crossing).collect();
        Self { module, paths: Paths::new(module, returns), crossing }
    }

    /// The code of a module whose functions are followed each by itself: what the control keeps about subroutines is memory as
    /// any other.
    pub(crate) fn of_functions(module: &'m Module) -> Self {
        let crossing = module.funcs.iter().map(crossing).collect();
        Self { module, paths: Paths::default(), crossing }
    }

    /// Which values of a function are used in other blocks than their own.
    pub(crate) fn crossing(&self, func: Func) -> &[bool] {
        self.crossing.get(func.index()).map_or(&[], Vec::as_slice)
    }

    /// The blocks of tasks, each once.
    pub(crate) fn blocks(&self, tasks: impl Iterator<Item = usize>) -> Vec<(Func, Block)> {
        let mut all = vec![];
        for task in tasks {
            let paths = self.paths.of_task(self.module, task);
            all.extend(paths.nodes.iter().map(|node| (node.func, node.block)));
        }
        all.sort_unstable();
        all.dedup();
        all
    }

    pub(crate) fn place(&self, loc: StatementId) -> Option<(String, u32)> {
        let line = self.module.line(loc)?;
        let file = self.module.files.get(line.file as usize)?;
        Some((file.name.clone(), line.line))
    }

    pub(crate) fn reason(&self, text: &str, loc: StatementId) -> Reason {
        Reason { text: text.to_owned(), place: self.place(loc) }
    }

    /// The scan of a task that begins at its entry, on the condition `cond`. It may pass `fuel` safepoints.
    pub fn scan(
        &self,
        builder: &mut Builder,
        task: usize,
        cond: Lit,
        memory: &Memory,
        fuel: u32,
    ) -> Ends {
        self.scan_from(builder, task, &[cond], memory, fuel)
    }

    /// The scan of a task that begins at its entry on the first of the conditions, and goes on at its resume points on the
    /// others. Only one of them holds.
    pub fn scan_from(
        &self,
        builder: &mut Builder,
        task: usize,
        conds: &[Lit],
        memory: &Memory,
        fuel: u32,
    ) -> Ends {
        let mut ends = Ends { end: None, trap: None };
        let graph = self.paths.of_task(self.module, task);
        let mut now: Vec<Option<Coming>> = vec![None; graph.nodes.len()];
        let mut next = now.clone();
        for (at, &cond) in conds.iter().enumerate().filter(|(_, cond)| **cond != FALSE) {
            let memory = memory.clone();
            let arrival = Arrival { cond, memory, values: BTreeMap::new(), passed: 0 };
            match graph.starts.get(at).copied().flatten().and_then(|start| now.get_mut(start)) {
                Some(slot) => join(&mut builder.graph, slot, arrival),
                None => join_end(&mut builder.graph, &mut ends.end, cond, arrival.memory),
            }
        }
        let mut executed = 0;
        for round in 0.. {
            for &index in &graph.order {
                let Some(coming) = now.get_mut(index).and_then(Option::take) else { continue };
                let arrival = coming.arrival(&mut builder.graph);
                if arrival.cond == FALSE {
                    continue;
                }
                let Some(node) = graph.nodes.get(index) else { continue };
                executed += 1;
                let loc = paths::statement(self.module, node);
                let is_much =
                    executed > MOST_BLOCKS || builder.graph.len() > MOST_NODES || round > ROUNDS;
                if is_much || arrival.passed >= fuel {
                    let text = if is_much {
                        "goes round more often than is unrolled here"
                    } else {
                        "may take longer than the control gives it in a scan"
                    };
                    let reason = builder.reason(self.reason(text, loc));
                    builder.escapes.push((arrival.cond, reason));
                    join_end(&mut builder.graph, &mut ends.end, arrival.cond, arrival.memory);
                    continue;
                }
                let Some(func) = self.module.funcs.get(node.func.index()) else { continue };
                let mut state = instruction::State {
                    code: self,
                    func,
                    crossing: self.crossing(node.func),
                    arrival,
                    local: FxHashMap::default(),
                    control: node.control.clone(),
                };
                for &inst in &func.block(node.block).insts {
                    state.instruction(builder, inst);
                }
                self.leave(
                    builder,
                    task,
                    state,
                    node,
                    &mut ends,
                    &mut |to, is_back, arrival, graph| {
                        let slots = if is_back { &mut next } else { &mut now };
                        if let Some(slot) = slots.get_mut(to) {
                            join(graph, slot, arrival);
                        }
                    },
                );
            }
            if next.iter().all(Option::is_none) {
                break;
            }
            std::mem::swap(&mut now, &mut next);
        }
        ends
    }

    /// What happens at the end of a block.
    fn leave(
        &self,
        builder: &mut Builder,
        task: usize,
        state: instruction::State<'_, '_>,
        node: &paths::PathNode,
        ends: &mut Ends,
        go: &mut dyn FnMut(usize, bool, Arrival, &mut Graph),
    ) {
        let func = state.func;
        let terminator = func.block(node.block).terminator.as_ref();
        let cond = state.arrival.cond;
        match terminator {
            Some(Terminator::Return) | None => {
                join_end(&mut builder.graph, &mut ends.end, cond, state.arrival.memory);
            }
            Some(Terminator::Trap(_) | Terminator::TrapAt { .. }) => {
                join_end(&mut builder.graph, &mut ends.trap, cond, state.arrival.memory);
            }
            Some(Terminator::Suspend(label)) => {
                let mut memory = state.arrival.memory;
                if let Some(pmac) = builder.pmac.clone()
                    && let Some(task_data) = self.module.tasks.get(task)
                    && let Some(point) =
                        task_data.resume_points.iter().position(|it| *it == label.0)
                {
                    pmac.suspend(&builder.graph, &mut memory, task, point);
                    join_end(&mut builder.graph, &mut ends.end, cond, memory);
                    return;
                }
                let loc = paths::statement(self.module, node);
                let text = "waits here until a later scan";
                let reason = builder.reason(self.reason(text, loc));
                builder.escapes.push((cond, reason));
                join_end(&mut builder.graph, &mut ends.end, cond, memory);
            }
            Some(
                terminator @ (Terminator::Jump(_)
                | Terminator::Brif { .. }
                | Terminator::Switch { .. }
                | Terminator::Goto(_)
                | Terminator::GotoIndirect(_)),
            ) => {
                if node.is_lost {
                    let loc = paths::statement(self.module, node);
                    let text = "goes on at a place that is not known beforehand";
                    let reason = builder.reason(self.reason(text, loc));
                    builder.escapes.push((cond, reason));
                    join_end(&mut builder.graph, &mut ends.end, cond, state.arrival.memory);
                    return;
                }
                for edge in &node.edges {
                    let taken = match terminator {
                        Terminator::Brif { cond, .. } => {
                            let bit = state.bits(*cond).first().copied().unwrap_or(FALSE);
                            match edge.which {
                                0 => bit,
                                _ => !bit,
                            }
                        }
                        Terminator::Switch { arg, targets, .. } => {
                            let number = state.bits(*arg);
                            let count = targets.len() as i64;
                            if edge.which < targets.len() {
                                let this = builder.graph.number(number.len(), edge.which as i64);
                                builder.graph.equal(&number, &this)
                            } else {
                                let all = builder.graph.number(number.len(), count);
                                !builder.graph.less_unsigned(&number, &all)
                            }
                        }
                        _ => TRUE,
                    };
                    let taken = if node.is_decided { TRUE } else { taken };
                    let cond = builder.graph.and(cond, taken);
                    if cond == FALSE {
                        continue;
                    }
                    let mut values = state.arrival.values.clone();
                    if edge.leaves_function {
                        values.clear();
                    }
                    for (&param, &arg) in edge.params.iter().zip(&edge.args) {
                        values.insert(param.0, state.bits(arg));
                    }
                    let arrival = Arrival {
                        cond,
                        memory: state.arrival.memory.clone(),
                        values,
                        passed: state.arrival.passed,
                    };
                    go(edge.to, edge.is_back, arrival, &mut builder.graph);
                }
            }
        }
    }
}

/// Which values of a function are used in other blocks than the one that defines them, block parameters among them.
fn crossing(func: &FuncData) -> Vec<bool> {
    let mut home: Vec<Option<u32>> = vec![None; func.value_count()];
    for (block, data) in func.blocks() {
        for &inst in &data.insts {
            if let Some(slot) = func.result(inst).and_then(|value| home.get_mut(value.0 as usize)) {
                *slot = Some(block.0);
            }
        }
    }
    let mut crossing = vec![false; func.value_count()];
    for (block, data) in func.blocks() {
        let mut note = |value: Value| {
            let own = home.get(value.0 as usize).copied().flatten() == Some(block.0);
            if let Some(slot) = crossing.get_mut(value.0 as usize).filter(|_| !own) {
                *slot = true;
            }
        };
        data.insts.iter().for_each(|&inst| func.inst(inst).for_each_arg(&mut note));
        if let Some(terminator) = &data.terminator {
            terminator.for_each_arg(note);
        }
    }
    crossing
}
