//! What comes to a place on several ways becomes one.
//!
//! A bit that differs is chosen by the conditions on which control came with each of its values: so the logic of two versions is the same
//! function where one of them goes other ways to the same end, also for ways that do not come about.

use std::collections::{BTreeMap, BTreeSet};

use rustc_hash::{FxHashMap, FxHashSet};

use super::walk::Place;
use crate::logic::{FALSE, Graph, Lit, Memory, Node};
use crate::scan::Arrival;

/// How many ways are kept apart until they are joined.
const MOST: usize = 16;

/// How many factors of a condition are looked at.
const MOST_FACTORS: usize = 256;

/// The conjunctions and other literals that all have to be true for a literal to be, itself among them.
fn factors(graph: &Graph, lit: Lit) -> FxHashSet<Lit> {
    let (mut open, mut all) = (vec![lit], FxHashSet::default());
    while let Some(lit) = open.pop() {
        if all.insert(lit) && all.len() < MOST_FACTORS {
            open.extend(operands(graph, lit).into_iter().flatten());
        }
    }
    all
}

/// What a conjunction is made of.
fn operands(graph: &Graph, lit: Lit) -> Option<[Lit; 2]> {
    match graph.node(lit.node()) {
        Node::And(a, b) if !lit.is_complement() => Some([a, b]),
        _ => None,
    }
}

/// Ways that come together, of which at most one comes about.
struct Ways<'g> {
    graph: &'g mut Graph,
    /// The condition of each way, without the factors that all have.
    conds: Vec<Lit>,
    /// The conditions on which one of some ways comes about.
    any: FxHashMap<Vec<usize>, Lit>,
}

impl<'g> Ways<'g> {
    /// Some ways with their conditions; and the condition on which one of them comes about.
    fn new(graph: &'g mut Graph, conds: &[Lit]) -> (Self, Lit) {
        let all: Vec<FxHashSet<Lit>> = conds.iter().map(|&cond| factors(graph, cond)).collect();
        let mut common = BTreeSet::new();
        let own = conds.iter().map(|&cond| {
            let (mut open, mut rest) = (vec![cond], BTreeSet::new());
            while let Some(lit) = open.pop() {
                // What all have is left out as a whole, and a test that ends otherwise on another way is kept as a whole.
                let is_kept = || all.iter().any(|other| other.contains(&!lit));
                match operands(graph, lit) {
                    _ if all.iter().all(|other| other.contains(&lit)) => {
                        common.insert(lit);
                    }
                    Some(operands) if rest.len() + open.len() < MOST_FACTORS && !is_kept() => {
                        open.extend(operands);
                    }
                    _ => {
                        rest.insert(lit);
                    }
                }
            }
            graph.all(rest)
        });
        let conds: Vec<Lit> = own.collect();
        let mut this = Self { graph, conds, any: FxHashMap::default() };
        let either = this.any((0..this.conds.len()).collect());
        let common = this.graph.all(common);
        let cond = this.graph.and(common, either);
        (this, cond)
    }

    fn any(&mut self, ways: Vec<usize>) -> Lit {
        if let Some(&known) = self.any.get(&ways) {
            return known;
        }
        let mut conds: Vec<Lit> =
            ways.iter().filter_map(|&way| self.conds.get(way).copied()).collect();
        conds.sort_unstable();
        let any = self.graph.any(conds);
        self.any.insert(ways, any);
        any
    }

    /// The literal that is one of `lits`, that of the way that comes about.
    fn choose(&mut self, lits: &[Lit]) -> Lit {
        let Some((&first, rest)) = lits.split_first() else { return FALSE };
        if rest.iter().all(|lit| *lit == first) {
            return first;
        }
        let mut groups: BTreeMap<Lit, Vec<usize>> = BTreeMap::new();
        for (way, &lit) in lits.iter().enumerate() {
            groups.entry(lit).or_default().push(way);
        }
        let mut chosen = FALSE;
        for (lit, ways) in groups {
            let cond = self.any(ways);
            let this = self.graph.and(cond, lit);
            chosen = self.graph.or(chosen, this);
        }
        chosen
    }

    fn memory(&mut self, all: &[&Memory]) -> Memory {
        Memory::joined(all, &mut |lits| self.choose(lits))
    }
}

/// Adds what comes to a place on one more way.
pub(super) fn add(graph: &mut Graph, places: &mut Vec<Place>, new: Place) {
    places.push(new);
    if places.len() == MOST {
        let one = joined(graph, std::mem::take(places));
        places.extend(one);
    }
}

/// What comes to a place; `None` if nothing does.
pub(super) fn joined(graph: &mut Graph, mut places: Vec<Place>) -> Option<Place> {
    if places.len() < 2 {
        return places.pop();
    }
    let conds: Vec<Lit> = places.iter().map(|it| it.arrival.cond).collect();
    let (mut ways, cond) = Ways::new(graph, &conds);
    let memories: Vec<&Memory> = places.iter().map(|it| &it.arrival.memory).collect();
    let memory = ways.memory(&memories);
    let locals: Vec<&Memory> = places.iter().map(|it| &it.local).collect();
    let local = ways.memory(&locals);
    let histories: Vec<Lit> = places.iter().map(|it| it.history).collect();
    let history = ways.choose(&histories);
    let mut values: BTreeMap<u32, Vec<Lit>> = BTreeMap::new();
    let numbers = places.iter().flat_map(|it| it.arrival.values.keys().copied());
    for number in numbers.collect::<BTreeSet<_>>() {
        // Where a way has not computed a value, nothing uses it.
        let own = |it: &Place| it.arrival.values.get(&number).cloned();
        let some = places.iter().find_map(own).unwrap_or_default();
        let all: Vec<Vec<Lit>> =
            places.iter().map(|it| own(it).unwrap_or_else(|| some.clone())).collect();
        let bits = (0..some.len()).map(|bit| {
            let lits: Vec<Lit> =
                all.iter().map(|own| own.get(bit).copied().unwrap_or(FALSE)).collect();
            ways.choose(&lits)
        });
        values.insert(number, bits.collect());
    }
    let arrival = Arrival { cond, memory, values, passed: 0 };
    Some(Place { arrival, history, local })
}
