//! Takes a load's value from the store or load before it, within bounds.
//!
//! A value is forwarded within its block, and into blocks that control reaches from there alone,
//! for at most [`WINDOW`] statements: a value that is kept longer takes a register that others
//! need, is spilled, and loading it from its own place is cheaper. Stores stay where they are;
//! only one that writes what its place holds already is dropped.
//!
//! Volatile accesses are left alone, and nothing is known of their bytes. After a call of the
//! host that is not pure nothing is known at all.

use super::graph::Graph;
use super::image_bytes::Places;
use super::substitution::Substitution;
use crate::{Address, Block, ConvertOp, FuncData, InstData, SourceLoc, Type, Value};

/// So many statements behind its own a value is still forwarded in.
pub(super) const WINDOW: u32 = 8;

/// A block hands on no more than this.
const HANDED_ON: usize = 64;

/// A store through an index forgets everything rather than look through more facts than this.
const LOOKED_THROUGH: usize = 256;

/// Bytes that the widest access touches.
const WIDEST: usize = 8;

/// What stands at a place of the image.
#[derive(Clone, Copy)]
struct Fact {
    start: usize,
    ty: Type,
    value: Value,
    /// The statement in which it became known, counted along the path.
    since: u32,
    valid: bool,
}

struct State<'a> {
    places: &'a mut Places,
    facts: Vec<Fact>,
    /// The first fact of this path.
    base: usize,
    /// The note that fact 0 has.
    stamp: u32,
    /// The statement's number along the path.
    now: u32,
    loc: SourceLoc,
}

/// What a block hands on to those behind it.
struct End {
    facts: Vec<Fact>,
    now: u32,
    loc: SourceLoc,
}

/// Runs the pass; says whether it changed anything.
pub(super) fn run(func: &mut FuncData, places: &mut Places) -> bool {
    let graph = Graph::new(func);
    let mut heirs = vec![false; func.block_count()];
    for &block in &graph.order {
        if let Some(before) = graph.before[block.index()] {
            heirs[before.index()] = true;
        }
    }
    let mut ends: Vec<Option<End>> = Vec::new();
    ends.resize_with(func.block_count(), || None);
    let mut values = Substitution::new(func);
    // A fact for each access, and once more for each that is handed on.
    let count = func.inst_count() + graph.order.len() * HANDED_ON;
    let stamp = places.fresh(count as u32);
    let mut state = State { places, facts: vec![], base: 0, stamp, now: 0, loc: SourceLoc::NONE };
    let mut changed = false;
    for &block in &graph.order {
        state.begin(graph.before[block.index()].and_then(|before| ends[before.index()].as_ref()));
        changed |= state.block(func, block, &mut values);
        if heirs[block.index()] {
            ends[block.index()] = Some(state.end());
        }
    }
    changed
}

impl State<'_> {
    fn begin(&mut self, before: Option<&End>) {
        self.base = self.facts.len();
        match before {
            Some(end) => {
                (self.now, self.loc) = (end.now, end.loc);
                for &fact in &end.facts {
                    self.learn(fact);
                }
            }
            None => (self.now, self.loc) = (0, SourceLoc::NONE),
        }
    }

    fn end(&self) -> End {
        let known = self.facts.get(self.base..).unwrap_or(&[]);
        let now = self.now;
        let recent = known.iter().rev().filter(|fact| fact.valid && now - fact.since <= WINDOW);
        let mut facts: Vec<Fact> = recent.take(HANDED_ON).copied().collect();
        facts.reverse();
        End { facts, now, loc: self.loc }
    }

    fn block(&mut self, func: &mut FuncData, block: Block, values: &mut Substitution) -> bool {
        let mut insts = std::mem::take(&mut func.blocks[block.index()].insts);
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
            func.insts[inst.index()] = data;
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
                                func.insts[inst.index()] = InstData::Convert { op, to: ty, arg };
                                changed = true;
                            }
                        }
                        None => {}
                    }
                    true
                }
                InstData::Store { at, value } => !self.store(func, &at, value),
                InstData::HostCall { function, args: _ } => {
                    if !function.is_pure() {
                        self.base = self.facts.len();
                    }
                    true
                }
                _ => true,
            }
        });
        changed |= insts.len() != before;
        let data = &mut func.blocks[block.index()];
        data.insts = insts;
        if let Some(terminator) = &mut data.terminator {
            values.terminator(terminator);
        }
        changed
    }

    /// What is known to begin at a byte.
    fn at(&self, start: usize) -> Option<usize> {
        let note = *self.places.notes(start..start + 1).first()?;
        let number = note.checked_sub(self.stamp)? as usize;
        let fact = self.facts.get(number)?;
        (number >= self.base && fact.valid && fact.start == start).then_some(number)
    }

    fn learn(&mut self, fact: Fact) {
        if let Some(number) = self.at(fact.start) {
            self.facts[number].valid = false;
        }
        let number = self.facts.len() as u32;
        if let Some(note) = self.places.notes_mut(fact.start..fact.start + 1).first_mut() {
            *note = self.stamp + number;
            self.facts.push(fact);
        }
    }

    fn load(&mut self, at: &Address, ty: Type, result: Value) -> Option<(Value, Type)> {
        let bytes = self.places.bytes(at, ty);
        if at.volatile {
            self.forget(bytes.start, bytes.end);
            return None;
        }
        if at.index.is_some() {
            return None;
        }
        if let Some(number) = self.at(bytes.start)
            && let Some(&fact) = self.facts.get(number)
            && self.now - fact.since <= WINDOW
            && (fact.ty == ty || conversion(fact.ty, ty).is_some())
        {
            return Some((fact.value, fact.ty));
        }
        let (start, since) = (bytes.start, self.now);
        self.learn(Fact { start, ty, value: result, since, valid: true });
        None
    }

    /// Notes a store; says whether it writes what is there already.
    fn store(&mut self, func: &FuncData, at: &Address, value: Value) -> bool {
        let ty = func.ty(value);
        let bytes = self.places.bytes(at, ty);
        if at.volatile {
            self.forget(bytes.start, bytes.end);
            return false;
        }
        if at.index.is_some() {
            self.forget(bytes.start, bytes.end);
            return false;
        }
        if let Some(number) = self.at(bytes.start)
            && let Some(fact) = self.facts.get(number)
            && (fact.ty, fact.value) == (ty, value)
        {
            return true;
        }
        self.forget(bytes.start, bytes.end);
        let (start, since) = (bytes.start, self.now);
        self.learn(Fact { start, ty, value, since, valid: true });
        false
    }

    /// Forgets what is known of some bytes.
    fn forget(&mut self, start: usize, end: usize) {
        if end - start <= WIDEST {
            for byte in (start + 1).saturating_sub(WIDEST)..end {
                if let Some(number) = self.at(byte) {
                    let fact = &mut self.facts[number];
                    fact.valid &= byte + fact.ty.bytes() as usize <= start;
                }
            }
            return;
        }
        if self.facts.len() - self.base > LOOKED_THROUGH {
            self.base = self.facts.len();
        }
        for fact in &mut self.facts[self.base..] {
            let behind = fact.start + fact.ty.bytes() as usize;
            fact.valid &= behind <= start || end <= fact.start;
        }
    }
}

/// How a value of one type that was written is read as another at the same place.
fn conversion(from: Type, to: Type) -> Option<ConvertOp> {
    match (from, to) {
        (Type::F64, Type::I64) | (Type::I64, Type::F64) => Some(ConvertOp::Bitcast),
        (Type::F64, _) | (_, Type::F64 | Type::I1) => None,
        (Type::I1, Type::I8) => Some(ConvertOp::Zext),
        (from, to) if from > to => Some(ConvertOp::Trunc),
        _ => None,
    }
}
