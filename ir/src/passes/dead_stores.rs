//! Drops stores whose bytes are all written again before anything could look at them: a load
//! whose result is used, a call of the host, a volatile access, or an end of the way, behind
//! which the program may be stopped, suspended or begun anew. What was only computed for such a
//! store is dropped with it, and its loads look at nothing.
//!
//! The walk goes backwards over the blocks. A block hands the bytes that are surely written again
//! from its beginning on to those that lead to it; where control may go two ways both must write
//! them, and along a way back nothing is known. Functions come last to first, and labels hand on
//! as blocks do, so a program that was cut into many functions is seen as the row that it is.

use super::graph::Graph;
use super::image_bytes::Places;
use crate::{Block, FuncData, InstData, Label, Terminator};

/// A load through an index that may touch more bytes than this counts as one that touches all.
const LOOKED_THROUGH: usize = 64;

/// A block hands on no more bytes than this, or twice as many as it has instructions, which keeps
/// the pass linear.
const HANDED_ON: usize = 64;

/// For each label of the functions behind, the bytes that are written again from there on before
/// anything looks at them.
#[derive(Debug, Default)]
pub(super) struct Again {
    labels: Vec<Vec<u32>>,
}

impl Again {
    /// Nothing is known.
    pub(super) fn new(labels: u32) -> Self {
        Self { labels: vec![vec![]; labels as usize] }
    }

    fn behind(&self, label: Label) -> &[u32] {
        self.labels.get(label.index()).map_or(&[], Vec::as_slice)
    }
}

/// Runs the pass.
pub(super) fn run(func: &mut FuncData, places: &mut Places, again: &mut Again) {
    let graph = Graph::new(func);
    let mut walk = Walk {
        places,
        blocks: vec![vec![]; func.block_count()],
        used: vec![false; func.value_count()],
        stamp: 0,
        written: vec![],
    };
    // Definitions come before uses in this order, so backwards every use is seen first.
    for &block in graph.order.iter().rev() {
        walk.begin(func, block, again);
        let count = walk.block(func, block);
        walk.blocks[block.index()] = walk.hand_on(count);
    }
    for &(label, block) in func.entries() {
        if let Some(slot) = again.labels.get_mut(label.index()) {
            slot.clone_from(&walk.blocks[block.index()]);
        }
    }
}

struct Walk<'a> {
    places: &'a mut Places,
    /// What each block hands on, where it was seen already.
    blocks: Vec<Vec<u32>>,
    /// Values that something kept needs.
    used: Vec<bool>,
    /// A byte with this note is written again before anything looks at it.
    stamp: u32,
    /// The bytes that had this note once, the farthest first.
    written: Vec<u32>,
}

impl Walk<'_> {
    /// Goes to a block's end.
    fn begin(&mut self, func: &FuncData, block: Block, again: &Again) {
        self.nothing();
        let Some(terminator) = &func.block(block).terminator else { return };
        terminator.for_each_arg(|value| self.used[value.index()] = true);
        match terminator {
            Terminator::Jump(to) => self.written.extend(self.blocks[to.block.index()].iter().rev()),
            Terminator::Goto(label) => self.written.extend(again.behind(*label).iter().rev()),
            Terminator::Brif { cond: _, then, otherwise } => {
                let one = &self.blocks[then.block.index()];
                let stamp = self.stamp;
                one.iter().for_each(|&byte| note(self.places, byte, stamp));
                let is_noted = |byte: &&u32| noted(self.places, **byte, stamp);
                let other = &self.blocks[otherwise.block.index()];
                self.written.extend(other.iter().rev().filter(is_noted));
                self.stamp = self.places.fresh(1);
            }
            Terminator::Switch { .. }
            | Terminator::GotoIndirect(_)
            | Terminator::Suspend(_)
            | Terminator::Return
            | Terminator::Trap(_) => {}
        }
        for &byte in &self.written {
            note(self.places, byte, self.stamp);
        }
    }

    fn nothing(&mut self) {
        self.stamp = self.places.fresh(1);
        self.written.clear();
    }

    /// Goes through a block; gives the number of its instructions.
    fn block(&mut self, func: &mut FuncData, block: Block) -> usize {
        let mut insts = std::mem::take(&mut func.blocks[block.index()].insts);
        let count = insts.len();
        let mut kept = count;
        for at in (0..count).rev() {
            let inst = insts[at];
            let data = func.inst(inst);
            let wanted = func.result(inst).is_some_and(|value| self.used[value.index()]);
            if !wanted && !data.has_effect() || self.is_dead(func, data) {
                continue;
            }
            data.for_each_arg(|value| self.used[value.index()] = true);
            kept -= 1;
            insts[kept] = inst;
        }
        insts.drain(..kept);
        func.blocks[block.index()].insts = insts;
        count
    }

    /// Whether an instruction is a store that nobody sees; notes what it writes or looks at.
    fn is_dead(&mut self, func: &FuncData, data: &InstData) -> bool {
        match data {
            InstData::Store { at, value } if !at.volatile && at.index.is_none() => {
                let bytes = self.places.bytes(at, func.ty(*value));
                let stamp = self.stamp;
                let first = bytes.start as u32;
                let notes = self.places.notes_mut(bytes);
                let before = self.written.len();
                for (byte, note) in (first..).zip(notes.iter_mut()) {
                    if *note != stamp {
                        *note = stamp;
                        self.written.push(byte);
                    }
                }
                !notes.is_empty() && self.written.len() == before
            }
            // Which bytes it writes is not known, and it looks at none.
            InstData::Store { at, value: _ } if !at.volatile => false,
            InstData::Load { ty, at } if !at.volatile => {
                let bytes = self.places.bytes(at, *ty);
                if bytes.len() > LOOKED_THROUGH {
                    self.nothing();
                } else {
                    self.places.notes_mut(bytes).fill(0);
                }
                false
            }
            data => {
                if data.has_effect() {
                    self.nothing();
                }
                false
            }
        }
    }

    /// What is known at a block's beginning, the nearest first.
    fn hand_on(&mut self, insts: usize) -> Vec<u32> {
        let most = HANDED_ON.max(insts * 2);
        let mut bytes = vec![];
        for &byte in self.written.iter().rev() {
            if bytes.len() < most && noted(self.places, byte, self.stamp) {
                // Each is handed on once.
                note(self.places, byte, 0);
                bytes.push(byte);
            }
        }
        bytes
    }
}

fn note(places: &mut Places, byte: u32, stamp: u32) {
    let byte = byte as usize;
    places.notes_mut(byte..byte + 1).fill(stamp);
}

fn noted(places: &Places, byte: u32, stamp: u32) -> bool {
    let byte = byte as usize;
    places.notes(byte..byte + 1).first() == Some(&stamp)
}
