//! A graph computed for many inputs at once, 64 in a word.

use rustc_hash::FxHasher;
use std::hash::{Hash, Hasher};

use super::terms::{Application, Terms};
use super::universe::{Kind, Universe};
use crate::logic::{Graph, Lit, Node};

/// Values of all nodes of a graph, 64 at once.
#[derive(Debug)]
pub(super) struct Simulation<'g> {
    graph: &'g Graph,
    terms: &'g Terms,
    /// The value of each node.
    pub(super) values: Vec<u64>,
    /// For each node that is the first of the results of an application, that one.
    first: Vec<(u32, usize)>,
    seed: u64,
}

impl<'g> Simulation<'g> {
    pub(super) fn new(graph: &'g Graph, terms: &'g Terms) -> Self {
        let first = terms.list.iter().enumerate();
        let mut first: Vec<(u32, usize)> =
            first.filter_map(|(at, it)| Some((it.results.first()?.node(), at))).collect();
        first.sort_unstable();
        Self { graph, terms, values: vec![0; graph.len()], first, seed: 0x9E37_79B9_7F4A_7C15 }
    }

    pub(super) fn random(&mut self) -> u64 {
        // xorshift64*, which is the same on each computer.
        self.seed ^= self.seed >> 12;
        self.seed ^= self.seed << 25;
        self.seed ^= self.seed >> 27;
        self.seed.wrapping_mul(0x2545_F491_4F6C_DD1D)
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

    /// Puts a number into some bits in one of the runs.
    fn put(&mut self, bits: &[Lit], lane: u32, number: u64) {
        for (at, &lit) in bits.iter().enumerate() {
            let old = self.get(lit) & !(1 << lane);
            self.set(lit, old | (number >> at.min(63) & 1) << lane);
        }
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
            for lane in 0..64 {
                let number = match cell.kind {
                    Kind::Double => self.random_double(constants),
                    _ => self.random_number(constants),
                };
                self.put(own, lane, number);
            }
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

    /// Computes all nodes from the inputs. What is known of functions that are not computed is computed too; what happens depends on all
    /// that it depends on. `keep` says that the results of what happens are those that were put there.
    pub(super) fn run(&mut self, keep: bool) {
        let mut next = 0;
        for node in 0..self.graph.len() as u32 {
            if self.first.get(next).is_some_and(|(first, _)| *first == node) {
                let application = self.first.get(next).and_then(|(_, at)| self.terms.list.get(*at));
                next += 1;
                if let Some(application) = application {
                    self.apply(application, keep);
                }
            }
            if let Node::And(a, b) = self.graph.node(node) {
                let value = self.get(a) & self.get(b);
                self.set(Lit::of_node(node), value);
            }
        }
    }

    fn apply(&mut self, application: &Application, keep: bool) {
        if application.function.is_event() {
            if !keep {
                self.happen(application);
            }
            return;
        }
        let widths = application.function.widths();
        for lane in 0..64 {
            let mut operands = vec![];
            let mut rest = application.operands.as_slice();
            for &width in &widths {
                let (own, others) = rest.split_at(width.min(rest.len()));
                operands.push(self.number(own, lane));
                rest = others;
            }
            if let Some(value) = application.function.value(&operands) {
                self.put(&application.results, lane, value);
            }
        }
    }

    fn happen(&mut self, application: &Application) {
        let mut sums = [0_u64; 64];
        for &lit in &application.operands {
            let word = self.get(lit);
            for (lane, sum) in sums.iter_mut().enumerate() {
                *sum =
                    (sum.rotate_left(5) ^ (word >> lane & 1)).wrapping_mul(0x517C_C1B7_2722_0A95);
            }
        }
        for (lane, sum) in sums.iter().enumerate() {
            let mut hasher = FxHasher::default();
            (sum, application.function).hash(&mut hasher);
            let mut word = hasher.finish();
            for &lit in &application.results {
                word ^= word >> 12;
                word ^= word << 25;
                word ^= word >> 27;
                let bit = word.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 63;
                let old = self.get(lit) & !(1 << lane);
                self.set(lit, old | bit << lane);
            }
        }
    }
}
