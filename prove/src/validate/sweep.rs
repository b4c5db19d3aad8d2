//! Decides which claims about a graph can be broken, by nodes that are equal (FRAIG; Mishchenko and others, 2005).
//!
//! Simulation suggests which nodes are equal. From the inputs on each such pair is looked at by a solver that sees first no more of the
//! graph than what is near, then all of it; where they are equal, one takes the place of the other. So two versions grow together,
//! and what is left of a claim is small. Where they are not, the values that tell them apart are one more run of the
//! simulation, which tells others apart, too.

use std::rc::Rc;

use rustc_hash::{FxHashMap, FxHashSet};
use rustsat::types::Lit as SatLit;

use super::Difference;
use super::claims::{Claim, Subject};
use super::classes::Classes;
use super::simulate::{Answers, Simulation};
use super::terms::Function;
use crate::logic::{FALSE, Graph, Lit, Node};
use crate::solve::{Answer, Deadline, Sat, Told};

/// How many nodes a solver sees at most, one after the other, to show that two nodes are equal, before it sees all.
const WINDOWS: [usize; 2] = [50, 400];

/// With how many nodes that have the same values in the simulation one is compared.
const MOST_TRIED: usize = 3;

/// How many nodes a solver is told of before another one takes its place: each search decides about all of them.
const MOST_TOLD: usize = 8_000;

/// How many steps a solver may take to show that two nodes are equal, where it sees a part of the graph, or all.
const STEPS: u32 = 2_000;

/// How many claims are hard before all others count as hard.
const MOST_HARD: usize = 6;

/// How many runs that tell nodes apart are made.
const MOST_RUNS: usize = 3_000;

/// How often a solver is told more of functions to show that two nodes are equal.
const MOST_MENDED: usize = 4;

/// How often it is told more of them to decide a claim, where nodes are compared by what is near them, and by all.
const MOST_TOLD_NEAR: usize = 40;
const MOST_TOLD_FAR: usize = 3_000;

/// How many of these runs are tried in the interpreter where they break a claim.
const MOST_REPLAYED: usize = 24;

/// How much of a graph a solver sees where two nodes are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// What is near them. This decides most claims, and takes a part of the time.
    Near,
    /// All of it.
    All,
}

/// What is found out about a claim.
#[derive(Clone, Debug)]
pub(super) enum Finding {
    /// It can't be broken.
    Holds,
    /// It is broken by these values of inputs.
    Broken(FxHashMap<u32, bool>),
    /// Both versions differ in the interpreter.
    Differs(Difference),
    /// The time was up.
    Open,
}

/// A graph in which nodes that are equal are one.
pub(super) struct Sweep<'s, 'm> {
    pub(super) subject: &'s Subject<'s, 'm>,
    pub(super) graph: &'s Graph,
    deadline: Deadline,
    claims: Rc<[Claim]>,
    reach: Reach,
    run: Simulation<'s>,
    classes: Classes,
    /// What takes the place of each node that was looked at.
    made: Vec<Option<Lit>>,
    pub(super) reduced: Graph,
    /// The input of the graph for which each input of the reduced graph was made.
    origins: FxHashMap<u32, u32>,
    pub(super) applications: FxHashMap<(Function, Vec<Lit>), usize>,
    /// The application to whose results a node belongs.
    of_node: FxHashMap<u32, usize>,
    pub(super) whole: Whole,
    /// How many pairs were not decided.
    undecided: u32,
    runs: usize,
    replayed: usize,
}

impl<'s, 'm> Sweep<'s, 'm> {
    /// `classes` know some runs of the whole graph, `run` was the last of them.
    pub(super) fn new(
        subject: &'s Subject<'s, 'm>,
        claims: &[Claim],
        reach: Reach,
        (run, mut classes): (Simulation<'s>, Classes),
    ) -> Self {
        let (graph, deadline) = (subject.graph, subject.deadline);
        let mut of_node = FxHashMap::default();
        for (at, application) in subject.list.iter().enumerate() {
            of_node.extend(application.results.iter().map(|lit| (lit.node(), at)));
        }
        classes.note(FALSE.node(), FALSE);
        Self {
            subject,
            graph,
            deadline,
            claims: claims.into(),
            reach,
            run,
            classes,
            made: vec![None; graph.len()],
            reduced: Graph::default(),
            origins: FxHashMap::default(),
            applications: FxHashMap::default(),
            of_node,
            whole: Whole::new(deadline),
            undecided: 0,
            runs: 0,
            replayed: 0,
        }
    }

    /// The last run, and what the runs say of nodes, for another sweep.
    pub(super) fn runs(self) -> (Simulation<'s>, Classes) {
        (self.run, self.classes.without_notes())
    }

    pub(super) fn made(&self, lit: Lit) -> Option<Lit> {
        let made = self.made.get(lit.node() as usize).copied().flatten()?;
        Some(made.complement_if(lit.is_complement()))
    }

    fn put(&mut self, node: u32, new: Lit) {
        if let Some(slot) = self.made.get_mut(node as usize) {
            *slot = Some(new);
        }
    }

    /// What takes the place of a literal; a difference if one is found, or nothing if the time is up.
    fn reduce(&mut self, lit: Lit) -> Result<Lit, Option<Difference>> {
        for (step, node) in self.cone(lit).into_iter().enumerate() {
            if step % 16 == 0 && self.deadline.is_over() {
                return Err(None);
            }
            match self.graph.node(node) {
                Node::False => self.put(node, FALSE),
                Node::Input => match self.of_node.get(&node).copied() {
                    None => self.input(node),
                    Some(number) => self.application(number),
                },
                Node::And(a, b) => {
                    let (Some(a), Some(b)) = (self.made(a), self.made(b)) else {
                        return Err(None);
                    };
                    let new = self.reduced.and(a, b);
                    let same = self.same_as(node, new)?;
                    self.put(node, same);
                }
            }
        }
        self.made(lit).ok_or(None)
    }

    /// The nodes on which a literal depends that were not looked at yet, each after those that it depends on.
    fn cone(&self, lit: Lit) -> Vec<u32> {
        let mut open = vec![lit.node()];
        let (mut seen, mut applied) = (FxHashSet::default(), FxHashSet::default());
        while let Some(node) = open.pop() {
            if self.made(Lit::of_node(node)).is_some() || !seen.insert(node) {
                continue;
            }
            match self.graph.node(node) {
                Node::And(a, b) => open.extend([a.node(), b.node()]),
                Node::Input => {
                    // Once for all its results: a call of the host has as many as the image has bits.
                    let new = self.of_node.get(&node).filter(|&&it| applied.insert(it));
                    if let Some(application) = new.and_then(|&it| self.subject.list.get(it)) {
                        open.extend(application.operands.iter().map(|lit| lit.node()));
                        open.extend(application.results.iter().map(|lit| lit.node()));
                    }
                }
                Node::False => {}
            }
        }
        let mut all: Vec<u32> = seen.into_iter().collect();
        all.sort_unstable();
        all
    }

    fn input(&mut self, node: u32) {
        let new = self.reduced.input();
        self.origins.insert(new.node(), node);
        self.classes.note(node, new);
        self.put(node, new);
    }

    /// Makes the results of an application.
    fn application(&mut self, number: usize) {
        let Some(application) = self.subject.list.get(number) else { return };
        let operands: Vec<Lit> =
            application.operands.iter().filter_map(|&lit| self.made(lit)).collect();
        let key = (application.function, operands);
        let known = *self.applications.entry(key).or_insert(number);
        let same = (known != number).then(|| self.subject.list.get(known)).flatten();
        for (at, &lit) in application.results.iter().enumerate() {
            if self.made(lit).is_some() {
                continue;
            }
            match same.and_then(|it| it.results.get(at)).and_then(|&lit| self.made(lit)) {
                Some(other) => self.put(lit.node(), other),
                None => self.input(lit.node()),
            }
        }
    }

    /// A literal that is always the same as a node of the graph that became `new`.
    fn same_as(&mut self, node: u32, new: Lit) -> Result<Lit, Option<Difference>> {
        if new.value().is_some() {
            return Ok(new);
        }
        // What is new in the second version, and in the claims, is compared with all; other nodes only with constants.
        let is_new = self.subject.is_of_second(node);
        let (mut number, mut tried) = (0, 0);
        while let Some((like, other)) = self.classes.like(node, number) {
            if other == new {
                return Ok(new);
            }
            if tried == MOST_TRIED || !is_new && other.value().is_none() {
                break;
            }
            match self.is_equal((node, new), (like, other), is_new)? {
                Some(true) => return Ok(other),
                // The one that it was compared with is not of its class any more.
                Some(false) => {}
                None => number += 1,
            }
            tried += 1;
        }
        self.classes.note(node, new);
        Ok(new)
    }

    /// Whether two literals are equal, as far as a solver finds it out soon. Those that are not are told apart afterwards.
    fn is_equal(
        &mut self,
        (node, a): (u32, Lit),
        (like, b): (u32, Lit),
        whole: bool,
    ) -> Result<Option<bool>, Option<Difference>> {
        let differ = self.reduced.xor(a, b);
        if differ == FALSE {
            return Ok(Some(true));
        }
        for size in WINDOWS {
            match self.window(differ, size) {
                (Answer::No, _) => return Ok(Some(true)),
                (Answer::Yes, Some(values)) if self.tell_apart(&values, node, like)? => {
                    return Ok(Some(false));
                }
                _ => {}
            }
        }
        if !whole || self.reach == Reach::Near || self.runs >= MOST_RUNS {
            self.undecided += 1;
            return Ok(None);
        }
        if self.whole.told.len() > MOST_TOLD {
            self.whole = Whole::new(self.deadline);
        }
        let goal = self.whole.tell(&self.reduced, differ);
        let spare = if self.undecided > 100 { STEPS / 4 } else { STEPS };
        self.whole.sat.set_steps(Some(spare + self.whole.told.len() as u32));
        for _ in 0..MOST_MENDED {
            match self.whole.sat.solve(&[goal]) {
                Answer::No => {
                    self.whole.sat.add(&[!goal]);
                    return Ok(Some(true));
                }
                Answer::Yes => {
                    let values = self.values(&self.whole);
                    if self.tell_apart(&values, node, like)? {
                        return Ok(Some(false));
                    }
                    if self.mend() == 0 {
                        break;
                    }
                }
                Answer::Unknown => break,
            }
        }
        self.undecided += 1;
        Ok(None)
    }

    /// Makes runs near some values of inputs, and tries them in the interpreter if a claim is broken. Says whether they tell two nodes
    /// apart; then they count from now on.
    fn tell_apart(
        &mut self,
        values: &FxHashMap<u32, bool>,
        node: u32,
        like: u32,
    ) -> Result<bool, Option<Difference>> {
        self.subject.randomize(&mut self.run);
        let mut chosen = FxHashSet::default();
        for (&node, &value) in values {
            let mut word = if value { u64::MAX } else { 0 };
            match self.of_node.get(&node) {
                Some(&application) => {
                    let known = self.subject.list.get(application);
                    if known.is_some_and(|it| it.function.is_event()) {
                        chosen.insert(application);
                    }
                }
                // In most of the runs a few bits differ.
                None => {
                    let few = self.run.random() & self.run.random() & self.run.random();
                    word ^= few & self.run.random() & !0xFF;
                }
            }
            self.run.set(Lit::of_node(node), word);
        }
        if !self.run.run(Answers::Near(&chosen), self.deadline) {
            return Err(None);
        }
        for claim in Rc::clone(&self.claims).iter() {
            let lanes = self.run.get(claim.differs);
            if lanes == 0 || self.replayed >= MOST_REPLAYED {
                continue;
            }
            self.replayed += 1;
            if let Some(difference) = self.subject.replay(&self.run, lanes.trailing_zeros()) {
                return Err(Some(difference));
            }
        }
        if self.classes.is_same(&self.run.values, node, like) {
            return Ok(false);
        }
        self.runs += 1;
        self.classes.add_later(self.run.values.clone());
        Ok(true)
    }

    /// Whether a literal can be true where nothing is known of what lies beyond `size` nodes; and with which values of inputs, if
    /// nothing lies beyond.
    fn window(&self, lit: Lit, size: usize) -> (Answer, Option<FxHashMap<u32, bool>>) {
        let mut sat = Sat::new(self.deadline);
        sat.set_steps(Some(STEPS));
        let mut told: FxHashMap<u32, SatLit> = FxHashMap::default();
        let mut queue = std::collections::BinaryHeap::from([lit.node()]);
        let (mut is_whole, mut ands) = (true, vec![]);
        while let Some(node) = queue.pop() {
            if told.contains_key(&node) {
                continue;
            }
            let variable = sat.variable();
            told.insert(node, variable);
            match self.reduced.node(node) {
                Node::False => sat.add(&[!variable]),
                Node::Input => {}
                Node::And(..) if ands.len() >= size => is_whole = false,
                Node::And(a, b) => {
                    ands.push((node, a, b));
                    queue.extend([a.node(), b.node()]);
                }
            }
        }
        let get =
            |lit: Lit| told.get(&lit.node()).map(|&it| if lit.is_complement() { !it } else { it });
        for (node, a, b) in ands {
            if let (Some(it), Some(a), Some(b)) = (get(Lit::of_node(node)), get(a), get(b)) {
                sat.define_and(it, a, b);
            }
        }
        let Some(goal) = get(lit) else { return (Answer::Unknown, None) };
        let answer = sat.solve(&[goal]);
        let values = (answer == Answer::Yes && is_whole).then(|| {
            let value = |(node, origin): (&u32, &u32)| Some((*origin, sat.value(*told.get(node)?)));
            self.origins.iter().filter_map(value).collect()
        });
        (answer, values)
    }

    /// Whether a claim can be broken: whether a literal can be true.
    pub(super) fn decide(&mut self, differs: Lit) -> Finding {
        let goal = match self.reduce(differs) {
            Ok(FALSE) => return Finding::Holds,
            Ok(goal) => goal,
            Err(Some(difference)) => return Finding::Differs(difference),
            Err(None) => return Finding::Open,
        };
        // Functions that are not computed may give anything at first; where that was wrong, more is told.
        let (steps, most) = match self.reach {
            Reach::Near => (Some(STEPS + self.whole.told.len() as u32), MOST_TOLD_NEAR),
            Reach::All => (None, MOST_TOLD_FAR),
        };
        self.whole.sat.set_steps(steps);
        let goal_lit = self.whole.tell(&self.reduced, goal);
        let mut told = 0;
        loop {
            match self.whole.sat.solve(&[goal_lit]) {
                Answer::No => {
                    self.whole.sat.add(&[!goal_lit]);
                    return Finding::Holds;
                }
                Answer::Unknown => return Finding::Open,
                Answer::Yes => {}
            }
            let values = self.all_values();
            let more = self.mend();
            told += more;
            if more == 0 {
                return Finding::Broken(values);
            }
            if told > most || self.deadline.is_over() {
                return Finding::Open;
            }
        }
    }

    /// The values that a solver has found, by the inputs of the graph; all that it was not told of are false.
    pub(super) fn all_values(&self) -> FxHashMap<u32, bool> {
        let value = |lit: Lit| {
            let known = self.whole.told.node(lit.node());
            let known = known.is_some_and(|it| self.whole.sat.value(it));
            lit.value().unwrap_or(known != lit.is_complement())
        };
        let nodes = self.made.iter().zip(0..).filter_map(|(made, node)| Some((node, (*made)?)));
        let inputs = nodes.filter(|&(node, _)| self.graph.node(node) == Node::Input);
        inputs.map(|(node, made)| (node, value(made))).collect()
    }

    /// The values that a solver has found, by the inputs of the graph that it was told of.
    fn values(&self, whole: &Whole) -> FxHashMap<u32, bool> {
        let value = |(&node, &origin): (&u32, &u32)| {
            Some((origin, whole.sat.value(whole.told.node(node)?)))
        };
        self.origins.iter().filter_map(value).collect()
    }
}

/// The claims that a solver does not see at once to hold. It sees no functions, and gives up when a few claims are hard.
pub(super) fn left(graph: &Graph, claims: &[Claim], deadline: Deadline) -> Vec<Claim> {
    let mut whole = Whole::new(deadline);
    whole.sat.set_steps(Some(STEPS));
    let mut hard = 0;
    let mut left = vec![];
    for claim in claims {
        if hard < MOST_HARD {
            let goal = whole.tell(graph, claim.differs);
            if whole.sat.solve(&[goal]) == Answer::No {
                continue;
            }
            hard += 1;
        }
        left.push(*claim);
    }
    left
}

/// A solver that is told of a graph as far as it is asked about.
pub(super) struct Whole {
    pub(super) sat: Sat,
    told: Told,
    /// Applications of which it knows all.
    pub(super) defined: FxHashSet<usize>,
}

impl Whole {
    fn new(deadline: Deadline) -> Self {
        Self { sat: Sat::new(deadline), told: Told::default(), defined: FxHashSet::default() }
    }

    pub(super) fn tell(&mut self, graph: &Graph, lit: Lit) -> SatLit {
        self.told.tell(&mut self.sat, graph, lit)
    }
}
