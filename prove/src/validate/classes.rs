//! Nodes that have had the same values in all runs of a simulation.

use rustc_hash::FxHashMap;

use crate::logic::Lit;

/// How many runs are kept one by one before they are summed up.
const LATER: usize = 16;

/// Nodes by their values. A node and its complement are of one class.
#[derive(Debug)]
pub(super) struct Classes {
    /// For each node a number that sums up its values, as if those of its first run were 0.
    sums: Vec<u64>,
    /// The nodes whose value in the first run is 1.
    inverted: Vec<bool>,
    has_first: bool,
    /// Runs that the sums don't have yet.
    later: Vec<Vec<u64>>,
    /// Nodes that others are compared with, each with what takes its place, complemented where the node is inverted.
    noted: Vec<(u32, Lit)>,
    classes: FxHashMap<u64, Vec<(u32, Lit)>>,
}

impl Classes {
    /// The classes of a graph with a number of nodes, of which nothing is known yet.
    pub(super) fn new(nodes: usize) -> Self {
        Self {
            sums: vec![0; nodes],
            inverted: vec![false; nodes],
            has_first: false,
            later: vec![],
            noted: vec![],
            classes: FxHashMap::default(),
        }
    }

    /// The values of all nodes in a run, or 64 of them, before any node is noted.
    pub(super) fn add(&mut self, run: &[u64]) {
        if !std::mem::replace(&mut self.has_first, true) {
            for (inverted, word) in self.inverted.iter_mut().zip(run) {
                *inverted = word & 1 == 1;
            }
        }
        for ((sum, word), &inverted) in self.sums.iter_mut().zip(run).zip(&self.inverted) {
            let word = if inverted { !word } else { *word };
            *sum = (sum.rotate_left(23) ^ word).wrapping_mul(0x9FB2_1C65_1E98_DF25);
            *sum ^= *sum >> 31;
        }
    }

    /// The values of all nodes in a run that tells nodes apart.
    pub(super) fn add_later(&mut self, run: Vec<u64>) {
        self.later.push(run);
        if self.later.len() < LATER {
            return;
        }
        for run in std::mem::take(&mut self.later) {
            self.add(&run);
        }
        self.classes.clear();
        for &(node, lit) in &self.noted {
            let sum = self.sums.get(node as usize).copied().unwrap_or(0);
            self.classes.entry(sum).or_default().push((node, lit));
        }
    }

    /// What is known of the runs, without any node that others are compared with.
    pub(super) fn without_notes(mut self) -> Self {
        self.noted.clear();
        self.classes.clear();
        self
    }

    fn is_inverted(&self, node: u32) -> bool {
        self.inverted.get(node as usize).copied().unwrap_or(false)
    }

    /// A node with which others are compared from now on, and what takes its place.
    pub(super) fn note(&mut self, node: u32, lit: Lit) {
        let own = (node, lit.complement_if(self.is_inverted(node)));
        self.noted.push(own);
        let sum = self.sums.get(node as usize).copied().unwrap_or(0);
        self.classes.entry(sum).or_default().push(own);
    }

    /// What may be equal to a node: the `number`th node with its values, and the literal that takes the place of such a node.
    pub(super) fn like(&self, node: u32, number: usize) -> Option<(u32, Lit)> {
        let sum = self.sums.get(node as usize)?;
        let inverted = self.is_inverted(node);
        let same = |&&(other, _): &&(u32, Lit)| {
            self.later.iter().all(|run| self.is_same(run, node, other))
        };
        let &(other, lit) = self.classes.get(sum)?.iter().filter(same).nth(number)?;
        Some((other, lit.complement_if(inverted)))
    }

    /// Whether two nodes of a class have the same values in a run.
    pub(super) fn is_same(&self, run: &[u64], node: u32, other: u32) -> bool {
        let word = |node: u32| run.get(node as usize).copied().unwrap_or(0);
        let differs = if self.is_inverted(node) == self.is_inverted(other) { 0 } else { u64::MAX };
        word(node) ^ word(other) == differs
    }
}
