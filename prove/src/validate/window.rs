//! A part of a graph near a literal, of which it is asked whether the literal can be true.

use std::collections::BinaryHeap;

use fastrand::Rng;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::logic::{Graph, Lit, Node};
use crate::solve::{Answer, Sat};

/// How often values are guessed, 64 at once, before a solver is asked.
const GUESSES: usize = 4;

/// The nodes that a literal depends on, up to a number of conjunctions; what lies beyond may have any value.
pub(super) struct Window {
    goal: Lit,
    /// The nodes, each before those that it depends on, with the operands of conjunctions, by their places here.
    nodes: Vec<(u32, Option<(Lit, Lit)>)>,
    /// Whether nothing lies beyond.
    pub(super) is_whole: bool,
}

/// What values of 64 runs have to be: in which of them a node has to be true, and in which false.
#[derive(Clone, Copy, Default)]
struct Wanted {
    yes: u64,
    no: u64,
}

impl Wanted {
    /// The same of the complement, if `is_complement`.
    fn of(self, lit: Lit) -> Self {
        if lit.is_complement() { Self { yes: self.no, no: self.yes } } else { self }
    }
}

impl Window {
    pub(super) fn new(graph: &Graph, lit: Lit, size: usize) -> Self {
        let mut places: FxHashMap<u32, u32> = FxHashMap::default();
        let mut queue = BinaryHeap::from([lit.node()]);
        let mut queued = FxHashSet::from_iter([lit.node()]);
        let (mut nodes, mut is_whole, mut ands) = (vec![], true, 0);
        while let Some(node) = queue.pop() {
            places.insert(node, nodes.len() as u32);
            let operands = match graph.node(node) {
                Node::And(..) if ands >= size => {
                    is_whole = false;
                    None
                }
                Node::And(a, b) => {
                    ands += 1;
                    queue.extend([a.node(), b.node()].into_iter().filter(|&it| queued.insert(it)));
                    Some((a, b))
                }
                Node::False | Node::Input => None,
            };
            nodes.push((node, operands));
        }
        let place = |lit: Lit| {
            let place = places.get(&lit.node()).copied().unwrap_or(0);
            Lit::of_node(place).complement_if(lit.is_complement())
        };
        for (_, operands) in &mut nodes {
            *operands = operands.map(|(a, b)| (place(a), place(b)));
        }
        Self { goal: place(lit), nodes, is_whole }
    }

    /// Values of its nodes without operands with which the literal is true, if a few guesses find them. Each guess goes from the literal down: where
    /// a conjunction has to be false, one of its operands is chosen to be.
    pub(super) fn values(&self) -> Option<FxHashMap<u32, bool>> {
        let mut random = Rng::with_seed(0);
        for _ in 0..GUESSES {
            let mut wanted = vec![Wanted::default(); self.nodes.len()];
            let want = |wanted: &mut [Wanted], lit: Lit, new: Wanted| {
                if let Some(slot) = wanted.get_mut(lit.node() as usize) {
                    let new = new.of(lit);
                    *slot = Wanted { yes: slot.yes | new.yes, no: slot.no | new.no };
                }
            };
            let get = |wanted: &[Wanted], lit: Lit| {
                wanted.get(lit.node() as usize).copied().unwrap_or_default().of(lit)
            };
            want(&mut wanted, self.goal, Wanted { yes: u64::MAX, no: 0 });
            for (at, (_, operands)) in self.nodes.iter().enumerate() {
                let Some((a, b)) = *operands else { continue };
                let Wanted { yes, no } = wanted.get(at).copied().unwrap_or_default();
                let (x, y) = (get(&wanted, a), get(&wanted, b));
                let open = no & !yes & !(x.no | y.no);
                let first = open & (y.yes | !x.yes & random.u64(..));
                want(&mut wanted, a, Wanted { yes, no: first });
                want(&mut wanted, b, Wanted { yes, no: open & !first });
            }
            let mut values = vec![0_u64; self.nodes.len()];
            let value = |values: &[u64], lit: Lit| {
                let word = values.get(lit.node() as usize).copied().unwrap_or(0);
                if lit.is_complement() { !word } else { word }
            };
            for (at, (node, operands)) in self.nodes.iter().enumerate().rev() {
                let word = match *operands {
                    Some((a, b)) => value(&values, a) & value(&values, b),
                    None if *node == 0 => 0,
                    None => {
                        let Wanted { yes, no } = wanted.get(at).copied().unwrap_or_default();
                        yes | !no & random.u64(..)
                    }
                };
                if let Some(slot) = values.get_mut(at) {
                    *slot = word;
                }
            }
            let lanes = value(&values, self.goal);
            if lanes != 0 {
                let lane = lanes.trailing_zeros();
                let leaves = self.nodes.iter().zip(&values).filter(|((_, it), _)| it.is_none());
                return Some(
                    leaves.map(|((node, _), word)| (*node, word >> lane & 1 == 1)).collect(),
                );
            }
        }
        None
    }

    /// Whether the literal can be true, as a solver finds it out; and with which values, if nothing lies beyond.
    pub(super) fn ask(&self, sat: &mut Sat) -> (Answer, Option<FxHashMap<u32, bool>>) {
        let variables: Vec<_> = self.nodes.iter().map(|_| sat.variable()).collect();
        let get = |lit: Lit| {
            let own = variables.get(lit.node() as usize).copied();
            own.map(|it| if lit.is_complement() { !it } else { it })
        };
        for ((node, operands), &variable) in self.nodes.iter().zip(&variables) {
            match *operands {
                Some((a, b)) => {
                    if let (Some(a), Some(b)) = (get(a), get(b)) {
                        sat.define_and(variable, a, b);
                    }
                }
                None if *node == 0 => sat.add(&[!variable]),
                None => {}
            }
        }
        let Some(goal) = get(self.goal) else { return (Answer::Unknown, None) };
        let answer = sat.solve(&[goal]);
        let values = (answer == Answer::Yes && self.is_whole).then(|| {
            let leaves = self.nodes.iter().zip(&variables).filter(|((_, it), _)| it.is_none());
            leaves.map(|((node, _), &it)| (*node, sat.value(it))).collect()
        });
        (answer, values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::Deadline;

    /// What a solver that sees `size` nodes, and guesses, say of a literal.
    fn found(graph: &Graph, lit: Lit, size: usize) -> (Answer, bool, bool) {
        let window = Window::new(graph, lit, size);
        let (answer, values) = window.ask(&mut Sat::new(Deadline::default()));
        (answer, values.is_some(), window.values().is_some())
    }

    /// The parity of some bits, computed from each end: the logic differs, the value does not.
    fn parities(graph: &mut Graph) -> (Lit, Lit) {
        let bits = graph.inputs(8);
        let one = bits.iter().fold(Lit::constant(false), |all, &bit| graph.xor(all, bit));
        let other = bits.iter().rev().fold(Lit::constant(false), |all, &bit| graph.xor(all, bit));
        (one, other)
    }

    #[test]
    fn what_can_not_be_true_is_seen_where_enough_of_the_graph_is_seen() {
        let mut graph = Graph::default();
        let (one, other) = parities(&mut graph);
        let differ = graph.xor(one, other);
        assert_eq!(found(&graph, differ, 400), (Answer::No, false, false));
        // Whatever lies beyond may have any value, so that the answer is none.
        let (answer, values, _) = found(&graph, differ, 3);
        assert_eq!((answer, values), (Answer::Yes, false));
        assert!(!Window::new(&graph, differ, 3).is_whole);
    }

    #[test]
    fn values_with_which_a_literal_is_true_make_it_true() {
        let mut graph = Graph::default();
        let (one, other) = parities(&mut graph);
        let more = graph.inputs(3);
        let first = graph.or(one, !more[0]);
        let second = graph.choose(more[1], !other, more[2]);
        for lit in [one, !one, first, graph.and(first, second), graph.and(one, other)] {
            let window = Window::new(&graph, lit, 400);
            assert!(window.is_whole);
            let (_, solved) = window.ask(&mut Sat::new(Deadline::default()));
            // Guesses need not find any; those that they find count.
            for values in solved.into_iter().chain(window.values()) {
                assert!(value(&graph, lit, &values), "{lit:?} {values:?}");
            }
        }
        assert!(Window::new(&graph, first, 400).values().is_some());
    }

    /// The value of a literal where its inputs have these.
    fn value(graph: &Graph, lit: Lit, values: &FxHashMap<u32, bool>) -> bool {
        let own = match graph.node(lit.node()) {
            Node::False => false,
            Node::Input => values[&lit.node()],
            Node::And(a, b) => value(graph, a, values) && value(graph, b, values),
        };
        own != lit.is_complement()
    }
}
