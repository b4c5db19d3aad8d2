//! A system of states, unrolled tick by tick into one graph, which a SAT solver is told as far as it is asked about.

use rustc_hash::FxHashMap;
use rustsat::types::Lit as SatLit;

use super::sat::{Answer, Deadline, Sat};
use super::told::Told;
use crate::logic::{Graph, Lit, Node};
use crate::system::{First, System};

/// Where an unrolling begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// At power-up.
    PowerUp,
    /// In any state.
    Anywhere,
}

/// The values of inputs and states in a run, by the nodes of the system's graph; what did not matter is not there.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// For each tick the values of inputs, and of latches at its beginning.
    pub ticks: Vec<FxHashMap<u32, bool>>,
}

impl Trace {
    /// The value of an input or latch in a tick, if it mattered.
    pub fn value(&self, tick: usize, lit: Lit) -> Option<bool> {
        if let Some(value) = lit.value() {
            return Some(value);
        }
        let value = self.ticks.get(tick)?.get(&lit.node())?;
        Some(*value != lit.is_complement())
    }
}

/// An unrolled system.
#[derive(Debug)]
pub struct Unrolling<'s> {
    system: &'s System,
    start: Start,
    /// For each latch of the system's graph its index.
    latches: FxHashMap<u32, usize>,
    graph: Graph,
    /// For each tick the literals of the system's nodes.
    ticks: Vec<FxHashMap<u32, Lit>>,
    told: Told,
    sat: Sat,
}

impl<'s> Unrolling<'s> {
    /// An unrolling that has no tick yet.
    pub fn new(system: &'s System, start: Start, deadline: Deadline) -> Self {
        let latches = system.latches.iter().enumerate().map(|(i, it)| (it.lit.node(), i)).collect();
        Self {
            system,
            start,
            latches,
            graph: Graph::default(),
            ticks: vec![],
            told: Told::default(),
            sat: Sat::new(deadline),
        }
    }

    /// The literal of what a literal of the system is in a tick.
    pub fn at(&mut self, tick: usize, lit: Lit) -> Lit {
        while self.ticks.len() <= tick {
            self.ticks.push(FxHashMap::default());
        }
        let system = self.system;
        let mut open = vec![(tick, lit.node())];
        while let Some(&(tick, node)) = open.last() {
            if self.get(tick, node).is_some() {
                open.pop();
                continue;
            }
            let made = match system.builder.graph.node(node) {
                Node::False => Some(crate::logic::FALSE),
                Node::And(a, b) => match (self.get(tick, a.node()), self.get(tick, b.node())) {
                    (Some(x), Some(y)) => {
                        let x = x.complement_if(a.is_complement());
                        Some(self.graph.and(x, y.complement_if(b.is_complement())))
                    }
                    (x, y) => {
                        if x.is_none() {
                            open.push((tick, a.node()));
                        }
                        if y.is_none() {
                            open.push((tick, b.node()));
                        }
                        None
                    }
                },
                Node::Input if system.same.contains_key(&node) => {
                    let same = system.same.get(&node).copied().unwrap_or(crate::logic::FALSE);
                    match self.get(tick, same.node()) {
                        Some(lit) => Some(lit.complement_if(same.is_complement())),
                        None => {
                            open.push((tick, same.node()));
                            None
                        }
                    }
                }
                Node::Input => {
                    let latch = self.latches.get(&node).and_then(|&at| system.latches.get(at));
                    match (latch, tick.checked_sub(1)) {
                        (Some(latch), Some(before)) => match self.get(before, latch.next.node()) {
                            Some(lit) => Some(lit.complement_if(latch.next.is_complement())),
                            None => {
                                open.push((before, latch.next.node()));
                                None
                            }
                        },
                        (Some(latch), None) => match (self.start, latch.first) {
                            (Start::PowerUp, First::Constant(value)) => Some(Lit::constant(value)),
                            (Start::PowerUp, First::As(other)) => match self.get(0, other.node()) {
                                Some(lit) => Some(lit.complement_if(other.is_complement())),
                                None => {
                                    open.push((0, other.node()));
                                    None
                                }
                            },
                            _ => Some(self.graph.input()),
                        },
                        (None, _) => Some(self.graph.input()),
                    }
                }
            };
            if let Some(made) = made {
                if let Some(known) = self.ticks.get_mut(tick) {
                    known.insert(node, made);
                }
                open.pop();
            }
        }
        self.get(tick, lit.node())
            .map_or(crate::logic::FALSE, |it| it.complement_if(lit.is_complement()))
    }

    fn get(&self, tick: usize, node: u32) -> Option<Lit> {
        self.ticks.get(tick)?.get(&node).copied()
    }

    /// Tells the solver about a literal of the unrolled graph.
    fn tell(&mut self, lit: Lit) -> SatLit {
        self.told.tell(&mut self.sat, &self.graph, lit)
    }

    /// Whether two literals of the system can differ in a tick.
    pub fn can_differ(&mut self, tick: usize, a: Lit, b: Lit) -> Answer {
        let (a, b) = (self.at(tick, a), self.at(tick, b));
        let differ = self.graph.xor(a, b);
        if differ == crate::logic::FALSE {
            return Answer::No;
        }
        let differ = self.tell(differ);
        self.sat.solve(&[differ])
    }

    /// The solver's literal of what a literal of the system is in a tick.
    pub fn sat_lit(&mut self, tick: usize, lit: Lit) -> SatLit {
        let lit = self.at(tick, lit);
        self.tell(lit)
    }

    /// Has a literal be true in a tick from now on.
    pub fn require(&mut self, tick: usize, lit: Lit) {
        let lit = self.sat_lit(tick, lit);
        self.sat.add(&[lit]);
    }

    /// Whether a literal can be true in a tick.
    pub fn can_be(&mut self, tick: usize, lit: Lit) -> Answer {
        let lit = self.at(tick, lit);
        if lit == crate::logic::FALSE {
            return Answer::No;
        }
        let lit = self.tell(lit);
        self.sat.solve(&[lit])
    }

    /// The solver.
    pub fn sat(&mut self) -> &mut Sat {
        &mut self.sat
    }

    /// The run that the solver has found, up to a tick.
    pub fn trace(&self, last: usize) -> Trace {
        let mut trace = Trace::default();
        for known in self.ticks.iter().take(last + 1) {
            let mut values = FxHashMap::default();
            for (&node, &lit) in known {
                let is_input = self.system.builder.graph.node(node) == Node::Input;
                let value = lit.value().or_else(|| {
                    let sat = self.told.node(lit.node())?;
                    Some(self.sat.value(sat) != lit.is_complement())
                });
                if let Some(value) = value.filter(|_| is_input) {
                    values.insert(node, value);
                }
            }
            trace.ticks.push(values);
        }
        trace
    }
}
