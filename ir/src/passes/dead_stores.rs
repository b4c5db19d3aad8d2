//! Drops stores whose bytes are all overwritten before anything can read them (dead stores), and
//! what was computed only for them.
//!
//! ```text
//! v0: i8 = load vars:1                v0: i8 = load vars:1
//! store vars:0, v0               ==>
//! v1: i8 = load vars:2                v1: i8 = load vars:2
//! store vars:0, v1                    store vars:0, v1
//! ```
//!
//! A byte can be read by a load whose result is used, by a host function that is called, by the
//! observer of a volatile access, and by the executive when the scan ends, is suspended or is
//! stopped. A byte that is surely overwritten before any of these is *dead*. The pass computes dead
//! bytes backwards, as liveness analysis does for registers: a store makes its bytes dead, a load
//! makes them live, and anything else that can read makes all of them live.
//!
//! A block passes the bytes that are dead at its beginning to its predecessors. At a branch only
//! bytes that are dead both ways are dead; along an edge back to a block that was not visited yet
//! nothing is known. Labels pass on dead bytes as blocks do ([`DeadBytes`]), so that cutting a program into functions
//! loses little. These bytes are found before all passes: no pass changes what a function reads or overwrites
//! as far as anyone can tell, so what was dead at a label stays so. Then each function can be treated by itself.
//!
//! The set of dead bytes is kept as marks on the bytes of the image
//! ([`ImageBytes`](super::image_bytes)): a byte is dead if its
//! mark is the current stamp.
//!
//! It must not drop volatile stores, nor stores through an index (it does not know which bytes they
//! write).

use super::graph::Graph;
use super::image_bytes::ImageBytes;
use crate::{
    Block, FuncData, Inst, InstData, Label, Module, PrimaryMap, SecondaryMap, Terminator, Value,
};

/// A load through an index that may read more bytes than this makes all bytes live.
const MAX_LOADED_BYTES: usize = 64;

/// A block passes on no more dead bytes than this, or than twice the number of its instructions
/// if that is more. This keeps the time linear.
const MAX_PASSED_ON: usize = 64;

/// For each label the bytes that are dead there.
#[derive(Debug, Default)]
pub(super) struct DeadBytes {
    labels: SecondaryMap<Label, Vec<u32>>,
}

impl DeadBytes {
    /// Those of a module. Control mostly goes from a function to a later one, so the last function is visited first;
    /// at a label that control comes to from a later function, nothing is known there.
    pub(super) fn of(module: &Module, bytes: &mut ImageBytes) -> Self {
        let mut dead = Self { labels: vec![vec![]; module.label_count as usize].into() };
        let mut insts = vec![];
        for func in module.funcs.iter().rev() {
            let mut walk = Walk::new(func, bytes);
            for &block in Graph::new(func).order.iter().rev() {
                insts.clone_from(&func.block(block).insts);
                walk.block(func, block, &mut insts, &dead);
            }
            for &(label, block) in func.entries() {
                dead.labels[label].clone_from(&walk.blocks[block]);
            }
        }
        dead
    }

    fn at(&self, label: Label) -> &[u32] {
        &self.labels[label]
    }
}

/// Runs the pass.
pub(super) fn run(func: &mut FuncData, bytes: &mut ImageBytes, dead: &DeadBytes) {
    let graph = Graph::new(func);
    let mut walk = Walk::new(func, bytes);
    // Definitions come before uses in this order, so backwards every use is seen first.
    for &block in graph.order.iter().rev() {
        let mut insts = std::mem::take(&mut func.blocks[block].insts);
        walk.block(func, block, &mut insts, dead);
        func.blocks[block].insts = insts;
    }
}

/// The walk backwards through a function.
struct Walk<'a> {
    bytes: &'a mut ImageBytes,
    /// The bytes that are dead at the beginning of each block visited so far.
    blocks: PrimaryMap<Block, Vec<u32>>,
    /// The values that an instruction that stays uses.
    used: PrimaryMap<Value, bool>,
    /// A byte with this mark is dead.
    stamp: u32,
    /// The bytes that got this mark, in the order of the stores; a byte may be there twice, and some may have
    /// lost the mark.
    marked: Vec<u32>,
}

impl<'a> Walk<'a> {
    fn new(func: &FuncData, bytes: &'a mut ImageBytes) -> Self {
        Self {
            bytes,
            blocks: vec![vec![]; func.block_count()].into(),
            used: vec![false; func.value_count()].into(),
            stamp: 0,
            marked: vec![],
        }
    }

    /// Visits a block, given with its instructions, and drops those of them that are dead.
    fn block(&mut self, func: &FuncData, block: Block, insts: &mut Vec<Inst>, dead: &DeadBytes) {
        let count = insts.len();
        self.start_at_end_of(func, block, dead);
        self.instructions(func, insts);
        self.blocks[block] = self.dead_at_begin(count);
    }

    /// Begins a block at its end: finds the bytes that are dead there.
    fn start_at_end_of(&mut self, func: &FuncData, block: Block, dead: &DeadBytes) {
        self.make_all_live();
        let Some(terminator) = &func.block(block).terminator else { return };
        terminator.for_each_arg(|value| self.used[value] = true);
        match terminator {
            Terminator::Jump(to) => self.marked.extend(self.blocks[to.block].iter().rev()),
            Terminator::Goto(label) => self.marked.extend(dead.at(*label).iter().rev()),
            Terminator::Brif { cond: _, then, otherwise } => {
                let one = &self.blocks[then.block];
                let stamp = self.stamp;
                one.iter().for_each(|&byte| mark(self.bytes, byte, stamp));
                let is_dead_too = |byte: &&u32| is_marked(self.bytes, **byte, stamp);
                let other = &self.blocks[otherwise.block];
                self.marked.extend(other.iter().rev().filter(is_dead_too));
                self.stamp = self.bytes.fresh_stamps(1);
            }
            Terminator::Switch { .. }
            | Terminator::GotoIndirect(_)
            | Terminator::Suspend(_)
            | Terminator::Return
            | Terminator::Trap(_)
            | Terminator::TrapAt { .. } => {}
        }
        for &byte in &self.marked {
            mark(self.bytes, byte, self.stamp);
        }
    }

    /// Makes every byte live.
    fn make_all_live(&mut self) {
        self.stamp = self.bytes.fresh_stamps(1);
        self.marked.clear();
    }

    /// Visits a block's instructions from the last to the first and drops those that are dead.
    fn instructions(&mut self, func: &FuncData, insts: &mut Vec<Inst>) {
        let mut kept = insts.len();
        for at in (0..insts.len()).rev() {
            let inst = insts[at];
            let data = func.inst(inst);
            let is_used = func.result(inst).is_some_and(|value| self.used[value]);
            if !is_used && !data.has_effect() || self.visit_access(func, data) {
                continue;
            }
            data.for_each_arg(|value| self.used[value] = true);
            kept -= 1;
            insts[kept] = inst;
        }
        insts.drain(..kept);
    }

    /// Enters which bytes an instruction makes dead or live; returns whether it is a dead store.
    fn visit_access(&mut self, func: &FuncData, data: &InstData) -> bool {
        match data {
            InstData::Store { at, value } if !at.volatile && at.index.is_none() => {
                let bytes = self.bytes.bytes(at, func.ty(*value));
                let stamp = self.stamp;
                let first = bytes.start as u32;
                let marks = self.bytes.marks_mut(bytes);
                let is_dead = !marks.is_empty() && marks.iter().all(|mark| *mark == stamp);
                // Also bytes that were dead already count as those that are overwritten soonest: a register that
                // every statement stores would otherwise be forgotten after many bytes that are stored once.
                self.marked.extend((first..).take(marks.len()));
                marks.fill(stamp);
                is_dead
            }
            // A store through an index: which bytes it writes is not known, and it reads none.
            InstData::Store { at, value: _ } if !at.volatile => false,
            InstData::Unpack { word: _, to } => {
                let (stamp, mut are_dead) = (self.stamp, true);
                for group in to.iter() {
                    let bytes = self.bytes.group(*to, group);
                    self.marked.extend(bytes.clone().map(|byte| byte as u32));
                    let marks = self.bytes.marks_mut(bytes);
                    are_dead &= !marks.is_empty() && marks.iter().all(|mark| *mark == stamp);
                    marks.fill(stamp);
                }
                are_dead
            }
            InstData::Pack { from } => {
                for group in from.iter() {
                    let bytes = self.bytes.group(*from, group);
                    self.bytes.marks_mut(bytes).fill(0);
                }
                false
            }
            InstData::Load { ty, at } if !at.volatile => {
                let bytes = self.bytes.bytes(at, *ty);
                if bytes.len() > MAX_LOADED_BYTES {
                    self.make_all_live();
                } else {
                    self.bytes.marks_mut(bytes).fill(0);
                }
                false
            }
            data => {
                if data.has_effect() {
                    self.make_all_live();
                }
                false
            }
        }
    }

    /// The bytes that are dead at the beginning of the block that was just visited, which had this
    /// number of instructions. Those that are overwritten soonest come first.
    fn dead_at_begin(&mut self, insts: usize) -> Vec<u32> {
        let most = MAX_PASSED_ON.max(insts * 2);
        let mut bytes = vec![];
        for &byte in self.marked.iter().rev() {
            if bytes.len() < most && is_marked(self.bytes, byte, self.stamp) {
                // The byte may be in the list again; it is passed on once.
                mark(self.bytes, byte, 0);
                bytes.push(byte);
            }
        }
        bytes
    }
}

fn mark(bytes: &mut ImageBytes, byte: u32, stamp: u32) {
    let byte = byte as usize;
    bytes.marks_mut(byte..byte + 1).fill(stamp);
}

fn is_marked(bytes: &ImageBytes, byte: u32, stamp: u32) -> bool {
    let byte = byte as usize;
    bytes.marks(byte..byte + 1).first() == Some(&stamp)
}
