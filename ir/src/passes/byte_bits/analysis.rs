//! Finds the words of which a function does nothing but read and write single bits. Front ends write such accesses
//! in these forms:
//!
//! | access of bit N | instructions |
//! | --- | --- |
//! | read | load the word; shift it right by N, unless N is 0; AND with 1 |
//! | write | load the word; AND with a mask that drops bit N; OR with a value that has no other bit; store the word |
//!
//! A word that is used in any other way is refused.

use super::super::graph::Graph;
use super::super::thresholds::byte_bits::{SAVED_BY_READ, SAVED_BY_WRITE};
use super::word::{MAX_WORDS, WORD_BITS, Word};
use crate::tables::{FastMap, FastSet};
use crate::{
    Address, BinaryOp, Block, FuncData, Inst, InstData, PrimaryMap, RegionId, Type, Value,
};

/// An access of one bit of a word. It is entered for the instruction in whose place an access of a byte comes.
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
    pub(super) accesses: FastMap<Inst, Access>,
}

/// How a value follows from a word.
#[derive(Clone, Copy)]
enum Form {
    /// It is the word as it is in the image.
    Whole(usize),
    /// It is the word, shifted right by that many bits.
    Shifted(usize, u32),
    /// It is the word, with this bit 0.
    Without(usize, u32),
    /// It is the word, with this bit replaced by that of a value.
    Replaced(usize, u32, Value),
}

impl Form {
    fn word(self) -> usize {
        match self {
            Self::Whole(word)
            | Self::Shifted(word, _)
            | Self::Without(word, _)
            | Self::Replaced(word, ..) => word,
        }
    }
}

/// A value that was computed from a word.
#[derive(Clone, Copy)]
struct Derived {
    form: Form,
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

    /// Enters how a value follows from a word.
    fn define(&mut self, value: Option<Value>, form: Form) {
        let at = self.current;
        if let Some(value) = value {
            self.derived[value] = Some(Derived { form, at, bit_uses: 0 });
        }
    }

    /// How a value follows from a word; `None` if it does not, or the word may have changed since.
    fn form(&self, value: Value) -> Option<Form> {
        let derived = self.derived[value]?;
        let last_store = self.candidates.get(derived.form.word())?.last_store;
        (derived.at > last_store.max(self.last_effect)).then_some(derived.form)
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
                self.define(func.result(inst), Form::Whole(word));
            }
            InstData::Store { at, value } if self.is_word(&at, func.ty(value)) => {
                let word = self.number(at);
                let replaced = match self.form(value) {
                    Some(Form::Replaced(of, bit, by)) if of == word => Some((bit, by)),
                    _ => None,
                };
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
            InstData::Binary { op, args } => self.binary(inst, op, args, frequency),
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

    fn binary(&mut self, inst: Inst, op: BinaryOp, [a, b]: [Value; 2], frequency: f32) {
        let func = self.func;
        let result = func.result(inst);
        let constant = func.constant(b).map(|constant| constant as u32);
        match (op, self.form(a), constant) {
            (BinaryOp::Lshr, Some(Form::Whole(word)), Some(by @ 1..WORD_BITS)) => {
                self.count_bit_use(a);
                self.define(result, Form::Shifted(word, by));
            }
            (BinaryOp::And, Some(Form::Whole(word)), Some(1)) => {
                self.count_bit_use(a);
                self.access(inst, Access::Read { word, bit: 0 }, frequency);
            }
            (BinaryOp::And, Some(Form::Shifted(word, bit)), Some(1)) => {
                self.count_bit_use(a);
                self.access(inst, Access::Read { word, bit }, frequency);
            }
            (BinaryOp::And, Some(Form::Whole(word)), Some(mask)) => {
                let dropped = !mask & ((1 << WORD_BITS) - 1);
                if dropped.is_power_of_two() {
                    self.count_bit_use(a);
                    self.define(result, Form::Without(word, dropped.trailing_zeros()));
                }
            }
            (BinaryOp::Or, Some(Form::Without(word, bit)), _) => {
                // The other operand has no bit but this.
                if let Some(&InstData::Binary { op: BinaryOp::And, args: [_, mask] }) =
                    func.def_inst(b)
                    && func.constant(mask).is_some_and(|mask| mask as u32 == 1 << bit)
                {
                    self.count_bit_use(a);
                    self.define(result, Form::Replaced(word, bit, b));
                }
            }
            _ => {}
        }
    }

    /// The words that are used in no other way; those whose bytes save most come first, and get the lowest numbers.
    fn finish(mut self) -> Found {
        let uses = self.func.use_counts();
        for (value, derived) in &self.derived {
            if let Some(derived) = derived
                && derived.bit_uses != uses[value]
                && let Some(candidate) = self.candidates.get_mut(derived.form.word())
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
