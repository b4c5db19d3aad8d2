//! What is known of the logic of a function, whichever label it is looked at from: nodes that are equal to others, with what a solver has learned.
//!
//! The graph has an input for each bit of the image, so that what is found from one label on is true from each other one. What happens is a
//! function of which only equal operands are known to give equal results, so what is found holds whatever it gives.

use rustc_hash::{FxHashMap, FxHashSet};
use rustsat::types::Lit as SatLit;

use super::terms::Function;
use super::universe::Kind;
use super::window::Window;
use crate::logic::{Graph, Lit};
use crate::solve::{Answer, Deadline, Sat, Told};

/// How many steps a solver may take to show that two nodes are equal, where it sees a part of the graph, or all.
pub(super) const STEPS: u32 = 2_000;

/// How many nodes a solver is told of from one label before another one takes its place for the next label.
const MOST_CARRIED: usize = 100_000;

/// How large the graph may be when another label is looked at.
const MOST_NODES: usize = 1_000_000;

/// A bit of the image that can be chosen: what is kept up there, where, and which one.
pub(super) type Place = (Kind, usize, usize);

/// A graph in which nodes that are equal are one.
pub(super) struct Known {
    deadline: Deadline,
    pub(super) graph: Graph,
    inputs: FxHashMap<Place, Lit>,
    results: FxHashMap<(Function, Vec<Lit>), Vec<Lit>>,
    /// What takes the place of nodes that are equal to others.
    same: FxHashMap<u32, Lit>,
    /// Literals that no window shows to be equal.
    tried: FxHashSet<(Lit, Lit)>,
    pub(super) whole: Whole,
}

impl Known {
    pub(super) fn new(deadline: Deadline) -> Self {
        Self {
            deadline,
            graph: Graph::default(),
            inputs: FxHashMap::default(),
            results: FxHashMap::default(),
            same: FxHashMap::default(),
            tried: FxHashSet::default(),
            whole: Whole::new(deadline),
        }
    }

    /// Forgets what has become too large before another label is looked at.
    pub(super) fn shrink(&mut self) {
        if self.graph.len() > MOST_NODES {
            *self = Self::new(self.deadline);
        } else if self.whole.told.len() > MOST_CARRIED {
            self.renew();
        }
    }

    /// Another solver.
    pub(super) fn renew(&mut self) {
        self.whole = Whole::new(self.deadline);
    }

    /// The input for a bit of the image.
    pub(super) fn input(&mut self, place: Place) -> Lit {
        *self.inputs.entry(place).or_insert_with(|| self.graph.input())
    }

    /// The results of a function with some operands.
    pub(super) fn results(&mut self, key: &(Function, Vec<Lit>), width: usize) -> Vec<Lit> {
        let known = self.results.get(key).filter(|it| it.len() == width);
        known.cloned().unwrap_or_else(|| {
            let new = self.graph.inputs(width);
            self.results.insert(key.clone(), new.clone());
            new
        })
    }

    /// What takes the place of a literal.
    pub(super) fn resolve(&self, mut lit: Lit) -> Lit {
        while let Some(other) = self.same.get(&lit.node()) {
            lit = other.complement_if(lit.is_complement());
        }
        lit
    }

    /// Has a literal that is equal to another one take its place.
    pub(super) fn equate(&mut self, lit: Lit, other: Lit) {
        let (lit, other) = (self.resolve(lit), self.resolve(other));
        if lit.node() != other.node() {
            self.same.insert(lit.node(), other.complement_if(lit.is_complement()));
        }
    }

    /// Whether windows were tried in vain to show that two literals are equal.
    pub(super) fn is_tried(&self, a: Lit, b: Lit) -> bool {
        self.tried.contains(&pair(a, b))
    }

    pub(super) fn note_tried(&mut self, a: Lit, b: Lit) {
        self.tried.insert(pair(a, b));
    }

    /// Whether a literal can be true where nothing is known of what lies beyond `size` nodes; and with which values of inputs, if
    /// nothing lies beyond.
    pub(super) fn window(&self, lit: Lit, size: usize) -> (Answer, Option<FxHashMap<u32, bool>>) {
        let window = Window::new(&self.graph, lit, size);
        if let Some(values) = window.values() {
            return (Answer::Yes, window.is_whole.then_some(values));
        }
        let mut sat = Sat::new(self.deadline);
        sat.set_steps(Some(STEPS));
        window.ask(&mut sat)
    }
}

/// Two literals, the same two as their complements.
fn pair(a: Lit, b: Lit) -> (Lit, Lit) {
    let (a, b) = (a.min(b), a.max(b));
    (a.complement_if(a.is_complement()), b.complement_if(a.is_complement()))
}

/// A solver that is told of a graph as far as it is asked about.
pub(super) struct Whole {
    pub(super) sat: Sat,
    pub(super) told: Told,
    /// Applications of which it knows all, by the first of their results.
    pub(super) defined: FxHashSet<Lit>,
}

impl Whole {
    pub(super) fn new(deadline: Deadline) -> Self {
        Self { sat: Sat::new(deadline), told: Told::default(), defined: FxHashSet::default() }
    }

    pub(super) fn tell(&mut self, graph: &Graph, lit: Lit) -> SatLit {
        self.told.tell(&mut self.sat, graph, lit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::logic::FALSE;

    #[test]
    fn what_takes_the_place_of_a_literal_is_followed_with_its_complements() {
        let mut known = Known::new(Deadline::default());
        let [a, b, c] = [0, 1, 2].map(|bit| known.input((Kind::Bits, 7, bit)));
        assert_eq!(known.input((Kind::Bits, 7, 1)), b);
        known.equate(c, !b);
        known.equate(b, !a);
        assert_eq!((known.resolve(c), known.resolve(!c)), (a, !a));
        // What is equal already stays.
        known.equate(c, a);
        known.equate(!a, FALSE);
        assert_eq!([a, b, c].map(|lit| known.resolve(lit)), [!FALSE, FALSE, !FALSE]);
    }

    #[test]
    fn a_pair_that_was_tried_is_the_same_in_each_order_and_as_its_complements() {
        let mut known = Known::new(Deadline::default());
        let [a, b] = [0, 1].map(|bit| known.input((Kind::Bits, 0, bit)));
        known.note_tried(a, !b);
        let same = [(a, !b), (!b, a), (!a, b), (b, !a)];
        assert_eq!(same.map(|(a, b)| known.is_tried(a, b)), [true; 4]);
        let others = [(a, b), (b, a), (!a, !b), (!b, !a)];
        assert_eq!(others.map(|(a, b)| known.is_tried(a, b)), [false; 4]);
    }

    /// A graph that is too large is forgotten as a whole, and a solver that was told too much alone.
    #[test]
    fn what_is_too_large_is_forgotten() {
        let mut known = Known::new(Deadline::default());
        let bits = known.graph.inputs(MOST_CARRIED + 2);
        let all = known.graph.all(bits);
        let _ = known.whole.tell(&known.graph, all);
        known.equate(all, FALSE);
        known.shrink();
        assert_eq!(known.whole.told.len(), 0);
        assert_eq!(known.resolve(all), FALSE);
        known.graph.inputs(MOST_NODES);
        known.shrink();
        assert!(known.graph.len() < MOST_NODES);
        assert_eq!(known.resolve(all), all);
    }
}
