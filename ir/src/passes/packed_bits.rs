//! Collects bits that are put one by one into the same word of the image, and stores the word once.
//!
//! A PMAC keeps bits in words of 24 bits. A program that sets one after the other loads, changes and
//! stores the same word again and again, and each of these steps has to wait for the one before.
//!
//! ```text
//! v1: i32 = load words:0                 v1: i32 = load words:0
//! v2: i32 = and v1, ~1                   v2: i32 = and v1, ~1
//! v3: i32 = or v2, v8                    v3: i32 = or v2, v8
//! store words:0, v3                ==>
//! v4: i32 = load words:0                 v4: i32 = load words:0     (as before the block)
//! v5: i32 = and v4, ~2                   v6: i32 = and v4, ~1
//! v6: i32 = or v5, v9                    v7: i32 = or v6, v8        (takes the place of v4)
//! store words:0, v6                      …
//! …                                      store words:0, (load words:0 & ~3) | v8 | v9
//! ```
//!
//! The pass does this for words of which a function replaces bits at least twice. It keeps the bits that were
//! replaced, in their places, in a value of their own ([`Word::bits`]), and delays the store of the word: until
//! something may read or write the word in another way (an access that overlaps, a host call, a trap), and at
//! latest until the end of the block. The block may contain branches whose two sides meet again, if they
//! touch none of these words and have no effect that could be seen before the delayed stores. A load of the
//! word before the delayed store gives the word as it was before the first store, so the replaced bits are put into its result. Most
//! of these loads read a single bit. Then the pass `demanded-bits` replaces the load by the truth value that
//! was put into that bit, or uses the old word alone, so that nothing waits for a store.

use std::ops::Range;

use super::graph::Graph;
use super::image_bytes::ImageBytes;
use super::substitution::Substitution;
use super::value_range::{ValueRanges, mask};
use crate::InstBuilder;
use crate::tables::FastMap;
use crate::{
    Address, BinaryOp, Block, FuncData, Inst, InstData, StatementId, Terminator, Type, Value,
};

/// Bits of at most this many words are collected at the same time. When there is one more, the word that has
/// been collected longest is stored.
const MAX_WORDS: usize = 32;

/// To find the word from which a value was made, at most this many operations are followed back.
const MAX_STEPS: usize = 192;

/// A word of which bits have been replaced, and which has not been stored since.
struct Word {
    at: Address,
    ty: Type,
    /// Its bytes in the image.
    bytes: Range<usize>,
    /// Which bits have been replaced.
    replaced: u64,
    /// The replaced bits, in their places; all other bits are 0. `None` if they are all 0.
    bits: Option<Value>,
    /// Values that are equal to the word with its replaced bits.
    current: Vec<Value>,
    /// The source place of the statement that replaced bits last.
    loc: StatementId,
}

/// How a value differs from a word: which of the word's bits it has, and what it has in the other
/// places (`None` for zeros).
type Change = (u64, Option<Value>);

/// Changes a function, block by block.
struct Collector<'a> {
    func: &'a mut FuncData,
    bytes: &'a ImageBytes,
    /// The words whose bits are collected, with the type of their stores.
    candidates: FastMap<Address, Type>,
    ranges: ValueRanges,
    /// The words with replaced bits that are not stored yet.
    words: Vec<Word>,
    /// For blocks where the two sides of a branch meet: the words that are not stored yet at their beginning.
    waiting: FastMap<Block, Vec<Word>>,
    /// The instructions of the current block so far.
    out: Vec<Inst>,
    loc: StatementId,
}

/// Runs the pass; returns whether it may have changed anything.
pub(super) fn run(func: &mut FuncData, bytes: &ImageBytes) -> bool {
    let graph = Graph::new(func);
    let candidates = candidates(func, &graph);
    if candidates.is_empty() {
        return false;
    }
    let mut values = Substitution::new(func);
    let ranges = ValueRanges::new(func);
    let (words, waiting, out) = (vec![], FastMap::default(), vec![]);
    let mut collector =
        Collector { func, bytes, candidates, ranges, words, waiting, out, loc: StatementId::NONE };
    for &block in &graph.order {
        collector.block(&graph, block, &mut values);
    }
    true
}

/// The words of which a function replaces bits at least twice, each with the type of the first such store.
/// Stores of other types are not counted.
fn candidates(func: &FuncData, graph: &Graph) -> FastMap<Address, Type> {
    let mut stores: FastMap<Address, (Type, u32)> = FastMap::default();
    for &inst in graph.order.iter().flat_map(|&block| &func.block(block).insts) {
        if let InstData::Store { at, value } = func.inst(inst)
            && is_word(at, func.ty(*value))
            && let Some(InstData::Binary {
                op: BinaryOp::And | BinaryOp::Or | BinaryOp::Xor, ..
            }) = func.def_inst(*value)
        {
            let (ty, count) = stores.entry(*at).or_insert((func.ty(*value), 0));
            if *ty == func.ty(*value) {
                *count += 1;
            }
        }
    }
    stores.into_iter().filter(|(_, (_, count))| *count > 1).map(|(at, (ty, _))| (at, ty)).collect()
}

/// Whether the pass may delay an access: its address is constant, it is not volatile, and its type is an integer of
/// 8, 16 or 32 bits.
fn is_word(at: &Address, ty: Type) -> bool {
    at.index.is_none() && !at.volatile && matches!(ty, Type::I8 | Type::I16 | Type::I32)
}

impl InstBuilder for Collector<'_> {
    fn func(&self) -> &FuncData {
        self.func
    }

    fn build(&mut self, data: InstData) -> Value {
        let (inst, value) = self.func.append(data, self.loc);
        self.push(inst);
        value
    }
}

impl Collector<'_> {
    /// Collects bits in a block, and writes the block anew.
    fn block(&mut self, graph: &Graph, block: Block, values: &mut Substitution) {
        self.words = self.waiting.remove(&block).unwrap_or_default();
        let insts = std::mem::take(&mut self.func.blocks[block].insts);
        for inst in insts {
            self.loc = self.func.loc(inst);
            let mut data = *self.func.inst(inst);
            values.inst(&mut data);
            self.func.insts[inst] = data;
            match data {
                InstData::Load { ty, at } => {
                    let found = self.words.iter().position(|word| word.at == at && word.ty == ty);
                    match (found, self.func.result(inst)) {
                        (Some(word), Some(result)) => self.use_load(word, inst, result, values),
                        _ => {
                            self.store_overlapping(&at, ty);
                            self.push(inst);
                        }
                    }
                }
                InstData::Store { at, value }
                    if self.candidates.get(&at) == Some(&self.func.ty(value)) =>
                {
                    self.collect(at, value);
                }
                InstData::Store { at, value } => {
                    let ty = self.func.ty(value);
                    self.store_overlapping(&at, ty);
                    self.push(inst);
                }
                data => {
                    if data.has_effect() {
                        self.store_all();
                    }
                    self.push(inst);
                }
            }
        }
        match self.meeting(graph, block) {
            Some(meeting) => {
                let words = std::mem::take(&mut self.words);
                self.waiting.insert(meeting, words);
            }
            None => self.store_all(),
        }
        let data = &mut self.func.blocks[block];
        data.insts = std::mem::take(&mut self.out);
        if let Some(terminator) = &mut data.terminator {
            values.terminator(terminator);
        }
    }

    /// The block where the two sides of the branch at the end of a block meet again, if nothing on them
    /// touches the words that are not stored yet, and control reaches that block through them alone.
    fn meeting(&self, graph: &Graph, block: Block) -> Option<Block> {
        let Some(Terminator::Brif { cond: _, then, otherwise }) =
            &self.func.block(block).terminator
        else {
            return None;
        };
        let (then, otherwise) = (then.block, otherwise.block);
        if self.words.is_empty() || then == otherwise {
            return None;
        }
        let edges = |to: Block| graph.edges[to];
        // The block to which a side jumps, if the side is reached from here alone and leaves the words alone.
        let successor = |way: Block| {
            let data = self.func.block(way);
            let Some(Terminator::Jump(next)) = &data.terminator else { return None };
            let is_plain = data.insts.iter().all(|&inst| self.leaves_words(inst));
            (edges(way) == 1 && is_plain).then_some(next.block)
        };
        let (a, b) = (successor(then), successor(otherwise));
        let meeting = match (a, b) {
            (Some(a), Some(b)) if a == b => a,
            (Some(a), _) if a == otherwise => a,
            (_, Some(b)) if b == then => b,
            _ => return None,
        };
        (meeting != block && edges(meeting) == 2).then_some(meeting)
    }

    /// Whether an instruction neither reads nor writes a word that is not stored yet, and has no effect before
    /// which the word must be stored.
    fn leaves_words(&self, inst: Inst) -> bool {
        let (at, ty) = match self.func.inst(inst) {
            InstData::Store { at, value } => (at, self.func.ty(*value)),
            InstData::Load { ty, at } => (at, *ty),
            data => return !data.has_effect(),
        };
        let bytes = self.bytes.bytes(at, ty);
        let touches = |word: &Word| word.bytes.start < bytes.end && bytes.start < word.bytes.end;
        !at.volatile && !self.words.iter().any(touches)
    }

    /// Appends an instruction to the current block.
    fn push(&mut self, inst: Inst) {
        self.out.push(inst);
        if let Some(result) = self.func.result(inst) {
            let data = *self.func.inst(inst);
            self.ranges.note(self.func, result, &data);
        }
    }

    /// Appends an OR of two values and returns its result. `None` means a value that is 0.
    fn insert_or(&mut self, a: Option<Value>, b: Option<Value>) -> Option<Value> {
        match (a, b) {
            (Some(a), Some(b)) => Some(self.binary(BinaryOp::Or, a, b)),
            (a, b) => a.or(b),
        }
    }

    /// The bits `kept` of a value; the others become 0, unless they are known to be 0. `None` is a value
    /// that is 0.
    fn masked(&mut self, value: Option<Value>, kept: u64) -> Option<Value> {
        let value = value?;
        match self.ranges.possible_ones(value) & !kept {
            0 => Some(value),
            _ => Some(self.binary_imm(BinaryOp::And, value, kept as i64)),
        }
    }

    /// A load of a word that is not stored yet: it loads the word as it was, and the replaced bits are put
    /// into the result.
    fn use_load(&mut self, number: usize, inst: Inst, result: Value, values: &mut Substitution) {
        let Some(&Word { ty, replaced, bits, .. }) = self.words.get(number) else { return };
        self.push(inst);
        let whole = self.with_bits(ty, result, replaced, bits);
        if let Some(word) = self.words.get_mut(number) {
            values.replace(result, whole);
            word.current.push(whole);
        }
    }

    /// A word with some bits replaced.
    fn with_bits(&mut self, ty: Type, word: Value, replaced: u64, bits: Option<Value>) -> Value {
        match (mask(ty) & !replaced, bits) {
            (0, Some(bits)) => bits,
            (kept, bits) => {
                let rest = self.binary_imm(BinaryOp::And, word, kept as i64);
                bits.map_or(rest, |bits| self.binary(BinaryOp::Or, rest, bits))
            }
        }
    }

    /// A store to a word: finds out which bits it replaces, keeps them, and drops the store.
    fn collect(&mut self, at: Address, value: Value) {
        let ty = self.func.ty(value);
        let number = match self.words.iter().position(|word| word.at == at && word.ty == ty) {
            Some(number) => number,
            None => {
                self.store_overlapping(&at, ty);
                if self.words.len() >= MAX_WORDS {
                    let first = self.words.remove(0);
                    self.store_word(&first);
                }
                let bytes = self.bytes.bytes(&at, ty);
                let current = self.loaded(&at, ty);
                let (replaced, bits, loc) = (0, None, self.loc);
                self.words.push(Word { at, ty, bytes, replaced, bits, current, loc });
                self.words.len() - 1
            }
        };
        let Some(word) = self.words.get_mut(number) else { return };
        let (replaced, bits) = (word.replaced, word.bits);
        let current = std::mem::take(&mut word.current);
        let mut steps = MAX_STEPS;
        let change = self.change(ty, &current, value, &mut steps);
        let (kept, new) = change.unwrap_or((0, Some(value)));
        let kept = kept & mask(ty);
        let rest = self.masked(bits, kept);
        let bits = self.insert_or(rest, new);
        let loc = self.loc;
        if let Some(word) = self.words.get_mut(number) {
            word.replaced = replaced | mask(ty) & !kept;
            word.bits = bits;
            word.current = vec![value];
            word.loc = loc;
        }
    }

    /// The values that the current block has loaded from a word since the last store to it.
    fn loaded(&self, at: &Address, ty: Type) -> Vec<Value> {
        let bytes = self.bytes.bytes(at, ty);
        let mut found = vec![];
        for &inst in self.out.iter().rev().take(MAX_STEPS) {
            match self.func.inst(inst) {
                InstData::Load { ty: loaded, at: from } if from == at && *loaded == ty => {
                    found.extend(self.func.result(inst));
                }
                InstData::Store { at: to, value } => {
                    let written = self.bytes.bytes(to, self.func.ty(*value));
                    if written.start < bytes.end && bytes.start < written.end {
                        break;
                    }
                }
                data if data.has_effect() => break,
                _ => {}
            }
        }
        found
    }

    /// How a value differs from a word to which each of the values `current` is equal; `None` if it was not made
    /// from that word. At most `steps` operations are followed back, and counted down.
    fn change(
        &mut self,
        ty: Type,
        current: &[Value],
        value: Value,
        steps: &mut usize,
    ) -> Option<Change> {
        if current.contains(&value) {
            return Some((mask(ty), None));
        }
        let InstData::Binary { op, args: [a, b] } = *self.func.def_inst(value)? else {
            return None;
        };
        *steps = steps.checked_sub(1)?;
        match op {
            BinaryOp::And => {
                let constant = self.func.constant(b)? as u64 & mask(ty);
                let (kept, new) = self.change(ty, current, a, steps)?;
                Some((kept & constant, self.masked(new, constant)))
            }
            BinaryOp::Or => {
                let (change, other) = match self.change(ty, current, a, steps) {
                    Some(change) => (change, b),
                    None => (self.change(ty, current, b, steps)?, a),
                };
                let (kept, new) = change;
                match self.func.constant(other) {
                    Some(ones) => {
                        let ones = ones as u64 & mask(ty);
                        let rest = self.masked(new, !ones);
                        Some((kept & !ones, self.insert_or(rest, Some(other))))
                    }
                    None if self.ranges.possible_ones(other) & kept == 0 => {
                        Some((kept, self.insert_or(new, Some(other))))
                    }
                    None => None,
                }
            }
            BinaryOp::Xor => {
                let (change, other) = match self.change(ty, current, a, steps) {
                    Some(change) => (change, b),
                    None => (self.change(ty, current, b, steps)?, a),
                };
                let (kept, new) = change;
                // The bits that may be toggled are taken from the result.
                let toggled = self.ranges.possible_ones(other) & mask(ty);
                let rest = self.masked(new, !toggled);
                let bits = self.masked(Some(value), toggled);
                Some((kept & !toggled, self.insert_or(rest, bits)))
            }
            _ => None,
        }
    }

    /// Stores a word with its replaced bits.
    fn store_word(&mut self, word: &Word) {
        let loc = std::mem::replace(&mut self.loc, word.loc);
        if word.replaced != 0 {
            let value = match (mask(word.ty) & !word.replaced, word.bits) {
                (0, Some(bits)) => bits,
                _ => {
                    let old = self.load(word.ty, word.at);
                    self.with_bits(word.ty, old, word.replaced, word.bits)
                }
            };
            self.store(word.at, value);
        }
        self.loc = loc;
    }

    /// Stores the words that an access may touch.
    fn store_overlapping(&mut self, at: &Address, ty: Type) {
        if self.words.is_empty() {
            return;
        }
        let bytes = self.bytes.bytes(at, ty);
        let mut number = 0;
        while let Some(word) = self.words.get(number) {
            if at.volatile || word.bytes.start < bytes.end && bytes.start < word.bytes.end {
                let word = self.words.remove(number);
                self.store_word(&word);
            } else {
                number += 1;
            }
        }
    }

    /// Stores all words that are not stored yet.
    fn store_all(&mut self) {
        for word in std::mem::take(&mut self.words) {
            self.store_word(&word);
        }
    }
}
