//! A graph computed for many inputs at once, 64 in a word.

use fastrand::Rng;
use rustc_hash::{FxHashMap, FxHashSet, FxHasher};
use std::hash::{Hash, Hasher};

use super::terms::{Application, Function};
use super::universe::{Kind, Universe};
use crate::logic::{Graph, Lit, Node};
use crate::solve::Deadline;

/// How many nodes are computed before the clock is read.
const NODES: usize = 8_192;

/// What functions that are not computed give.
#[derive(Clone, Copy, Debug)]
pub(super) enum Answers<'a> {
    /// What is known of them is computed; what happens depends on all that it depends on.
    Computed,
    /// The same, but what happens gives what was put there.
    Happened,
    /// The same, but some applications give what was put there, and others of the same function with the operands
    /// that those have in the first run.
    Near(&'a FxHashSet<usize>),
}

/// Rows become columns: bit `i` of word `k` is bit `k` of word `i` afterwards.
fn transpose(words: &mut [u64; 64]) {
    let (mut distance, mut mask) = (32, u64::MAX >> 32);
    while distance > 0 {
        for pair in words.chunks_exact_mut(2 * distance) {
            let (low, high) = pair.split_at_mut(distance);
            for (low, high) in low.iter_mut().zip(high) {
                let swapped = (*low >> distance ^ *high) & mask;
                *high ^= swapped;
                *low ^= swapped << distance;
            }
        }
        distance /= 2;
        mask ^= mask << distance;
    }
}

/// Values of all nodes of a graph, 64 at once.
#[derive(Debug)]
pub(super) struct Simulation<'g> {
    graph: &'g Graph,
    list: &'g [Application],
    /// The value of each node.
    pub(super) values: Vec<u64>,
    /// For each node that is the first of the results of an application, that one.
    first: Vec<(u32, usize)>,
    random: Rng,
}

impl<'g> Simulation<'g> {
    pub(super) fn new(graph: &'g Graph, list: &'g [Application]) -> Self {
        let first = list.iter().enumerate();
        let mut first: Vec<(u32, usize)> =
            first.filter_map(|(at, it)| Some((it.results.first()?.node(), at))).collect();
        first.sort_unstable();
        Self { graph, list, values: vec![0; graph.len()], first, random: Rng::with_seed(0) }
    }

    pub(super) fn random(&mut self) -> u64 {
        self.random.u64(..)
    }

    /// The value of a literal in all runs.
    pub(super) fn get(&self, lit: Lit) -> u64 {
        let value = self.values.get(lit.node() as usize).copied().unwrap_or(0);
        if lit.is_complement() { !value } else { value }
    }

    pub(super) fn set(&mut self, lit: Lit, value: u64) {
        if let Some(slot) = self.values.get_mut(lit.node() as usize) {
            *slot = if lit.is_complement() { !value } else { value };
        }
    }

    /// Puts a number into some bits in each of the runs.
    fn put(&mut self, bits: &[Lit], mut numbers: [u64; 64]) {
        transpose(&mut numbers);
        let last = numbers.last().copied().unwrap_or(0);
        for (at, &lit) in bits.iter().enumerate() {
            self.set(lit, numbers.get(at).copied().unwrap_or(last));
        }
    }

    /// The number that at most 64 bits are in each of the runs.
    fn numbers(&self, bits: &[Lit]) -> [u64; 64] {
        let mut words = [0; 64];
        for (word, &lit) in words.iter_mut().zip(bits) {
            *word = self.get(lit);
        }
        transpose(&mut words);
        words
    }

    /// A number for each run that depends on the values of literals: equal values give equal numbers.
    fn digests(&self, lits: &[Lit]) -> [u64; 64] {
        let mut sums = [0_u64; 64];
        for some in lits.chunks(64) {
            for (sum, number) in sums.iter_mut().zip(self.numbers(some)) {
                *sum = (sum.rotate_left(23) ^ number).wrapping_mul(0x9FB2_1C65_1E98_DF25);
                *sum ^= *sum >> 29;
            }
        }
        sums
    }

    /// The number that some bits are in one of the runs.
    pub(super) fn number(&self, bits: &[Lit], lane: u32) -> u64 {
        let bits = bits.iter().take(64).enumerate();
        bits.fold(0, |all, (at, &lit)| all | (self.get(lit) >> lane & 1) << at)
    }

    /// Puts random bits into the inputs that stand for an image. `constants` are numbers that the program compares with.
    pub(super) fn randomize(&mut self, universe: &Universe, raw: &[Lit], constants: &[i64]) {
        let mut rest = raw;
        let mut at = 0;
        while let Some(cell) = universe.cells.get(at) {
            // Bytes side by side are often one number.
            let is_plain = |ahead: usize| {
                universe
                    .cells
                    .get(at + ahead)
                    .is_some_and(|it| it.kind == Kind::Plain && it.offset == cell.offset + ahead)
            };
            let together = match cell.kind {
                Kind::Plain if cell.offset % 4 == 0 && (0..4).all(is_plain) => 4,
                Kind::Plain if cell.offset % 2 == 0 && (0..2).all(is_plain) => 2,
                _ => 1,
            };
            let width = cell.width() * together;
            let (own, others) = rest.split_at(width.min(rest.len()));
            rest = others;
            at += together;
            if cell.kind == Kind::Bits {
                let word = self.random();
                own.iter().for_each(|&lit| self.set(lit, word));
                continue;
            }
            let mut numbers = [0; 64];
            for number in &mut numbers {
                *number = match cell.kind {
                    Kind::Double => self.random_double(constants),
                    _ => self.random_number(constants),
                };
            }
            self.put(own, numbers);
        }
    }

    fn random_number(&mut self, constants: &[i64]) -> u64 {
        let random = self.random();
        match random % 8 {
            0 | 1 => random >> 32,
            2 => random >> 32 & 15,
            3 => 1 << (random >> 32 & 31),
            4 => 0,
            _ => {
                let which = (random >> 32) as usize % constants.len().max(1);
                let near = [0, 0, 0, 1, -1].get((random >> 8) as usize % 5).copied().unwrap_or(0);
                constants.get(which).map_or(random >> 32, |it| it.wrapping_add(near) as u64)
            }
        }
    }

    fn random_double(&mut self, constants: &[i64]) -> u64 {
        let random = self.random();
        let small = (random >> 32 & 255) as i64 - 128;
        match random % 8 {
            0 | 1 => (small as f64).to_bits(),
            2 => ((random as i64 >> 20) as f64 / 64.0).to_bits(),
            3 => random,
            4 => (random as i32 as f64).to_bits(),
            5 => 0,
            _ => {
                let which = (random >> 32) as usize % constants.len().max(1);
                let number = constants.get(which).copied().unwrap_or(small);
                if number.unsigned_abs() >> 52 == 0 {
                    ((number + (small >> 6)) as f64).to_bits()
                } else {
                    number as u64
                }
            }
        }
    }

    /// Computes all nodes from the inputs, with the results of functions that were put there.
    pub(super) fn keep_all(&mut self) {
        for node in 0..self.graph.len() as u32 {
            if let Node::And(a, b) = self.graph.node(node) {
                let value = self.get(a) & self.get(b);
                self.set(Lit::of_node(node), value);
            }
        }
    }

    /// Computes all nodes from the inputs; says whether there was time for it.
    pub(super) fn run(&mut self, answers: Answers<'_>, deadline: Deadline) -> bool {
        let mut known = FxHashMap::default();
        let mut next = 0;
        for node in 0..self.graph.len() as u32 {
            if node.is_multiple_of(NODES as u32) && deadline.is_over() {
                return false;
            }
            if let Some(&(_, at)) = self.first.get(next).filter(|(first, _)| *first == node) {
                next += 1;
                if let Some(application) = self.list.get(at) {
                    if application.operands.len() > NODES && deadline.is_over() {
                        return false;
                    }
                    match answers {
                        Answers::Happened if application.function.is_event() => {}
                        Answers::Near(chosen) => {
                            self.apply_near(application, chosen.contains(&at), &mut known);
                        }
                        _ => self.apply(application, None),
                    }
                }
            }
            if let Node::And(a, b) = self.graph.node(node) {
                let value = self.get(a) & self.get(b);
                self.set(Lit::of_node(node), value);
            }
        }
        true
    }

    fn apply(&mut self, application: &Application, digests: Option<[u64; 64]>) {
        let function = application.function;
        if function.is_event() {
            let digests = digests.unwrap_or_else(|| self.digests(&application.operands));
            self.happen(application, digests);
            return;
        }
        let mut operands = vec![];
        let mut rest = application.operands.as_ref();
        for width in function.widths() {
            let (own, others) = rest.split_at(width.min(rest.len()));
            operands.push(self.numbers(own));
            rest = others;
        }
        let mut results = [0; 64];
        for (lane, slot) in results.iter_mut().enumerate() {
            let own = operands.iter().map(|all| all.get(lane).copied().unwrap_or(0));
            let own: Vec<u64> = own.collect();
            *slot = function.value(&own).unwrap_or(0);
        }
        self.put(&application.results, results);
    }

    /// An application of which some runs have operands for which the result was chosen.
    fn apply_near(
        &mut self,
        application: &Application,
        is_chosen: bool,
        known: &mut FxHashMap<(Function, u64), Vec<bool>>,
    ) {
        let digests = self.digests(&application.operands);
        let function = application.function;
        if is_chosen && let Some(&first) = digests.first() {
            let bits = application.results.iter().map(|&lit| self.get(lit) & 1 == 1);
            known.entry((function, first)).or_insert_with(|| bits.collect());
        }
        self.apply(application, Some(digests));
        let mut done = 0_u64;
        for (lane, &digest) in digests.iter().enumerate() {
            let Some(bits) = known.get(&(function, digest)).filter(|_| done >> lane & 1 == 0)
            else {
                continue;
            };
            let same = digests.iter().enumerate().filter(|(_, other)| **other == digest);
            let lanes = same.fold(0, |all, (lane, _)| all | 1 << lane);
            done |= lanes;
            for (&lit, &bit) in application.results.iter().zip(bits) {
                let rest = self.get(lit) & !lanes;
                self.set(lit, rest | if bit { lanes } else { 0 });
            }
        }
    }

    fn happen(&mut self, application: &Application, digests: [u64; 64]) {
        let mut hasher = FxHasher::default();
        application.function.hash(&mut hasher);
        let mut random = digests.map(|digest| Rng::with_seed(digest ^ hasher.finish()));
        for some in application.results.chunks(64) {
            self.put(some, random.each_mut().map(|it| it.u64(..)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::transpose;

    #[test]
    fn rows_become_columns() {
        let mut words: [u64; 64] =
            std::array::from_fn(|row| (row as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let before = words;
        transpose(&mut words);
        for (row, word) in words.iter().enumerate() {
            for (column, other) in before.iter().enumerate() {
                assert_eq!(word >> column & 1, other >> row & 1);
            }
        }
    }
}
