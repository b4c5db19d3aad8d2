//! Finds the words of which a function does nothing but read and write single bits. Front ends write such accesses
//! in these forms:
//!
//! | access of a bit | instructions |
//! | --- | --- |
//! | read | load the word; read the bit (`bit`, or `extract_u` of one bit) |
//! | write | load the word; `insert` one bit; store the word |
//!
//! A word that is used in any other way is refused.

use super::super::graph::Graph;
use super::super::thresholds::byte_bits::{SAVED_BY_READ, SAVED_BY_WRITE};
use super::word::{MAX_WORDS, WORD_BITS, Word};
use crate::tables::{FastMap, FastSet};
use crate::{
    Address, Block, ExtractOp, Field, FuncData, Inst, InstData, PrimaryMap, RegionId, Type, Value,
};

/// An access of one bit of a word. It is entered for the instruction in whose place an access of a byte comes.
#[derive(Clone, Copy, Debug)]
pub(super) enum Access {
    /// The instruction's result is the bit with this number.
    Read { word: usize, bit: u32 },
    /// The instruction stores the word with this bit replaced: by a truth value, or the lowest bit of an integer.
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
    pub(super) accesses: FastMap<Inst, Access>,
}

/// A value that is a word as it is in the image, or was made of it by replacing a bit.
#[derive(Clone, Copy)]
struct Derived {
    /// The number of the word.
    word: usize,
    /// The bit that was replaced, and by what.
    replaced: Option<(u32, Value)>,
    /// The number of the instruction that computed it.
    at: u32,
    /// How many of its uses belong to reads and writes of bits.
    bit_uses: u32,
}

/// A word of which single bits are accessed, as far as the search has come.
struct Candidate {
    word: Word,
    /// Whether it is used in another way, too.
    refused: bool,
    /// The number of the instruction that stored it last.
    last_store: u32,
}

/// A function that is searched.
struct Search<'a> {
    func: &'a FuncData,
    regions: &'a [RegionId],
    candidates: Vec<Candidate>,
    /// The number of the candidate at an address.
    numbers: FastMap<(RegionId, u32), usize>,
    /// For each value how it follows from a word, if it does.
    derived: PrimaryMap<Value, Option<Derived>>,
    /// The number of the current instruction, counted over the whole function.
    current: u32,
    /// The number of the last instruction in this block that may have changed any word, or of the block's beginning.
    last_effect: u32,
    accesses: FastMap<Inst, Access>,
    /// Words that are accessed in other ways, such as single bytes of them.
    other_accesses: FastSet<(RegionId, u32)>,
    /// Regions of words that are accessed by an index.
    indexed: FastSet<RegionId>,
}

/// Finds the words, and what bytes would save in each, by how often blocks are executed.
pub(super) fn find(
    func: &FuncData,
    graph: &Graph,
    regions: &[RegionId],
    frequencies: &PrimaryMap<Block, f32>,
) -> Found {
    let mut search = Search {
        func,
        regions,
        candidates: vec![],
        numbers: FastMap::default(),
        derived: vec![None; func.value_count()].into(),
        current: 0,
        last_effect: 0,
        accesses: FastMap::default(),
        other_accesses: FastSet::default(),
        indexed: FastSet::default(),
    };
    for &block in &graph.order {
        search.current += 1;
        search.last_effect = search.current;
        let data = func.block(block);
        let frequency = frequencies[block];
        for &inst in &data.insts {
            search.current += 1;
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
            candidates.push(Candidate { word, refused: false, last_store: 0 });
            candidates.len() - 1
        })
    }

    /// Enters that the result of an instruction follows from a word.
    fn define(&mut self, inst: Inst, word: usize, replaced: Option<(u32, Value)>) {
        let at = self.current;
        if let Some(value) = self.func.result(inst) {
            self.derived[value] = Some(Derived { word, replaced, at, bit_uses: 0 });
        }
    }

    /// How a value follows from a word; `None` if it does not, or the word may have changed since.
    fn derived(&self, value: Value) -> Option<Derived> {
        let derived = self.derived[value]?;
        let last_store = self.candidates.get(derived.word)?.last_store;
        (derived.at > last_store.max(self.last_effect)).then_some(derived)
    }

    /// The number of the word that a value is, as it is in the image. Counts the use as one that belongs to the read or
    /// write of a bit.
    fn word_of_bit(&mut self, value: Value, bit: u8) -> Option<usize> {
        let derived = self.derived(value)?;
        if derived.replaced.is_some() || u32::from(bit) >= WORD_BITS {
            return None;
        }
        self.count_bit_use(value);
        Some(derived.word)
    }

    /// Counts a use of a value that belongs to a read or write of a bit.
    fn count_bit_use(&mut self, value: Value) {
        if let Some(derived) = &mut self.derived[value] {
            derived.bit_uses += 1;
        }
    }

    /// Enters an access of a bit, by the instruction that is replaced for it.
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

    /// Looks at the next instruction of a block that is executed `frequency` times in each call of the function.
    fn inst(&mut self, inst: Inst, frequency: f32) {
        let func = self.func;
        match *func.inst(inst) {
            InstData::Load { ty, at } if self.is_word(&at, ty) => {
                let word = self.number(at);
                self.define(inst, word, None);
            }
            InstData::Store { at, value } if self.is_word(&at, func.ty(value)) => {
                let word = self.number(at);
                let derived = self.derived(value).filter(|derived| derived.word == word);
                let replaced = derived.and_then(|derived| derived.replaced);
                if let Some((bit, by)) = replaced {
                    self.count_bit_use(value);
                    self.access(inst, Access::Write { word, bit, value: by }, frequency);
                }
                if let Some(candidate) = self.candidates.get_mut(word) {
                    candidate.refused |= replaced.is_none();
                    candidate.last_store = self.current;
                }
            }
            InstData::Load { ty, at } => self.other(&at, ty),
            InstData::Store { at, value } => self.other(&at, func.ty(value)),
            InstData::Bit { arg, number: bit }
            | InstData::Extract {
                op: ExtractOp::Unsigned,
                arg,
                field: Field { first: bit, width: 1 },
            } => {
                if let Some(word) = self.word_of_bit(arg, bit) {
                    self.access(inst, Access::Read { word, bit: bit.into() }, frequency);
                }
            }
            InstData::Insert { args: [arg, by], field: Field { first: bit, width: 1 } } => {
                if let Some(word) = self.word_of_bit(arg, bit) {
                    self.define(inst, word, Some((bit.into(), by)));
                }
            }
            data if data.has_effect() => self.last_effect = self.current,
            _ => {}
        }
    }

    /// Enters an access of something other than a whole word.
    fn other(&mut self, at: &Address, ty: Type) {
        if at.volatile {
            self.last_effect = self.current;
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
            self.other_accesses.insert((at.region, offset));
        }
    }

    /// The words that are used in no other way; those whose bytes save most come first, and get the lowest numbers.
    fn finish(mut self) -> Found {
        let uses = self.func.use_counts();
        for (value, derived) in &self.derived {
            if let Some(derived) = derived
                && derived.bit_uses != uses[value]
                && let Some(candidate) = self.candidates.get_mut(derived.word)
            {
                candidate.refused = true;
            }
        }
        let is_good = |candidate: &Candidate| {
            let at = candidate.word.at;
            !candidate.refused
                && candidate.word.used != 0
                && !self.other_accesses.contains(&(at.region, at.offset))
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
