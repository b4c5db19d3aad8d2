//! Bits of the state that are always the same, or the opposite of each other, or constant (van Eijk, 2000).
//!
//! Simulation suggests which may be: they are put into classes. Then it is assumed that all of a class are the same at the
//! beginning of a tick, and looked whether they are at its end; where not, the class is split. What is left is an invariant.

use std::collections::BTreeMap;

use fastrand::Rng;
use rustc_hash::{FxHashMap, FxHashSet};

use super::reachability::cone;
use super::sat::{Answer, Deadline};
use super::unroll::{Start, Unrolling};
use crate::logic::{FALSE, Graph, Lit, Node};
use crate::system::{First, Latch, System};

/// How many ticks are simulated, each with 64 runs at once.
const TICKS: usize = 96;

/// Runs of the system, 64 at once.
struct Simulation {
    /// The conjunctions that matter, each after those that it depends on.
    ands: Vec<(u32, Lit, Lit)>,
    values: Vec<u64>,
    random: Rng,
}

impl Simulation {
    fn get(&self, lit: Lit) -> u64 {
        let value = self.values.get(lit.node() as usize).copied().unwrap_or(0);
        if lit.is_complement() { !value } else { value }
    }

    fn set(&mut self, node: u32, value: u64) {
        if let Some(slot) = self.values.get_mut(node as usize) {
            *slot = value;
        }
    }

    /// Computes all nodes from the inputs.
    fn tick(&mut self) {
        let ands = std::mem::take(&mut self.ands);
        for &(node, a, b) in &ands {
            let value = self.get(a) & self.get(b);
            self.set(node, value);
        }
        self.ands = ands;
    }
}

/// A class: literals that may be the same, the first one standing for all.
type Class = Vec<Lit>;

/// Notes in a system which of the latches that some literals depend on are always the same as others.
pub fn correspond(system: &mut System, roots: &[Lit], deadline: Deadline) {
    let (mut latches, mut inputs) = (vec![], vec![]);
    for &root in roots {
        let (own, from_outside) = cone(system, root);
        latches.extend(own);
        inputs.extend(from_outside);
    }
    latches.sort_unstable();
    latches.dedup();
    inputs.sort_unstable();
    inputs.dedup();
    let latches: Vec<Latch> =
        latches.iter().filter_map(|&it| system.latches.get(it as usize).copied()).collect();
    let mut classes = suggested(system, &latches, &inputs);
    loop {
        system.same = classes
            .iter()
            .flat_map(|class| {
                let first = class.first().copied().unwrap_or(FALSE);
                class
                    .iter()
                    .skip(1)
                    .map(move |&lit| (lit.node(), first.complement_if(lit.is_complement())))
            })
            .collect();
        match split(system, &latches, &mut classes, deadline) {
            Some(true) => {}
            Some(false) => return,
            None => {
                system.same = FxHashMap::default();
                return;
            }
        }
    }
}

/// The conjunctions on which some literals depend, each after those that it depends on itself.
fn conjunctions(graph: &Graph, roots: impl Iterator<Item = Lit>) -> Vec<(u32, Lit, Lit)> {
    let mut open: Vec<u32> = roots.map(Lit::node).collect();
    let (mut seen, mut all) = (FxHashSet::default(), vec![]);
    while let Some(node) = open.pop() {
        if let Node::And(a, b) = graph.node(node)
            && seen.insert(node)
        {
            all.push((node, a, b));
            open.extend([a.node(), b.node()]);
        }
    }
    all.sort_unstable();
    all
}

/// The classes that simulation from power-up suggests.
fn suggested(system: &System, latches: &[Latch], inputs: &[Lit]) -> Vec<Class> {
    let ands = conjunctions(&system.builder.graph, latches.iter().map(|latch| latch.next));
    let values = vec![0; system.builder.graph.len()];
    let mut run = Simulation { ands, values, random: Rng::with_seed(0) };
    for latch in &system.latches {
        let value = match latch.first {
            First::Constant(true) => u64::MAX,
            First::Constant(false) | First::As(_) => 0,
            First::Free => run.random.u64(..),
        };
        run.set(latch.lit.node(), value);
    }
    for latch in &system.latches {
        if let First::As(other) = latch.first {
            let value = run.get(other);
            run.set(latch.lit.node(), value);
        }
    }
    let mut signatures: Vec<Vec<u64>> = vec![vec![]; latches.len()];
    for tick in 0..TICKS {
        for node in inputs.iter().map(|input| input.node()) {
            // Most inputs stay for some ticks, so that timers come to their ends.
            let mut random = || run.random.u64(..);
            let (new, change) = (random(), random() & random() & random());
            let change = if tick == 0 { u64::MAX } else { change };
            let old = run.get(Lit::of_node(node));
            run.set(node, old & !change | new & change);
        }
        for (signature, latch) in signatures.iter_mut().zip(latches) {
            signature.push(run.get(latch.lit));
        }
        run.tick();
        let next: Vec<u64> = latches.iter().map(|latch| run.get(latch.next)).collect();
        for (latch, value) in latches.iter().zip(next) {
            run.set(latch.lit.node(), value);
        }
    }
    let mut classes: BTreeMap<Vec<u64>, Class> = BTreeMap::new();
    classes.insert(vec![0; TICKS], vec![FALSE]);
    for (mut signature, latch) in signatures.into_iter().zip(latches) {
        let inverted = signature.first().is_some_and(|word| word & 1 == 1);
        if inverted {
            signature.iter_mut().for_each(|word| *word = !*word);
        }
        classes.entry(signature).or_default().push(latch.lit.complement_if(inverted));
    }
    let first_of: FxHashMap<u32, First> =
        latches.iter().map(|latch| (latch.lit.node(), latch.first)).collect();
    let mut all = vec![];
    for class in classes.into_values() {
        // At power-up all of a class must be the same, which is known of constants and of what was kept alike.
        let Some(&first) = class.first() else { continue };
        let is_constant = |lit: Lit| {
            lit.node() == 0 || matches!(first_of.get(&lit.node()), Some(First::Constant(_)))
        };
        let fits = |lit: &Lit| {
            *lit == first
                || is_constant(first) && is_constant(*lit)
                || first_of.get(&lit.node()) == Some(&First::As(Lit::of_node(first.node())))
                    && lit.is_complement() == first.is_complement()
        };
        let class: Class = class.into_iter().filter(fits).collect();
        if class.len() > 1 {
            all.push(class);
        }
    }
    all
}

/// Splits classes whose literals can differ at the end of a tick; says whether any was split, `None` if the time was up.
fn split(
    system: &System,
    latches: &[Latch],
    classes: &mut Vec<Class>,
    deadline: Deadline,
) -> Option<bool> {
    let next_of: FxHashMap<u32, Lit> =
        latches.iter().map(|latch| (latch.lit.node(), latch.next)).collect();
    let next = |lit: Lit| {
        let next = next_of.get(&lit.node()).copied().unwrap_or(FALSE);
        next.complement_if(lit.is_complement())
    };
    let mut unrolling = Unrolling::new(system, Start::Anywhere, deadline);
    let mut changed = false;
    let mut at = 0;
    while at < classes.len() {
        let mut other: Class = vec![];
        let class = classes.get_mut(at)?;
        let first = class.first().copied()?;
        let mut member = 1;
        while let Some(&lit) = class.get(member) {
            if deadline.is_over() {
                return None;
            }
            match unrolling.can_differ(0, next(first), next(lit)) {
                Answer::No => member += 1,
                Answer::Yes => {
                    // Others may differ in the same way: they are looked at together afterwards.
                    other.push(class.remove(member));
                    changed = true;
                }
                Answer::Unknown => return None,
            }
        }
        if other.len() > 1 {
            classes.push(other);
        }
        at += 1;
    }
    classes.retain(|class| class.len() > 1);
    Some(changed)
}
