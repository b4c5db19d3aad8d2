//! Decides which claims about a graph can be broken, by nodes that are equal (FRAIG; Mishchenko and others, 2005).
//!
//! Simulation suggests which nodes are equal. From the inputs on each such pair is looked at by a solver that sees no more of the graph
//! than what is near; where they are equal, one takes the place of the other. So two versions grow together, and what
//! is left of a claim is small.

use std::ops::Range;
use std::time::{Duration, Instant};

use rustc_hash::{FxHashMap, FxHashSet};
use rustsat::types::Lit as SatLit;

use super::simulate::Simulation;
use super::terms::{Function, Terms};
use crate::logic::{FALSE, Graph, Lit, Node};
use crate::solve::{Answer, Deadline, Sat, Told};

/// How many nodes a solver sees at most, one after the other, to show that two nodes are equal.
const WINDOWS: [usize; 3] = [60, 400, 2_500];

/// How many nodes with the same values in the simulation one is compared with.
const MOST_TRIED: usize = 3;

/// Words of a node's values in the simulation.
pub(super) const WORDS: usize = 16;

/// The values of a node in the simulation, those of its first run 0.
type Signature = [u64; WORDS];

/// What is found out about a claim.
#[derive(Clone, Debug)]
pub(super) enum Finding {
    /// It can't be broken.
    Holds,
    /// It is broken by these values of inputs.
    Broken(FxHashMap<u32, bool>),
    /// The time was up.
    Open,
}

/// A graph in which nodes that are equal are one.
pub(super) struct Sweep<'g> {
    graph: &'g Graph,
    terms: &'g Terms,
    deadline: Deadline,
    /// What takes the place of each node that was looked at.
    made: FxHashMap<u32, Lit>,
    reduced: Graph,
    classes: FxHashMap<Signature, Vec<Lit>>,
    applications: FxHashMap<(Function, Vec<Lit>), usize>,
    /// The application to whose results a node belongs.
    of_node: FxHashMap<u32, usize>,
    signatures: Vec<Signature>,
    /// The nodes that were made for the second version.
    second: &'g [Range<u32>],
    /// How many pairs were not found to be equal.
    pub(super) misses: usize,
}

impl<'g> Sweep<'g> {
    /// `runs` are simulations of the whole graph.
    pub(super) fn new(
        graph: &'g Graph,
        terms: &'g Terms,
        runs: &[Vec<u64>],
        second: &'g [Range<u32>],
        deadline: Deadline,
    ) -> Self {
        let mut signatures = vec![[0; WORDS]; graph.len()];
        for (word, run) in runs.iter().enumerate() {
            for (signature, value) in signatures.iter_mut().zip(run) {
                if let Some(slot) = signature.get_mut(word) {
                    *slot = *value;
                }
            }
        }
        let mut of_node = FxHashMap::default();
        for (at, application) in terms.list.iter().enumerate() {
            of_node.extend(application.results.iter().map(|lit| (lit.node(), at)));
        }
        let mut classes: FxHashMap<Signature, Vec<Lit>> = FxHashMap::default();
        classes.insert([0; WORDS], vec![FALSE]);
        Self {
            graph,
            terms,
            deadline,
            made: FxHashMap::default(),
            reduced: Graph::default(),
            classes,
            applications: FxHashMap::default(),
            of_node,
            signatures,
            second,
            misses: 0,
        }
    }

    fn made(&self, lit: Lit) -> Option<Lit> {
        Some(self.made.get(&lit.node())?.complement_if(lit.is_complement()))
    }

    /// What takes the place of a literal; `None` if the time is up.
    pub(super) fn reduce(&mut self, lit: Lit) -> Option<Lit> {
        for (step, node) in self.cone(lit).into_iter().enumerate() {
            if step % 64 == 0 && self.deadline.is_over() {
                return None;
            }
            match self.graph.node(node) {
                Node::False => {
                    self.made.insert(node, FALSE);
                }
                Node::Input => match self.of_node.get(&node).copied() {
                    None => {
                        let new = self.reduced.input();
                        self.made.insert(node, new);
                        self.note(node, new);
                    }
                    Some(number) => self.application(number),
                },
                Node::And(a, b) => {
                    let new = self.reduced.and(self.made(a)?, self.made(b)?);
                    let same = match self.is_of_second(node) {
                        true => self.same_as(node, new),
                        false => {
                            self.note(node, new);
                            new
                        }
                    };
                    self.made.insert(node, same);
                }
            }
        }
        self.made(lit)
    }

    /// Whether a node was made for the second version alone.
    fn is_of_second(&self, node: u32) -> bool {
        let next = self.second.partition_point(|range| range.end <= node);
        self.second.get(next).is_some_and(|range| range.contains(&node))
    }

    /// The nodes on which a literal depends that were not looked at yet, each after those that it depends on.
    fn cone(&self, lit: Lit) -> Vec<u32> {
        let mut open = vec![lit.node()];
        let mut seen = FxHashSet::default();
        while let Some(node) = open.pop() {
            if self.made.contains_key(&node) || !seen.insert(node) {
                continue;
            }
            match self.graph.node(node) {
                Node::And(a, b) => open.extend([a.node(), b.node()]),
                Node::Input => {
                    let application =
                        self.of_node.get(&node).and_then(|&it| self.terms.list.get(it));
                    if let Some(application) = application {
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

    /// Makes the results of an application.
    fn application(&mut self, number: usize) {
        let Some(application) = self.terms.list.get(number) else { return };
        let operands: Vec<Lit> =
            application.operands.iter().filter_map(|&lit| self.made(lit)).collect();
        let key = (application.function, operands);
        let known = *self.applications.entry(key).or_insert(number);
        let same = (known != number).then(|| self.terms.list.get(known)).flatten();
        for (at, lit) in application.results.iter().enumerate() {
            if self.made.contains_key(&lit.node()) {
                continue;
            }
            let other = same.and_then(|it| it.results.get(at)).and_then(|&lit| self.made(lit));
            let new = other.unwrap_or_else(|| {
                let new = self.reduced.input();
                self.note(lit.node(), new);
                new
            });
            self.made.insert(lit.node(), new);
        }
    }

    fn signature(&self, node: u32) -> (Signature, bool) {
        let mut signature = self.signatures.get(node as usize).copied().unwrap_or([0; WORDS]);
        let is_inverted = signature.first().is_some_and(|word| word & 1 == 1);
        if is_inverted {
            signature.iter_mut().for_each(|word| *word = !*word);
        }
        (signature, is_inverted)
    }

    fn note(&mut self, node: u32, new: Lit) {
        let (signature, is_inverted) = self.signature(node);
        let class = self.classes.entry(signature).or_default();
        if class.len() < MOST_TRIED {
            class.push(new.complement_if(is_inverted));
        }
    }

    /// A literal that is always the same as a node of the graph that became `new`.
    fn same_as(&mut self, node: u32, new: Lit) -> Lit {
        if new.value().is_some() {
            return new;
        }
        let (signature, is_inverted) = self.signature(node);
        let own = new.complement_if(is_inverted);
        let class = self.classes.get(&signature).cloned().unwrap_or_default();
        for &other in &class {
            if other == own || self.is_equal_nearby(own, other) {
                return other.complement_if(is_inverted);
            }
        }
        self.note(node, new);
        new
    }

    /// Whether two literals are equal for what can be seen near them.
    fn is_equal_nearby(&mut self, a: Lit, b: Lit) -> bool {
        let differ = self.reduced.xor(a, b);
        if differ == FALSE {
            return true;
        }
        let is_constant = b == FALSE;
        for size in WINDOWS {
            if is_constant && size > 60
                || size > 400 && self.misses > 60
                || size > 60 && self.misses > 400
            {
                return false;
            }
            let (clauses, is_whole) = self.window(differ, size);
            match clauses {
                Answer::No => return true,
                Answer::Yes if is_whole => {
                    self.misses += 1;
                    return false;
                }
                Answer::Yes => {}
                Answer::Unknown => {
                    self.misses += 1;
                    return false;
                }
            }
        }
        self.misses += 1;
        false
    }

    /// Whether a literal can be true where nothing is known of what lies beyond `size` nodes; and whether nothing lies beyond.
    fn window(&self, lit: Lit, size: usize) -> (Answer, bool) {
        let moment = Instant::now() + Duration::from_millis(3);
        let end = self.deadline.0.map_or(moment, |end| end.min(moment));
        let mut sat = Sat::new(Deadline(Some(end)));
        let mut told: FxHashMap<u32, SatLit> = FxHashMap::default();
        let mut queue = std::collections::BinaryHeap::from([lit.node()]);
        let (mut is_whole, mut count) = (true, 0);
        let mut ands = vec![];
        while let Some(node) = queue.pop() {
            if told.contains_key(&node) {
                continue;
            }
            let variable = sat.variable();
            told.insert(node, variable);
            match self.reduced.node(node) {
                Node::False => sat.add(&[!variable]),
                Node::Input => {}
                Node::And(..) if count >= size => is_whole = false,
                Node::And(a, b) => {
                    count += 1;
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
        let Some(goal) = get(lit) else { return (Answer::Unknown, false) };
        (sat.solve(&[goal]), is_whole)
    }

    /// Whether a solver finds in a short time that a claim holds, without looking for nodes that are equal.
    pub(super) fn holds_at_once(&self, differs: Lit, time: Duration) -> bool {
        let moment = Instant::now() + time;
        let end = self.deadline.0.map_or(moment, |end| end.min(moment));
        let mut whole = Whole::new(Deadline(Some(end)));
        let goal = whole.tell(self.graph, differs);
        whole.sat.solve(&[goal]) == Answer::No
    }

    /// Whether a claim can be broken: whether a literal can be true.
    pub(super) fn decide(&mut self, differs: Lit) -> Finding {
        let Some(goal) = self.reduce(differs) else { return Finding::Open };
        if goal == FALSE {
            return Finding::Holds;
        }
        // Functions that are not computed may give anything at first; where equal operands gave different results, that is told.
        let mut whole = Whole::new(self.deadline);
        let goal_lit = whole.tell(&self.reduced, goal);
        let mut told = 0;
        loop {
            match whole.sat.solve(&[goal_lit]) {
                Answer::No => return Finding::Holds,
                Answer::Unknown => return Finding::Open,
                Answer::Yes => {}
            }
            let values = self.values(&whole);
            let more = self.agreements(&mut whole, &values);
            told += more;
            if more == 0 {
                return Finding::Broken(values);
            }
            if told > 3_000 || self.deadline.is_over() {
                return Finding::Open;
            }
        }
    }

    /// The values that the solver has found, by the inputs of the graph.
    fn values(&self, whole: &Whole) -> FxHashMap<u32, bool> {
        let inputs = self.made.iter().filter(|(node, _)| self.graph.node(**node) == Node::Input);
        let value = |lit: Lit| {
            let known = whole.told.node(lit.node()).is_some_and(|it| whole.sat.value(it));
            lit.value().unwrap_or(known != lit.is_complement())
        };
        inputs.map(|(&node, &lit)| (node, value(lit))).collect()
    }

    /// Tells the solver of pairs of applications whose operands were equal and whose results were not; says how many.
    fn agreements(&mut self, whole: &mut Whole, values: &FxHashMap<u32, bool>) -> usize {
        let mut run = Simulation::new(self.graph, self.terms);
        for (&node, &value) in values {
            run.set(Lit::of_node(node), if value { u64::MAX } else { 0 });
        }
        // All values, with the results as the solver has chosen them.
        run.keep_all();
        let mut seen: FxHashMap<(Function, Vec<bool>), usize> = FxHashMap::default();
        let mut pairs = vec![];
        for number in self.applications.values().copied().collect::<std::collections::BTreeSet<_>>()
        {
            let Some(it) = self.terms.list.get(number) else { continue };
            let of = |lits: &[Lit]| lits.iter().map(|&lit| run.get(lit) & 1 == 1).collect();
            let operands: Vec<bool> = of(&it.operands);
            let results: Vec<bool> = of(&it.results);
            match seen.get(&(it.function, operands.clone())) {
                None => {
                    seen.insert((it.function, operands), number);
                }
                Some(&other) => {
                    let other_results = self.terms.list.get(other).map(|it| of(&it.results));
                    if other_results.is_some_and(|other| other != results) {
                        pairs.push((other, number));
                    }
                }
            }
        }
        let pairs: Vec<(usize, usize)> = pairs.into_iter().take(8).collect();
        for &(one, other) in &pairs {
            self.agree(whole, one, other);
        }
        pairs.len()
    }

    fn agree(&mut self, whole: &mut Whole, one: usize, other: usize) {
        let (Some(a), Some(b)) = (self.terms.list.get(one), self.terms.list.get(other)) else {
            return;
        };
        let mut differ = FALSE;
        for (&x, &y) in a.operands.iter().zip(&b.operands) {
            if let (Some(x), Some(y)) = (self.made(x), self.made(y)) {
                let bit = self.reduced.xor(x, y);
                differ = self.reduced.or(differ, bit);
            }
        }
        let differ = whole.tell(&self.reduced, differ);
        for (&x, &y) in a.results.iter().zip(&b.results) {
            if let (Some(x), Some(y)) = (self.made(x), self.made(y)) {
                let (x, y) = (whole.tell(&self.reduced, x), whole.tell(&self.reduced, y));
                whole.sat.add(&[differ, !x, y]);
                whole.sat.add(&[differ, x, !y]);
            }
        }
    }
}

/// A solver that is told of a graph as far as it is asked about.
struct Whole {
    sat: Sat,
    told: Told,
}

impl Whole {
    fn new(deadline: Deadline) -> Self {
        Self { sat: Sat::new(deadline), told: Told::default() }
    }

    fn tell(&mut self, graph: &Graph, lit: Lit) -> SatLit {
        self.told.tell(&mut self.sat, graph, lit)
    }
}
