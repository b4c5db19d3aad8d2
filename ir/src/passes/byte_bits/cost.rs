//! Where bits have to be unpacked and packed, and for which words that pays.

use super::super::graph::Graph;
use super::super::thresholds::byte_bits::{COLD, MIN_SAVED, PACK_GROUP, STATE, UNPACK_GROUP};
use super::analysis::{Access, Found};
use super::word::WordSet;
use crate::{Block, FuncData, Inst, InstData, IntCond, PrimaryMap, Terminator};

/// Whether a block ends with a branch that tests whether a number, of which there are more than two, is a constant.
fn tests_a_state(func: &FuncData, block: Block) -> bool {
    let Some(&Terminator::Brif { cond, .. }) = func.block(block).terminator.as_ref() else {
        return false;
    };
    let constant = match func.def_inst(cond) {
        Some(&InstData::Icmp { cond: IntCond::Eq, args: [_, by] }) => func.constant(by),
        _ => None,
    };
    constant.is_some_and(|constant| !matches!(constant, 0 | 1))
}

/// How often each block is executed when the function is, estimated; `None` if the function has a loop.
pub(super) fn frequencies(func: &FuncData, graph: &Graph) -> Option<PrimaryMap<Block, f32>> {
    let mut frequencies = PrimaryMap::from(vec![0.0f32; func.block_count()]);
    let mut visited = PrimaryMap::from(vec![false; func.block_count()]);
    for &(_, entry) in func.entries() {
        frequencies[entry] = 1.0;
    }
    for &block in &graph.order {
        visited[block] = true;
        let frequency = frequencies[block];
        let mut targets = vec![];
        if let Some(terminator) = &func.block(block).terminator {
            terminator.for_each_block(|target, _| targets.push(target));
        }
        let is_cold = |target: &Block| func.block(*target).cold;
        let warm = targets.iter().filter(|target| !is_cold(target)).count().max(1);
        let is_state = tests_a_state(func, block);
        for (number, &target) in targets.iter().enumerate() {
            if visited[target] {
                return None;
            }
            let share = match (is_cold(&target), is_state && warm == 2, number) {
                (true, ..) => COLD,
                (_, true, 0) => STATE,
                (_, true, _) => 1.0 - STATE,
                _ => 1.0 / warm as f32,
            };
            let sum = &mut frequencies[target];
            *sum = (*sum + frequency * share).min(1.0);
        }
    }
    Some(frequencies)
}

/// Whether someone may see or change the image when an instruction is executed.
pub(super) fn is_barrier(data: &InstData) -> bool {
    match data {
        InstData::Store { at, .. } => at.volatile,
        data => data.has_effect(),
    }
}

/// Whether control leaves the function at the end of a block.
pub(super) fn is_exit(terminator: &Terminator) -> bool {
    terminator.successor(0).is_none()
}

/// Which words are unpacked and packed where.
pub(super) struct Flow {
    /// For each block the words that may have been changed at its beginning, since they were unpacked.
    pub(super) changed: PrimaryMap<Block, WordSet>,
    /// For each block the words that are needed at its end: that may be accessed before the next barrier or exit, or packed
    /// there.
    pub(super) needed: PrimaryMap<Block, WordSet>,
    /// The same at the beginning of each block.
    pub(super) needed_at_begin: PrimaryMap<Block, WordSet>,
}

/// The set of the word that an instruction accesses, empty if there is none; and whether the instruction writes it.
fn accessed(found: &Found, inst: Inst) -> (WordSet, bool) {
    match found.accesses.get(&inst) {
        Some(access) => (1 << access.word(), matches!(access, Access::Write { .. })),
        None => (0, false),
    }
}

impl Flow {
    /// For a function without loops.
    pub(super) fn new(func: &FuncData, graph: &Graph, found: &Found) -> Self {
        let count = func.block_count();
        let mut changed = PrimaryMap::from(vec![0; count]);
        let mut needed = changed.clone();
        let mut needed_at_begin = changed.clone();
        // For each block the words that are packed at its barriers, and at its end if that is an exit.
        let mut packed = PrimaryMap::from(vec![vec![]; count]);
        for &block in &graph.order {
            let mut set = changed[block];
            for &inst in &func.block(block).insts {
                if is_barrier(func.inst(inst)) {
                    packed[block].push(std::mem::take(&mut set));
                } else if let (word, true) = accessed(found, inst) {
                    set |= word;
                }
            }
            if let Some(terminator) = &func.block(block).terminator {
                terminator.for_each_block(|target, _| changed[target] |= set);
                if is_exit(terminator) {
                    packed[block].push(set);
                }
            }
        }
        // A word that is packed must have been unpacked whatever way control took there.
        for &block in graph.order.iter().rev() {
            let data = func.block(block);
            let mut set: WordSet = 0;
            if let Some(terminator) = &data.terminator {
                terminator.for_each_block(|target, _| set |= needed_at_begin[target]);
                if is_exit(terminator) {
                    set |= packed[block].pop().unwrap_or(0);
                }
            }
            needed[block] = set;
            for &inst in data.insts.iter().rev() {
                match is_barrier(func.inst(inst)) {
                    true => set = packed[block].pop().unwrap_or(0),
                    false => set |= accessed(found, inst).0,
                }
            }
            needed_at_begin[block] = set;
        }
        Self { changed, needed, needed_at_begin }
    }

    /// Calls `f` for each place where words are unpacked or packed: with the block, the words that are packed, and
    /// those that are unpacked after that.
    fn for_each_place(
        &self,
        func: &FuncData,
        graph: &Graph,
        found: &Found,
        mut f: impl FnMut(Block, WordSet, WordSet),
    ) {
        for &(_, entry) in func.entries() {
            f(entry, 0, self.needed_at_begin[entry]);
        }
        for &block in &graph.order {
            let data = func.block(block);
            let mut needed_after = needed_after_barriers(func, found, block, self.needed[block]);
            let mut set = self.changed[block];
            for &inst in &data.insts {
                if is_barrier(func.inst(inst)) {
                    f(block, set, needed_after.pop().unwrap_or(0));
                    set = 0;
                } else if let (word, true) = accessed(found, inst) {
                    set |= word;
                }
            }
            if data.terminator.as_ref().is_some_and(is_exit) {
                f(block, set, 0);
            }
        }
    }

    /// The words for which bytes save more than packing and unpacking cost, both in time and in code.
    pub(super) fn worthwhile(
        &self,
        func: &FuncData,
        graph: &Graph,
        found: &Found,
        frequencies: &PrimaryMap<Block, f32>,
    ) -> WordSet {
        let mut costs: Vec<(f32, u32)> = vec![(0.0, 0); found.words.len()];
        self.for_each_place(func, graph, found, |block, packed, unpacked| {
            let frequency = frequencies[block];
            for (number, (word, cost)) in found.words.iter().zip(&mut costs).enumerate() {
                let groups = |bits: u32| word.groups(bits).iter().count() as u32;
                let packing = (packed >> number & 1) as u32 * groups(word.written) * PACK_GROUP;
                let unpacking = (unpacked >> number & 1) as u32 * groups(word.used) * UNPACK_GROUP;
                cost.0 += frequency * (packing + unpacking) as f32;
                cost.1 += packing + unpacking;
            }
        });
        let (mut set, mut gain) = (0, 0.0);
        for (number, (word, (time, code))) in found.words.iter().zip(costs).enumerate() {
            if word.saved > time && word.saved_code > code {
                set |= 1 << number;
                gain += word.saved - time;
            }
        }
        if gain >= MIN_SAVED { set } else { 0 }
    }
}

/// For each barrier in a block, from the last to the first, the words that are needed after it, where those that are
/// needed at the end of the block are given.
pub(super) fn needed_after_barriers(
    func: &FuncData,
    found: &Found,
    block: Block,
    at_end: WordSet,
) -> Vec<WordSet> {
    let (mut set, mut all) = (at_end, vec![]);
    for &inst in func.block(block).insts.iter().rev() {
        if is_barrier(func.inst(inst)) {
            all.push(set);
            set = 0;
        } else {
            set |= accessed(found, inst).0;
        }
    }
    all
}
