//! Changes a function: bits become bytes, and are unpacked and packed where that is needed.

use super::super::graph::Graph;
use super::analysis::{Access, Found};
use super::cost::{Flow, is_barrier, is_exit, needed_after_barriers};
use super::word::{WORD_BITS, Word, WordSet};
use crate::InstBuilder;
use crate::{
    BinaryOp, Block, BlockCall, BlockData, ConvertOp, FuncData, Inst, InstData, StatementId,
    Terminator, Type, Value,
};

/// Changes a function for the words of a set.
pub(super) fn rewrite(
    func: &mut FuncData,
    graph: &Graph,
    found: &Found,
    flow: &Flow,
    chosen: WordSet,
) {
    let mut writer = Writer { func, found, out: vec![], loc: StatementId::NONE };
    for &block in &graph.order {
        writer.block(flow, chosen, block);
    }
    // Where control enters the function, bits are unpacked in a block of their own, since the block after it may also be
    // reached from within.
    let mut made: Vec<(Block, Block)> = vec![];
    for index in 0..writer.func.entries.len() {
        let (label, entry) = writer.func.entries[index];
        let needed = flow.needed_at_begin[entry] & chosen;
        if needed == 0 {
            continue;
        }
        let known = made.iter().find(|(of, _)| *of == entry).map(|&(_, block)| block);
        let block = known.unwrap_or_else(|| {
            let block = writer.entry_block(entry, needed);
            made.push((entry, block));
            block
        });
        writer.func.entries[index] = (label, block);
    }
}

struct Writer<'a> {
    func: &'a mut FuncData,
    found: &'a Found,
    /// The instructions of the current block so far.
    out: Vec<Inst>,
    loc: StatementId,
}

impl InstBuilder for Writer<'_> {
    fn func(&self) -> &FuncData {
        self.func
    }

    fn build(&mut self, data: InstData) -> Value {
        let (inst, value) = self.func.append(data, self.loc);
        self.out.push(inst);
        value
    }
}

impl Writer<'_> {
    /// Changes a block.
    fn block(&mut self, flow: &Flow, chosen: WordSet, block: Block) {
        let mut needed_after =
            needed_after_barriers(self.func, self.found, block, flow.needed[block]);
        let mut changed = flow.changed[block] & chosen;
        let insts = std::mem::take(&mut self.func.blocks[block].insts);
        self.out.reserve(insts.len());
        for inst in insts {
            self.loc = self.func.loc(inst);
            if is_barrier(self.func.inst(inst)) {
                self.pack(std::mem::take(&mut changed));
                self.out.push(inst);
                self.unpack(needed_after.pop().unwrap_or(0) & chosen);
                continue;
            }
            match self.found.accesses.get(&inst) {
                Some(&access) if chosen >> access.word() & 1 == 1 => {
                    if matches!(access, Access::Write { .. }) {
                        changed |= 1 << access.word();
                    }
                    self.access(inst, access);
                }
                _ => {}
            }
            self.out.push(inst);
        }
        if self.func.blocks[block].terminator.as_ref().is_some_and(is_exit) {
            self.pack(changed);
        }
        self.func.blocks[block].insts = std::mem::take(&mut self.out);
    }

    /// A block that unpacks words and goes on at another.
    fn entry_block(&mut self, to: Block, words: WordSet) -> Block {
        self.loc = StatementId::NONE;
        self.unpack(words);
        let BlockData { cold, optimize_for_size, .. } = *self.func.block(to);
        self.func.blocks.push(BlockData {
            params: vec![],
            insts: std::mem::take(&mut self.out),
            cold,
            optimize_for_size,
            terminator: Some(Terminator::Jump(BlockCall::plain(to))),
        })
    }

    /// Replaces an access of a bit by that of a byte.
    fn access(&mut self, inst: Inst, access: Access) {
        let found = self.found;
        let word = &found.words[access.word()];
        self.func.insts[inst] = match access {
            Access::Read { word: _, bit } => {
                let at = word.local_bit(bit);
                match self.func.inst(inst) {
                    InstData::Bit { .. } => InstData::Load { ty: Type::I1, at },
                    _ => {
                        let arg = self.load(Type::I1, at);
                        InstData::Convert { op: ConvertOp::Zext, to: Type::I32, arg }
                    }
                }
            }
            Access::Write { word: _, bit, value } => {
                let value = match self.func.ty(value) {
                    Type::I1 => value,
                    _ => self.bit(value, 0),
                };
                InstData::Store { at: word.local_bit(bit), value }
            }
        };
    }

    /// Calls `f` for each word of a set.
    fn for_each(&mut self, words: WordSet, mut f: impl FnMut(&mut Self, &Word)) {
        let found = self.found;
        for (number, word) in found.words.iter().enumerate() {
            if words >> number & 1 == 1 {
                f(self, word);
            }
        }
    }

    /// Appends what unpacks words.
    fn unpack(&mut self, words: WordSet) {
        self.for_each(words, |this, word| {
            let value = this.load(Type::I32, word.at);
            this.build(InstData::Unpack { word: value, to: word.groups(word.used) });
        });
    }

    /// Appends what packs words.
    fn pack(&mut self, words: WordSet) {
        self.for_each(words, |this, word| {
            // A word of which no bit was written needs no packing.
            if word.written == 0 {
                return;
            }
            let from = word.groups(word.written);
            let mut value = this.build(InstData::Pack { from });
            let kept = ((1 << WORD_BITS) - 1) & !i64::from(from.mask());
            if kept != 0 {
                let old = this.load(Type::I32, word.at);
                let rest = this.binary_imm(BinaryOp::And, old, kept);
                value = this.binary(BinaryOp::Or, rest, value);
            }
            this.store(word.at, value);
        });
    }
}
