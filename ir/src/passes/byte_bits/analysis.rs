//! Finds the words of which a function does nothing but read and write single bits.

use std::collections::{HashMap, HashSet};

use super::super::graph::Graph;
use super::{MAX_WORDS, WORD_BITS, Word};
use crate::{Address, BinaryOp, FuncData, Inst, InstData, RegionId, Type, Value};

/// What a read of a bit saves, in instructions: a shift, and a load that becomes an operand.
const SAVED_BY_READ: u32 = 2;
/// What a write of a bit saves, in instructions: the load of the word, two masks, a shift and an OR.
const SAVED_BY_WRITE: u32 = 4;

/// Every access of a word's bit, by the instruction that is changed.
#[derive(Clone, Copy, Debug)]
pub(super) enum Access {
    /// The instruction's result is the bit with this number, as an integer.
    Read { word: usize, bit: u32 },
    /// The instruction stores the word with this bit replaced: by the bit with the same number of a value.
    Write { word: usize, bit: u32, value: Value },
}

impl Access {
    /// The number of the word.
    pub(super) fn word(self) -> usize {
        match self {
            Self::Read { word, .. } | Self::Write { word, .. } => word,
        }
    }
}

/// What was found in a function.
pub(super) struct Found {
    pub(super) words: Vec<Word>,
    /// The accesses of their bits.
    pub(super) accesses: HashMap<Inst, Access>,
}

/// What a value is made of.
#[derive(Clone, Copy)]
enum Part {
    /// A word as it is in the image.
    Whole(usize),
    /// A word, shifted right by so many bits.
    Shifted(usize, u32),
    /// A word without this bit.
    Without(usize, u32),
    /// A word with this bit replaced by that of a value.
    Replaced(usize, u32, Value),
}

impl Part {
    fn word(self) -> usize {
        match self {
            Self::Whole(word)
            | Self::Shifted(word, _)
            | Self::Without(word, _)
            | Self::Replaced(word, ..) => word,
        }
    }
}

/// A value that is made of a word.
#[derive(Clone, Copy)]
struct Made {
    part: Part,
    /// The number of the instruction that made it.
    at: u32,
    /// How many of its uses are such as bytes can replace.
    uses: u32,
}

/// A word that may turn out to be used in other ways, too.
struct Candidate {
    word: Word,
    refused: bool,
    /// The number of the instruction that stored it last.
    stored: u32,
}

/// A function that is searched.
struct Search<'a> {
    func: &'a FuncData,
    regions: &'a [RegionId],
    candidates: Vec<Candidate>,
    /// The number of the candidate at an address.
    numbers: HashMap<(RegionId, u32), usize>,
    /// For each value what it is made of, if that is known.
    made: Vec<Option<Made>>,
    /// The number of the current instruction.
    now: u32,
    /// The number of the last instruction in this block that may have changed any word, or of the block's first one.
    since: u32,
    accesses: HashMap<Inst, Access>,
    /// Places in the regions of words that are accessed in other ways.
    others: HashSet<(RegionId, u32)>,
    /// Regions of words that are accessed by an index.
    indexed: HashSet<RegionId>,
}

/// Finds the words, and what bytes would save in each, by how often blocks are executed.
pub(super) fn find(
    func: &FuncData,
    graph: &Graph,
    regions: &[RegionId],
    frequencies: &[f32],
) -> Found {
    let mut search = Search {
        func,
        regions,
        candidates: vec![],
        numbers: HashMap::new(),
        made: vec![None; func.value_count()],
        now: 0,
        since: 0,
        accesses: HashMap::new(),
        others: HashSet::new(),
        indexed: HashSet::new(),
    };
    for &block in &graph.order {
        search.now += 1;
        search.since = search.now;
        let data = func.block(block);
        let frequency = frequencies.get(block.index()).copied().unwrap_or(0.0);
        for &inst in &data.insts {
            search.now += 1;
            search.inst(inst, frequency);
        }
    }
    search.finish()
}

impl Search<'_> {
    /// Whether an access is one of a whole word at a fixed place.
    fn is_word(&self, at: &Address, ty: Type) -> bool {
        ty == Type::I32
            && at.index.is_none()
            && !at.volatile
            && at.offset.is_multiple_of(4)
            && self.regions.contains(&at.region)
    }

    /// The number of the word at an address.
    fn number(&mut self, at: Address) -> usize {
        let candidates = &mut self.candidates;
        *self.numbers.entry((at.region, at.offset)).or_insert_with(|| {
            let word = Word { at, used: 0, written: 0, saved: 0.0, saved_code: 0, slot: 0 };
            candidates.push(Candidate { word, refused: false, stored: 0 });
            candidates.len() - 1
        })
    }

    /// Notes that a value is made of a word.
    fn define(&mut self, value: Option<Value>, part: Part) {
        let at = self.now;
        if let Some(slot) = value.and_then(|value| self.made.get_mut(value.index())) {
            *slot = Some(Made { part, at, uses: 0 });
        }
    }

    /// What a value is made of, if that is still what the word is.
    fn part(&self, value: Value) -> Option<Part> {
        let made = (*self.made.get(value.index())?)?;
        let stored = self.candidates.get(made.part.word())?.stored;
        (made.at > stored.max(self.since)).then_some(made.part)
    }

    /// Counts a use of a value as one that bytes can replace.
    fn count(&mut self, value: Value) {
        if let Some(Some(made)) = self.made.get_mut(value.index()) {
            made.uses += 1;
        }
    }

    /// Notes an access of a bit.
    fn access(&mut self, inst: Inst, access: Access, frequency: f32) {
        let (word, bit, written, saved) = match access {
            Access::Read { word, bit } => (word, bit, 0, SAVED_BY_READ),
            Access::Write { word, bit, .. } => (word, bit, 1 << bit, SAVED_BY_WRITE),
        };
        self.accesses.insert(inst, access);
        if let Some(Candidate { word, .. }) = self.candidates.get_mut(word) {
            word.used |= 1 << bit;
            word.written |= written;
            word.saved += frequency * saved as f32;
            word.saved_code += saved;
        }
    }

    fn inst(&mut self, inst: Inst, frequency: f32) {
        let func = self.func;
        match *func.inst(inst) {
            InstData::Load { ty, at } if self.is_word(&at, ty) => {
                let word = self.number(at);
                self.define(func.result(inst), Part::Whole(word));
            }
            InstData::Store { at, value } if self.is_word(&at, func.ty(value)) => {
                let word = self.number(at);
                let replaced = match self.part(value) {
                    Some(Part::Replaced(of, bit, by)) if of == word => Some((bit, by)),
                    _ => None,
                };
                if let Some((bit, by)) = replaced {
                    self.count(value);
                    self.access(inst, Access::Write { word, bit, value: by }, frequency);
                }
                if let Some(candidate) = self.candidates.get_mut(word) {
                    candidate.refused |= replaced.is_none();
                    candidate.stored = self.now;
                }
            }
            InstData::Load { ty, at } => self.other(&at, ty),
            InstData::Store { at, value } => self.other(&at, func.ty(value)),
            InstData::Binary { op, args } => self.binary(inst, op, args, frequency),
            data if data.has_effect() => self.since = self.now,
            _ => {}
        }
    }

    /// Notes an access that is none of a whole word.
    fn other(&mut self, at: &Address, ty: Type) {
        if at.volatile {
            self.since = self.now;
        }
        if !self.regions.contains(&at.region) {
            return;
        }
        if at.index.is_some() {
            self.indexed.insert(at.region);
            return;
        }
        let last = at.offset.saturating_add(ty.bytes() - 1);
        for offset in [at.offset & !3, last & !3] {
            self.others.insert((at.region, offset));
        }
    }

    fn binary(&mut self, inst: Inst, op: BinaryOp, [a, b]: [Value; 2], frequency: f32) {
        let func = self.func;
        let result = func.result(inst);
        let constant = func.constant(b).map(|constant| constant as u32);
        match (op, self.part(a), constant) {
            (BinaryOp::Lshr, Some(Part::Whole(word)), Some(by @ 1..WORD_BITS)) => {
                self.count(a);
                self.define(result, Part::Shifted(word, by));
            }
            (BinaryOp::And, Some(Part::Whole(word)), Some(1)) => {
                self.count(a);
                self.access(inst, Access::Read { word, bit: 0 }, frequency);
            }
            (BinaryOp::And, Some(Part::Shifted(word, bit)), Some(1)) => {
                self.count(a);
                self.access(inst, Access::Read { word, bit }, frequency);
            }
            (BinaryOp::And, Some(Part::Whole(word)), Some(mask)) => {
                let dropped = !mask & ((1 << WORD_BITS) - 1);
                if dropped.is_power_of_two() {
                    self.count(a);
                    self.define(result, Part::Without(word, dropped.trailing_zeros()));
                }
            }
            (BinaryOp::Or, Some(Part::Without(word, bit)), _) => {
                // The other operand has no bit but this.
                if let Some(&InstData::Binary { op: BinaryOp::And, args: [_, mask] }) =
                    func.def_inst(b)
                    && func.constant(mask).is_some_and(|mask| mask as u32 == 1 << bit)
                {
                    self.count(a);
                    self.define(result, Part::Replaced(word, bit, b));
                }
            }
            _ => {}
        }
    }

    /// The words that are used in no other way, the most worthwhile first.
    fn finish(mut self) -> Found {
        let uses = self.func.use_counts();
        for (made, uses) in self.made.iter().zip(uses) {
            if let Some(made) = made
                && made.uses != uses
                && let Some(candidate) = self.candidates.get_mut(made.part.word())
            {
                candidate.refused = true;
            }
        }
        let is_good = |candidate: &Candidate| {
            let at = candidate.word.at;
            !candidate.refused
                && candidate.word.used != 0
                && !self.others.contains(&(at.region, at.offset))
                && !self.indexed.contains(&at.region)
        };
        let mut order: Vec<usize> = (0..self.candidates.len())
            .filter(|&number| is_good(&self.candidates[number]))
            .collect();
        order.sort_by(|&a, &b| {
            let saved = |number: usize| self.candidates[number].word.saved;
            saved(b).total_cmp(&saved(a)).then(a.cmp(&b))
        });
        order.truncate(MAX_WORDS);
        let mut new_numbers = vec![None; self.candidates.len()];
        for (new, &old) in order.iter().enumerate() {
            new_numbers[old] = Some(new);
        }
        let words = order.iter().map(|&number| self.candidates[number].word.clone()).collect();
        let renumbered = |(inst, access): (Inst, Access)| {
            let word = new_numbers[access.word()]?;
            Some(match access {
                Access::Read { word: _, bit } => (inst, Access::Read { word, bit }),
                Access::Write { word: _, bit, value } => (inst, Access::Write { word, bit, value }),
            })
        };
        let accesses = self.accesses.into_iter().filter_map(renumbered).collect();
        Found { words, accesses }
    }
}
