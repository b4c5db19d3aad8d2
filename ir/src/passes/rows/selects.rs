//! Rows of selects whose conditions are bits of a row.
//!
//! ```text
//! IF (M1=1)                v3: i32 = …                (M1, M2, …, a row)
//!   P1=101                 v4: i32 = and v3, 7
//! ENDIF                    v5: i1 = icmp ne v4, 0
//! IF (M2=1)         ==>    brif v5, block1, block2(v0)
//!   P1=102             block1:
//! ENDIF                    v6: i1 = bit v3, 0
//! …                        v7: i64 = select v6, v1, v0
//!                          …
//!                          jump block2(v9)
//!                      block2(v10: i64):
//!                          store p:8, v10
//! ```
//!
//! Each select takes its constant if its condition holds, and else what the select before it gives. `rows`
//! has computed the conditions as the bits of a word. So they need not be computed one by one, and
//! one comparison shows that none of them holds, which is what mostly happens to keys and one-shots. The
//! selects and the store of their result move after the word.

use std::ops::Range;

use super::super::cursor::Cursor;
use super::{Lane, MIN_LANES, Rows};
use crate::InstBuilder;
use crate::{
    Address, BinaryOp, Block, BlockCall, BlockData, Inst, InstData, IntCond, Terminator, Value,
    ValueDef, func::ValueData,
};

/// A row of selects has at most this many.
const MAX_SELECTS: usize = 256;

/// One of a row of selects.
struct Select {
    inst: Inst,
    cond: Value,
    constant: Value,
    /// The row that has its condition, and the number of the bit there.
    bit: Option<(usize, u8)>,
}

/// A store of the result of a row of selects.
struct Chain {
    /// The place of the store among the instructions.
    store: usize,
    at: Address,
    /// In the order of their execution.
    selects: Vec<Select>,
    /// What the first of them takes if its condition does not hold.
    initial: Value,
}

impl Rows<'_> {
    /// Moves the first row of selects of a block after the row that has their conditions; `insts` are the
    /// block's instructions, which this puts into the block and those that are made. Returns whether there was
    /// such a row.
    pub(super) fn selects(&mut self, block: Block, mut insts: Vec<Inst>) -> bool {
        let data = self.func.block(block);
        let found = match data.cold || data.optimize_for_size || self.known.is_empty() {
            true => None,
            false => insts.iter().enumerate().find_map(|(at, &inst)| self.chain(at, inst)),
        };
        let Some((chain, behind)) = found
            .and_then(|chain| Some((self.place_behind(&chain, &insts)?, chain)))
            .map(|(behind, chain)| (chain, behind))
        else {
            self.func.blocks[block].insts = insts;
            return false;
        };
        let rest = insts.split_off(behind);
        let store = insts.remove(chain.store);
        insts.retain(|inst| chain.selects.iter().all(|select| select.inst != *inst));
        let terminator = self.func.blocks[block].terminator.take();
        let (mut last, mut value) = (block, chain.initial);
        for part in chain.selects.chunk_by(|a, b| row_of(a) == row_of(b)) {
            let row = row_of(part.first()).filter(|_| part.len() >= MIN_LANES);
            let Some(word) = row.and_then(|row| self.known.get(row)).map(|known| known.1) else {
                for select in part {
                    let mut out = self.cursor(select, &mut insts);
                    value = out.select(select.cond, select.constant, value);
                }
                continue;
            };
            let ty = self.func.ty(word);
            let bits = part.iter().filter_map(|select| select.bit);
            let mask = bits.fold(0, |mask, (_, bit)| mask | 1i64 << bit);
            // Whether any of the conditions holds.
            let mut out = self.cursor(&part[0], &mut insts);
            let bits = out.binary_imm(BinaryOp::And, word, mask);
            let zero = out.constant(ty, 0);
            let any = out.icmp(IntCond::Ne, bits, zero);
            let [then, next] = [(); 2].map(|()| self.new_block());
            let def = ValueDef::Param(next, 0);
            let ty = self.func.ty(value);
            let param = self.func.values.push(ValueData { ty, def });
            self.func.blocks[next].params = vec![param];
            let otherwise = BlockCall { block: next, args: vec![value] };
            let guard = Terminator::Brif { cond: any, then: BlockCall::plain(then), otherwise };
            self.end_block(last, std::mem::take(&mut insts), Some(guard));
            for select in part {
                let bit = select.bit.map_or(0, |(_, bit)| bit);
                let mut out = self.cursor(select, &mut insts);
                let cond = out.bit(word, bit);
                value = out.select(cond, select.constant, value);
            }
            let jump = Terminator::Jump(BlockCall { block: next, args: vec![value] });
            self.end_block(then, std::mem::take(&mut insts), Some(jump));
            (last, value) = (next, param);
        }
        self.func.insts[store] = InstData::Store { at: chain.at, value };
        insts.push(store);
        insts.extend(rest);
        self.end_block(last, insts, terminator);
        true
    }

    /// The row of selects whose result an instruction stores, if it is one of which rows have computed
    /// enough conditions. `store` is the place of the instruction.
    fn chain(&self, store: usize, inst: Inst) -> Option<Chain> {
        let InstData::Store { at, value } = *self.func.inst(inst) else { return None };
        if at.index.is_some() || at.volatile {
            return None;
        }
        let (mut selects, mut initial) = (vec![], value);
        while let ValueDef::Result(inst) = self.func.def(initial)
            && let InstData::Select { cond, args: [constant, before] } = *self.func.inst(inst)
            && self.func.constant(constant).is_some()
            && self.uses[initial] == 1
            && self.places[initial] > 0
            && selects.len() < MAX_SELECTS
        {
            selects.push(Select { inst, cond, constant, bit: self.bit_of_row(cond) });
            initial = before;
        }
        selects.reverse();
        let has_row = |part: &[Select]| part.len() >= MIN_LANES && row_of(part.first()).is_some();
        let pays = selects.chunk_by(|a, b| row_of(a) == row_of(b)).any(has_row);
        pays.then_some(Chain { store, at, selects, initial })
    }

    /// The first row that has a truth value, and the number of the bit there.
    fn bit_of_row(&self, cond: Value) -> Option<(usize, u8)> {
        self.known.iter().enumerate().find_map(|(row, (lanes, word))| {
            let lane = self.source(self.func.ty(*word), Lane { value: cond, bit: 0, to: 0 });
            let lane = self.with_first_load(lane);
            let same = |known: &&Lane| (known.value, known.bit) == (lane.value, lane.bit);
            lanes.iter().filter(same).map(|known| known.to).min().map(|bit| (row, bit))
        })
    }

    /// The place after all rows that a row of selects needs and after its store; `None` if the store
    /// can't be moved there.
    fn place_behind(&self, chain: &Chain, insts: &[Inst]) -> Option<usize> {
        let mut behind = chain.store + 1;
        for (row, _) in chain.selects.iter().filter_map(|select| select.bit) {
            let ValueDef::Result(word) = self.func.def(self.known.get(row)?.1) else { return None };
            behind = behind.max(insts.iter().position(|&inst| inst == word)? + 1);
        }
        let written = self.bytes.bytes(&chain.at, self.func.ty(chain.initial));
        let overlaps = |bytes: Range<usize>| bytes.start < written.end && written.start < bytes.end;
        let passed = insts.get(chain.store + 1..behind)?;
        let may_pass = |&inst: &Inst| match self.func.inst(inst) {
            InstData::Load { ty, at } => !at.volatile && !overlaps(self.bytes.bytes(at, *ty)),
            InstData::Store { at, value } => {
                !at.volatile && !overlaps(self.bytes.bytes(at, self.func.ty(*value)))
            }
            data => !data.reads_memory() && !data.has_effect(),
        };
        passed.iter().all(may_pass).then_some(behind)
    }

    /// The end of a list of instructions, for the statement of a select.
    fn cursor<'b>(&'b mut self, select: &Select, out: &'b mut Vec<Inst>) -> Cursor<'b> {
        let loc = self.func.loc(select.inst);
        Cursor { func: self.func, out, loc }
    }

    /// Adds a block without instructions.
    fn new_block(&mut self) -> Block {
        self.func.blocks.push(BlockData::default())
    }

    fn end_block(&mut self, block: Block, insts: Vec<Inst>, terminator: Option<Terminator>) {
        let data = &mut self.func.blocks[block];
        (data.insts, data.terminator) = (insts, terminator);
    }
}

/// The row that has the condition of a select.
fn row_of<'a>(select: impl Into<Option<&'a Select>>) -> Option<usize> {
    select.into().and_then(|select| select.bit).map(|(row, _)| row)
}
