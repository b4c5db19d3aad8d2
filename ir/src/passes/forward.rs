//! Replaces a load by the value that an earlier store wrote or an earlier load read at the same
//! address (store-to-load forwarding), and drops stores of a value that is at the address already.
//!
//! ```text
//! store vars:0, v0               store vars:0, v0
//! v1: i16 = load vars:0    ==>
//! v2: i16 = add v1, v1           v2: i16 = add v0, v0
//! ```
//!
//! A [`Fact`] says which value is at an address. It holds in its block, and in each block whose
//! sole predecessor is a block in which it holds. The facts are kept in a list. Each has a number
//! there; the pass's stamp plus that number is written as the mark of the fact's first byte
//! ([`ImageBytes`](super::image_bytes)), so that the fact at an address is found without a search.
//!
//! A value is forwarded for at most [`FORWARDING_WINDOW`] statements (the forwarding window). A
//! value that is kept longer needs a register all that time or is spilled to the stack, and loading
//! it again from the image is cheaper. Numbers are forwarded longer: they are fewer than truth values, and
//! no instruction that computes with 8 or 16 bits takes its operand from the image.
//!
//! It must not touch volatile accesses, and after one nothing is known of its bytes. After a call
//! of a host function that is not pure nothing is known at all.

use super::graph::Graph;
use super::image_bytes::ImageBytes;
use super::substitution::Substitution;
use super::thresholds::forward::{FORWARDING_WINDOW, FORWARDING_WINDOW_OF_NUMBERS};
use crate::{Address, Block, ConvertOp, FuncData, InstData, PrimaryMap, StatementId, Type, Value};

/// A block passes on no more facts than this to the blocks of which it is the sole predecessor.
const MAX_PASSED_ON: usize = 64;

/// If there are more facts than this, a store through an index drops all of them. Otherwise they
/// are searched for those that it may change.
const MAX_SEARCHED: usize = 256;

/// The number of bytes of the widest access.
const WIDEST: usize = 8;

/// The fact that a value is in the image at an address.
#[derive(Clone, Copy)]
struct Fact {
    /// The address of its first byte.
    start: usize,
    ty: Type,
    value: Value,
    /// The number of the statement in which it became known, counted along the path of sole
    /// predecessors.
    since: u32,
    /// Whether nothing has changed its bytes since.
    valid: bool,
}

/// What is known at the current point of a path.
struct State<'a> {
    bytes: &'a mut ImageBytes,
    /// All facts, also those of other paths.
    facts: Vec<Fact>,
    /// The number of the first fact that holds; all before it belong to other paths or are lost.
    first_fact: usize,
    /// The mark that stands for fact 0.
    stamp: u32,
    /// The number of the current statement along the path.
    now: u32,
    loc: StatementId,
    /// Whether truth values are loaded again rather than forwarded.
    reload_bits: bool,
}

/// What is known at the end of a block.
struct End {
    facts: Vec<Fact>,
    now: u32,
    loc: StatementId,
}

/// Runs the pass; returns whether it changed anything.
/// With `reload_bits`, truth values are not forwarded.
pub(super) fn run(func: &mut FuncData, bytes: &mut ImageBytes, reload_bits: bool) -> bool {
    let graph = Graph::new(func);
    // Whether each block is the sole predecessor of another. If so, its facts are kept.
    let mut is_sole_predecessor = PrimaryMap::from(vec![false; func.block_count()]);
    for &block in &graph.order {
        if let Some(before) = graph.sole_predecessor[block] {
            is_sole_predecessor[before] = true;
        }
    }
    let mut ends: PrimaryMap<Block, Option<End>> = func.blocks.keys().map(|_| None).collect();
    let mut values = Substitution::new(func);
    // A fact for each access, and one for each that is passed on.
    let count = func.inst_count() + graph.order.len() * MAX_PASSED_ON;
    let stamp = bytes.fresh_stamps(count as u32);
    let mut state = State {
        bytes,
        facts: vec![],
        first_fact: 0,
        stamp,
        now: 0,
        loc: StatementId::NONE,
        reload_bits,
    };
    let mut changed = false;
    for &block in &graph.order {
        state.enter_block(graph.sole_predecessor[block].and_then(|before| ends[before].as_ref()));
        changed |= state.block(func, block, &mut values);
        if is_sole_predecessor[block] {
            ends[block] = Some(state.facts_at_end());
        }
    }
    changed
}

impl State<'_> {
    /// Begins a block with the facts at the end of its sole predecessor, if it has one.
    fn enter_block(&mut self, before: Option<&End>) {
        self.first_fact = self.facts.len();
        match before {
            Some(end) => {
                (self.now, self.loc) = (end.now, end.loc);
                for &fact in &end.facts {
                    self.record(fact);
                }
            }
            None => (self.now, self.loc) = (0, StatementId::NONE),
        }
    }

    /// What the current block passes on: its latest facts within the forwarding window.
    fn facts_at_end(&self) -> End {
        let known = self.facts.get(self.first_fact..).unwrap_or(&[]);
        let now = self.now;
        let recent =
            known.iter().rev().filter(|fact| fact.valid && now - fact.since <= window(fact.ty));
        let mut facts: Vec<Fact> = recent.take(MAX_PASSED_ON).copied().collect();
        facts.reverse();
        End { facts, now, loc: self.loc }
    }

    /// Visits the instructions of a block; returns whether something was changed.
    fn block(&mut self, func: &mut FuncData, block: Block, values: &mut Substitution) -> bool {
        let mut insts = std::mem::take(&mut func.blocks[block].insts);
        let before = insts.len();
        let mut changed = false;
        insts.retain(|&inst| {
            let loc = func.loc(inst);
            if loc != self.loc {
                self.loc = loc;
                self.now += 1;
            }
            let mut data = *func.inst(inst);
            values.inst(&mut data);
            func.insts[inst] = data;
            match data {
                InstData::Load { ty, at } => {
                    let Some(result) = func.result(inst) else { return true };
                    match self.load(&at, ty, result) {
                        Some((value, from)) if from == ty => {
                            values.replace(result, value);
                            return false;
                        }
                        Some((arg, from)) => {
                            if let Some(op) = conversion(from, ty) {
                                func.insts[inst] = InstData::Convert { op, to: ty, arg };
                                changed = true;
                            }
                        }
                        None => {}
                    }
                    true
                }
                InstData::Store { at, value } => !self.store(func, &at, value),
                InstData::Unpack { word: _, to } => {
                    for group in to.iter() {
                        let bytes = self.bytes.group(to, group);
                        self.forget(bytes.start, bytes.end);
                    }
                    true
                }
                InstData::HostCall { function, args: _ } => {
                    if !function.is_pure() {
                        self.first_fact = self.facts.len();
                    }
                    true
                }
                _ => true,
            }
        });
        changed |= insts.len() != before;
        let data = &mut func.blocks[block];
        data.insts = insts;
        if let Some(terminator) = &mut data.terminator {
            values.terminator(terminator);
        }
        changed
    }

    /// The number of the fact that begins at an address.
    fn fact_at(&self, start: usize) -> Option<usize> {
        let mark = *self.bytes.marks(start..start + 1).first()?;
        let number = mark.checked_sub(self.stamp)? as usize;
        let fact = self.facts.get(number)?;
        (number >= self.first_fact && fact.valid && fact.start == start).then_some(number)
    }

    /// Adds a fact, which replaces the one at its address.
    fn record(&mut self, fact: Fact) {
        if let Some(number) = self.fact_at(fact.start) {
            self.facts[number].valid = false;
        }
        let number = self.facts.len() as u32;
        if let Some(mark) = self.bytes.marks_mut(fact.start..fact.start + 1).first_mut() {
            *mark = self.stamp + number;
            self.facts.push(fact);
        }
    }

    /// The value that a load finds, and the type with which it was written; if it is not known, the
    /// load's own result becomes a fact.
    fn load(&mut self, at: &Address, ty: Type, result: Value) -> Option<(Value, Type)> {
        let bytes = self.bytes.bytes(at, ty);
        if at.volatile {
            self.forget(bytes.start, bytes.end);
            return None;
        }
        if at.index.is_some() || self.reload_bits && ty == Type::I1 {
            return None;
        }
        if let Some(number) = self.fact_at(bytes.start)
            && let Some(&fact) = self.facts.get(number)
            && self.now - fact.since <= window(ty)
            && (fact.ty == ty || conversion(fact.ty, ty).is_some())
        {
            return Some((fact.value, fact.ty));
        }
        let (start, since) = (bytes.start, self.now);
        self.record(Fact { start, ty, value: result, since, valid: true });
        None
    }

    /// Adds the fact of a store; returns whether it writes what is there already.
    fn store(&mut self, func: &FuncData, at: &Address, value: Value) -> bool {
        let ty = func.ty(value);
        let bytes = self.bytes.bytes(at, ty);
        if at.volatile {
            self.forget(bytes.start, bytes.end);
            return false;
        }
        if at.index.is_some() {
            self.forget(bytes.start, bytes.end);
            return false;
        }
        if let Some(number) = self.fact_at(bytes.start)
            && let Some(fact) = self.facts.get(number)
            && (fact.ty, fact.value) == (ty, value)
        {
            return true;
        }
        self.forget(bytes.start, bytes.end);
        let (start, since) = (bytes.start, self.now);
        self.record(Fact { start, ty, value, since, valid: true });
        false
    }

    /// Drops the facts about some bytes.
    fn forget(&mut self, start: usize, end: usize) {
        if end - start <= WIDEST {
            for byte in (start + 1).saturating_sub(WIDEST)..end {
                if let Some(number) = self.fact_at(byte) {
                    let fact = &mut self.facts[number];
                    fact.valid &= byte + fact.ty.bytes() as usize <= start;
                }
            }
            return;
        }
        if self.facts.len() - self.first_fact > MAX_SEARCHED {
            self.first_fact = self.facts.len();
        }
        for fact in &mut self.facts[self.first_fact..] {
            let behind = fact.start + fact.ty.bytes() as usize;
            fact.valid &= behind <= start || end <= fact.start;
        }
    }
}

/// The conversion of a value of type `from` that was stored to the value that a load of type `to`
/// reads at the same address; `None` if no conversion gives it.
fn conversion(from: Type, to: Type) -> Option<ConvertOp> {
    match (from, to) {
        (Type::F64, Type::I64) | (Type::I64, Type::F64) => Some(ConvertOp::Bitcast),
        (Type::F64, _) | (_, Type::F64 | Type::I1) => None,
        (Type::I1, Type::I8) => Some(ConvertOp::Zext),
        (from, to) if from > to => Some(ConvertOp::Trunc),
        _ => None,
    }
}

/// The forwarding window of values of a type.
fn window(ty: Type) -> u32 {
    match ty {
        Type::I8 | Type::I16 | Type::I32 => FORWARDING_WINDOW_OF_NUMBERS,
        Type::I1 | Type::I64 | Type::F64 => FORWARDING_WINDOW,
    }
}
