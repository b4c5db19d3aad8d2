//! Decides which claims about a graph can be broken, by nodes that are equal (FRAIG; Mishchenko and others, 2005).
//!
//! Simulation suggests which nodes are equal. From the inputs on each such pair is looked at by a solver that sees first no more of the
//! graph than what is near, then all of it; where they are equal, one takes the place of the other. So two versions grow together,
//! and what is left of a claim is small. Where they are not, the values that tell them apart are one more run of the
//! simulation, which tells others apart, too.

use std::rc::Rc;

use rustc_hash::{FxHashMap, FxHashSet};

use super::Difference;
use super::claims::{Claim, Subject};
use super::classes::Classes;
use super::known::{Known, Place, STEPS, Whole};
use super::simulate::{Answers, Simulation};
use super::terms::Function;
use crate::logic::{FALSE, Graph, Lit, Node};
use crate::solve::{Answer, Deadline};

/// How many nodes a solver sees at most, one after the other, to show that two nodes are equal, before it sees all.
const WINDOWS: [usize; 2] = [50, 400];

/// With how many nodes that have the same values in the simulation one is compared.
const MOST_TRIED: usize = 3;

/// How many nodes a solver is told of before another one takes its place: each search decides about all of them.
const MOST_TOLD: usize = 8_000;

/// How many pairs are left undecided by what is near them before they are compared by all.
const MOST_NEAR: u32 = 500;

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
    /// The time was up, or what is near decides too little.
    Open,
}

/// Has nodes of a graph that are equal become one.
pub(super) struct Sweep<'k, 's, 'm> {
    pub(super) known: &'k mut Known,
    /// The bit of the image for which each input of the graph stands.
    places: FxHashMap<u32, Place>,
    pub(super) subject: &'s Subject<'s, 'm>,
    pub(super) graph: &'s Graph,
    deadline: Deadline,
    claims: Rc<[Claim]>,
    reach: Reach,
    run: Simulation<'s>,
    classes: Classes,
    /// What takes the place of each node that was looked at.
    made: Vec<Option<Lit>>,
    /// The input of the graph for which each input of the reduced graph was made.
    origins: FxHashMap<u32, u32>,
    pub(super) applications: FxHashMap<(Function, Vec<Lit>), usize>,
    /// The application to whose results a node belongs.
    of_node: FxHashMap<u32, usize>,
    /// How many pairs were not decided.
    undecided: u32,
    runs: usize,
    replayed: usize,
}

impl<'k, 's, 'm> Sweep<'k, 's, 'm> {
    /// `classes` know some runs of the whole graph, `run` was the last of them.
    pub(super) fn new(
        known: &'k mut Known,
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
            known,
            places: subject.places(),
            subject,
            graph,
            deadline,
            claims: claims.into(),
            reach,
            run,
            classes,
            made: vec![None; graph.len()],
            origins: FxHashMap::default(),
            applications: FxHashMap::default(),
            of_node,
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

    /// What takes the place of a literal; a difference if one is found, or nothing if the time is up or what is near decides too little.
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
                    let new = self.known.graph.and(a, b);
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
        let place = self.places.get(&node).copied();
        let new = match place {
            Some(place) => self.known.input(place),
            None => self.known.graph.input(),
        };
        self.made_input(node, new);
    }

    fn made_input(&mut self, node: u32, new: Lit) {
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
        let results = self.known.results(&key, application.results.len());
        let is_first = *self.applications.entry(key).or_insert(number) == number;
        for (&lit, new) in application.results.iter().zip(results) {
            if self.made(lit).is_some() {
                continue;
            }
            if is_first {
                self.made_input(lit.node(), new);
            } else {
                self.put(lit.node(), new);
            }
        }
    }

    /// A literal that is always the same as a node of the graph that became `new`.
    fn same_as(&mut self, node: u32, new: Lit) -> Result<Lit, Option<Difference>> {
        let new = self.known.resolve(new);
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
                Some(true) => {
                    self.known.equate(new, other);
                    return Ok(self.known.resolve(other));
                }
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
        let is_last = !whole || self.reach == Reach::Near || self.runs >= MOST_RUNS;
        let is_tried = self.known.is_tried(a, b);
        if self.reach == Reach::Near && self.undecided > MOST_NEAR {
            return Err(None);
        }
        if is_last && is_tried {
            self.undecided += 1;
            return Ok(None);
        }
        let differ = self.known.graph.xor(a, b);
        if differ == FALSE {
            return Ok(Some(true));
        }
        for size in WINDOWS.into_iter().filter(|_| !is_tried) {
            match self.known.window(differ, size) {
                (Answer::No, _) => return Ok(Some(true)),
                (Answer::Yes, Some(values)) => {
                    let values = self.of_graph(&values);
                    if self.tell_apart(&values, node, like)? {
                        return Ok(Some(false));
                    }
                }
                _ => {}
            }
        }
        self.known.note_tried(a, b);
        if is_last {
            self.undecided += 1;
            return Ok(None);
        }
        if self.known.whole.told.len() > MOST_TOLD {
            self.known.renew();
        }
        let goal = self.known.whole.tell(&self.known.graph, differ);
        let spare = if self.undecided > 100 { STEPS / 4 } else { STEPS };
        self.known.whole.sat.set_steps(Some(spare + self.known.whole.told.len() as u32));
        for _ in 0..MOST_MENDED {
            match self.known.whole.sat.solve(&[goal]) {
                Answer::No => {
                    self.known.whole.sat.add(&[!goal]);
                    return Ok(Some(true));
                }
                Answer::Yes => {
                    let values = self.values(&self.known.whole);
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

    /// Values of inputs of the graph where those of what takes their places are known.
    fn of_graph(&self, values: &FxHashMap<u32, bool>) -> FxHashMap<u32, bool> {
        let own = |(node, &value): (&u32, &bool)| Some((*self.origins.get(node)?, value));
        values.iter().filter_map(own).collect()
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
            Reach::Near => (Some(STEPS + self.known.whole.told.len() as u32), MOST_TOLD_NEAR),
            Reach::All => (None, MOST_TOLD_FAR),
        };
        self.known.whole.sat.set_steps(steps);
        let goal_lit = self.known.whole.tell(&self.known.graph, goal);
        let mut told = 0;
        loop {
            match self.known.whole.sat.solve(&[goal_lit]) {
                Answer::No => {
                    self.known.whole.sat.add(&[!goal_lit]);
                    self.known.equate(goal, FALSE);
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
            let known = self.known.whole.told.node(lit.node());
            let known = known.is_some_and(|it| self.known.whole.sat.value(it));
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
