//! Computes many bits of a word at once, where consecutive statements (a *row*) do the same with one bit each.
//!
//! ```text
//! M1=M101 & !M201              v0: i32 = load words:0        (M101, M102, …)
//! M2=M102 & !M202       ==>    v1: i32 = load words:8        (M201, M202, …)
//! M3=M103 & !M203              v2: i32 = not v1
//! …                            v3: i32 = and v0, v2
//!                              store words:16, (load words:16 & ~7) | (v3 & 7)
//! ```
//!
//! The pass examines each stored word that is joined of single bits, which `forward` and `packed_bits`
//! make of such statements. Each of these bits is a *lane*. If all lanes are computed by the same operation, the
//! operation is done once on words, and the operands of all lanes are rows of bits in turn. A row whose
//! bits stand side by side in a word is that word, shifted. A row that was computed before for another
//! word is not computed again. The bits of any other row are gathered, each where its statement computed
//! it, so that nothing is kept in registers for longer than before.
//!
//! A word is changed only if that takes fewer instructions. [`selects`] treats what the bits of a row decide.

mod emit;
mod selects;

use std::collections::VecDeque;

use super::graph::Graph;
use super::image_bytes::ImageBytes;
use super::thresholds::rows::MIN_LANES;
use super::value_range::{ValueRanges, mask};
use crate::InstBuilder;
use crate::tables::FastSet;
use crate::{
    Address, BinaryOp, Block, ConvertOp, FuncData, Inst, InstData, PrimaryMap, SecondaryMap,
    StatementId, Type, UnaryOp, Value,
};

/// Words that are joined of more parts than this stay as they are.
const MAX_PARTS: usize = 256;

/// Operations are followed to this depth from a stored bit.
const MAX_DEPTH: u32 = 6;

/// Through this many shifts, masks and conversions a bit is followed to the word that it is a bit of.
const MAX_STEPS: usize = 16;

/// No more rows than this are remembered.
const MAX_KNOWN: usize = 16;

/// No more loads than this are remembered.
const MAX_LOADS: usize = 64;

/// A bit of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Lane {
    /// The value that it is a bit of.
    value: Value,
    /// The number of the bit in that value, from 0 for the lowest.
    bit: u8,
    /// The number of the bit in the stored word.
    to: u8,
}

/// How a row of lanes is computed as one word. The bits of that word that are not lanes may have any value.
enum Row {
    /// It was computed before, as this word.
    Known(Value),
    /// It is this word, shifted left by that many bits; if the number is negative, right.
    Word(Value, i32),
    /// An operation on one or two rows, which gives these lanes.
    Operation(Operation, Vec<Row>, Vec<Lane>),
    /// Each lane is moved to its place by itself.
    Gather(Vec<Lane>),
}

/// An operation that treats all bits of a word alike.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Operation {
    Not,
    Binary(BinaryOp),
}

/// A function that is being changed.
struct Rows<'a> {
    func: &'a mut FuncData,
    bytes: &'a ImageBytes,
    ranges: ValueRanges,
    /// For each value the place of its definition among the instructions of the current block. It is
    /// 0 for one that another block defines.
    places: SecondaryMap<Value, usize>,
    /// For each value the first load in its block that reads the same, or the value itself.
    first_load: PrimaryMap<Value, Value>,
    /// The rows of the current block that were computed last: their lanes and the words.
    known: VecDeque<(FastSet<Lane>, Value)>,
    /// How often each value was used before the pass, and how often new instructions use it.
    uses: SecondaryMap<Value, u32>,
    /// New instructions, each with the place of the instruction before which it stands.
    inserted: Vec<(usize, Inst)>,
    /// The source place of the store that is examined.
    loc: StatementId,
    /// The place of the instruction before which new ones are inserted.
    at: usize,
}

/// Whether a function stores a word that may be joined of bits. Otherwise there is nothing to do.
pub(super) fn applies(func: &FuncData) -> bool {
    let is_joined = |&inst: &Inst| match *func.inst(inst) {
        InstData::Store { at: _, value } => {
            func.ty(value) != Type::I1
                && matches!(func.def_inst(value), Some(InstData::Binary { op: BinaryOp::Or, .. }))
        }
        _ => false,
    };
    func.blocks.values().any(|block| block.insts.iter().any(is_joined))
}

/// Runs the pass; returns whether it changed anything.
pub(super) fn run(func: &mut FuncData, bytes: &ImageBytes) -> bool {
    if !applies(func) {
        return false;
    }
    let graph = Graph::new(func);
    let ranges = ValueRanges::new(func);
    let places = vec![0; func.value_count()].into();
    let first_load = func.values.keys().collect();
    let uses = func.use_counts();
    let (known, inserted, loc) = (VecDeque::new(), vec![], StatementId::NONE);
    let mut rows =
        Rows { func, bytes, ranges, places, first_load, known, uses, inserted, loc, at: 0 };
    let mut changed = false;
    for &block in &graph.order {
        changed |= rows.block(block);
    }
    changed
}

impl InstBuilder for Rows<'_> {
    fn func(&self) -> &FuncData {
        self.func
    }

    fn build(&mut self, data: InstData) -> Value {
        let (inst, result) = self.func.append(data, self.loc);
        data.for_each_arg(|value| {
            if let Some(count) = self.uses.get_mut(value) {
                *count += 1;
            }
        });
        self.inserted.push((self.at, inst));
        result
    }
}

impl Rows<'_> {
    /// Examines a block; returns whether it was changed.
    fn block(&mut self, block: Block) -> bool {
        let insts = std::mem::take(&mut self.func.blocks[block].insts);
        self.known.clear();
        self.note_block(&insts);
        for (at, &inst) in insts.iter().enumerate() {
            if let InstData::Store { at: to, value } = *self.func.inst(inst)
                && matches!(self.func.ty(value), Type::I8 | Type::I16 | Type::I32)
                && to.index.is_none()
                && !to.volatile
            {
                self.loc = self.func.loc(inst);
                if let Some(value) = self.row_store(value, at) {
                    self.func.insts[inst] = InstData::Store { at: to, value };
                }
            }
        }
        let defined: Vec<Value> = insts.iter().filter_map(|&inst| self.func.result(inst)).collect();
        let changed = !self.inserted.is_empty();
        // New instructions for the same place keep their order.
        self.inserted.sort_by_key(|&(at, _)| at);
        let mut inserted = std::mem::take(&mut self.inserted).into_iter().peekable();
        let mut all = Vec::with_capacity(insts.len() + inserted.len());
        for (at, inst) in insts.into_iter().enumerate() {
            while let Some((_, new)) = inserted.next_if(|&(before, _)| before <= at) {
                all.push(new);
            }
            all.push(inst);
        }
        all.extend(inserted.map(|(_, inst)| inst));
        let moved = self.selects(block, all);
        for value in defined {
            self.places[value] = 0;
        }
        changed || moved
    }

    /// Finds out, for each instruction of a block, its place, the range of its result, and an equal load before it.
    fn note_block(&mut self, insts: &[Inst]) {
        let mut loads: Vec<(Address, Type, Value)> = vec![];
        for (at, &inst) in insts.iter().enumerate() {
            let data = *self.func.inst(inst);
            if let Some(result) = self.func.result(inst) {
                self.ranges.note(self.func, result, &data);
                self.places[result] = at;
                if let InstData::Load { ty, at } = data
                    && at.index.is_none()
                    && !at.volatile
                {
                    match loads.iter().find(|load| (load.0, load.1) == (at, ty)) {
                        Some(&(_, _, first)) => self.first_load[result] = first,
                        None if loads.len() < MAX_LOADS => loads.push((at, ty, result)),
                        None => {}
                    }
                }
            }
            match data {
                InstData::Store { at, value } => {
                    let written = self.bytes.bytes(&at, self.func.ty(value));
                    loads.retain(|(at, ty, _)| {
                        let read = self.bytes.bytes(at, *ty);
                        read.end <= written.start || written.end <= read.start
                    });
                }
                data if data.has_effect() => loads.clear(),
                _ => {}
            }
        }
    }

    /// Computes the lanes of a word that is stored at a place of the block as rows; gives the word to
    /// store instead, if that pays.
    fn row_store(&mut self, value: Value, at: usize) -> Option<Value> {
        let ty = self.func.ty(value);
        let (mut found, mut rest) = (vec![], vec![]);
        // The parts that the word is joined of, each with the bits of it that count.
        let mut pending = vec![(value, mask(ty))];
        let (mut taken, mut visited) = (0u64, 0);
        while let Some((part, kept)) = pending.pop() {
            visited += 1;
            if visited > MAX_PARTS {
                return None;
            }
            match self.func.def_inst(part) {
                Some(&InstData::Binary { op: BinaryOp::Or, args: [a, b] }) => {
                    pending.extend([(b, kept), (a, kept)]);
                    continue;
                }
                Some(&InstData::Binary { op: BinaryOp::And, args: [a, by] })
                    if let Some(by) = self.func.constant(by) =>
                {
                    pending.push((a, kept & by as u64));
                    continue;
                }
                _ => {}
            }
            let ones = self.ranges.possible_ones(part) & kept;
            if ones == 0 {
                continue;
            }
            if ones.is_power_of_two() && taken & ones == 0 {
                taken |= ones;
                let bit = ones.trailing_zeros() as u8;
                let place = self.places[part] + 1;
                found.push((Lane { value: part, bit, to: bit }, place));
            } else {
                rest.push((part, kept));
            }
        }
        if found.len() < MIN_LANES {
            return None;
        }
        // Always in the same order, so that a row that was computed before is found again.
        found.sort_by_key(|(lane, _)| lane.to);
        let (lanes, places): (Vec<Lane>, Vec<usize>) = found.into_iter().unzip();
        let row = self.row(ty, &lanes, MAX_DEPTH);
        let before = lanes.len() * (2 + row.operations());
        if matches!(row, Row::Gather(_)) || row.cost() + 2 >= before {
            return None;
        }
        let word = self.emit(ty, &row, &places, at);
        self.at = at;
        let mut all = self.binary_imm(BinaryOp::And, word, taken as i64);
        for (part, kept) in rest {
            let part = match self.ranges.possible_ones(part) & !kept {
                0 => part,
                _ => self.binary_imm(BinaryOp::And, part, kept as i64),
            };
            all = self.binary(BinaryOp::Or, all, part);
        }
        Some(all)
    }

    /// How a row of bits is best computed; operations are followed to a depth.
    fn row(&self, ty: Type, lanes: &[Lane], depth: u32) -> Row {
        let lanes: Vec<Lane> = lanes.iter().map(|&lane| self.source(ty, lane)).collect();
        if let Some(known) = self.known(&lanes) {
            return Row::Known(known);
        }
        let Some(&first) = lanes.first() else { return Row::Gather(lanes) };
        let distance = |lane: &Lane| i32::from(lane.to) - i32::from(lane.bit);
        let same_word = |lane: &Lane| {
            self.func.ty(lane.value) == ty
                && self.first(lane.value) == self.first(first.value)
                && distance(lane) == distance(&first)
        };
        if lanes.iter().all(same_word) {
            // All loads of the word are equal. That of the last lane is probably the latest one, and is kept in
            // a register for the shortest time.
            return Row::Word(lanes.last().unwrap_or(&first).value, distance(&first));
        }
        if depth > 0
            && let Some((operation, operands)) = self.operands(ty, &lanes)
        {
            let rows = operands.iter().map(|lanes| self.row(ty, lanes, depth - 1)).collect();
            return Row::Operation(operation, rows, lanes);
        }
        Row::Gather(lanes)
    }

    /// The word of a row that was computed before and contains all these lanes.
    fn known(&self, lanes: &[Lane]) -> Option<Value> {
        let has_all = |known: &FastSet<Lane>| {
            lanes.iter().all(|&lane| known.contains(&self.with_first_load(lane)))
        };
        self.known.iter().find(|(known, _)| has_all(known)).map(|&(_, word)| word)
    }

    /// The same lane; if it is a bit of a load, as a bit of the first load that reads the same.
    fn with_first_load(&self, lane: Lane) -> Lane {
        Lane { value: self.first(lane.value), ..lane }
    }

    fn first(&self, value: Value) -> Value {
        self.first_load.get(value).copied().unwrap_or(value)
    }

    /// Follows a lane back through shifts, masks and conversions, and gives the same bit as a bit of the value that it
    /// comes from. That value is a word of type `ty` or a truth value.
    fn source(&self, ty: Type, lane: Lane) -> Lane {
        let mut found = lane;
        let (mut value, mut bit) = (lane.value, i64::from(lane.bit));
        for _ in 0..MAX_STEPS {
            let Some(data) = self.func.def_inst(value) else { break };
            let constant = |value| self.func.constant(value);
            let (next, number) = match *data {
                InstData::Binary { op: BinaryOp::And, args: [x, by] }
                    if constant(by).is_some_and(|by| by >> bit & 1 == 1) =>
                {
                    (x, bit)
                }
                InstData::Binary { op: BinaryOp::Or, args: [x, y] }
                    if self.ranges.possible_ones(y) >> bit & 1 == 0 =>
                {
                    (x, bit)
                }
                InstData::Binary { op: BinaryOp::Or, args: [x, y] }
                    if self.ranges.possible_ones(x) >> bit & 1 == 0 =>
                {
                    (y, bit)
                }
                InstData::Binary { op: BinaryOp::Shl, args: [x, by] } => match constant(by) {
                    Some(by) if (0..=bit).contains(&by) => (x, bit - by),
                    _ => break,
                },
                InstData::Binary { op: BinaryOp::Lshr, args: [x, by] } => match constant(by) {
                    Some(by) if (0..i64::from(self.func.ty(x).bits()) - bit).contains(&by) => {
                        (x, bit + by)
                    }
                    _ => break,
                },
                InstData::Convert { op: ConvertOp::Trunc, to: _, arg } => (arg, bit),
                InstData::Bit { arg, number } => (arg, i64::from(number)),
                InstData::Extract { op: _, arg, field } if bit < i64::from(field.width) => {
                    (arg, bit + i64::from(field.first))
                }
                InstData::Convert { op: ConvertOp::Zext | ConvertOp::Sext, to: _, arg }
                    if bit < i64::from(self.func.ty(arg).bits()) =>
                {
                    (arg, bit)
                }
                _ => break,
            };
            (value, bit) = (next, number);
            if self.func.ty(value) == ty || self.func.ty(value) == Type::I1 {
                found = Lane { value, bit: bit as u8, to: lane.to };
            }
        }
        found
    }

    /// The operation that computes all lanes, and the lanes of its operands.
    fn operands(&self, ty: Type, lanes: &[Lane]) -> Option<(Operation, Vec<Vec<Lane>>)> {
        let operation = |lane: &Lane| match *self.func.def_inst(lane.value)? {
            InstData::Unary { op: UnaryOp::Not, arg } => Some((Operation::Not, vec![arg])),
            InstData::Binary { op: op @ (BinaryOp::And | BinaryOp::Or | BinaryOp::Xor), args } => {
                Some((Operation::Binary(op), args.to_vec()))
            }
            _ => None,
        };
        let (wanted, _) = operation(lanes.first()?)?;
        let mut operands: Vec<Vec<Lane>> = vec![];
        for lane in lanes {
            let (found, args) = operation(lane)?;
            if found != wanted {
                return None;
            }
            let mut args: Vec<Lane> =
                args.iter().map(|&value| self.source(ty, Lane { value, ..*lane })).collect();
            if operands.is_empty() {
                operands = args.into_iter().map(|arg| vec![arg]).collect();
                continue;
            }
            // The operations are commutative: each operand goes to the row whose first lane it is more alike.
            if let ([a, b], [first, second]) = (args.as_slice(), operands.as_slice())
                && let (Some(x), Some(y)) = (first.first(), second.first())
                && self.likeness(x, a) + self.likeness(y, b)
                    < self.likeness(x, b) + self.likeness(y, a)
            {
                args.swap(0, 1);
            }
            for (list, arg) in operands.iter_mut().zip(args) {
                list.push(arg);
            }
        }
        Some((wanted, operands))
    }

    /// How much two lanes are alike: 4 for bits of the same word that are moved by the same distance, 1 for results
    /// of the same operation, else 0.
    fn likeness(&self, a: &Lane, b: &Lane) -> u32 {
        let distance = |lane: &Lane| i32::from(lane.to) - i32::from(lane.bit);
        if self.first(a.value) == self.first(b.value) && distance(a) == distance(b) {
            return 4;
        }
        match (self.func.def_inst(a.value), self.func.def_inst(b.value)) {
            (
                Some(InstData::Binary { op: x, args: _ }),
                Some(InstData::Binary { op: y, args: _ }),
            ) if x == y => 1,
            (Some(InstData::Unary { op: x, arg: _ }), Some(InstData::Unary { op: y, arg: _ }))
                if x == y =>
            {
                1
            }
            (Some(InstData::Load { .. }), Some(InstData::Load { .. })) => 1,
            _ => 0,
        }
    }
}

impl Row {
    /// How many instructions compute it, without constants.
    fn cost(&self) -> usize {
        match self {
            Self::Known(_) => 0,
            Self::Word(_, by) => usize::from(*by != 0),
            Self::Operation(_, rows, _) => 1 + rows.iter().map(Self::cost).sum::<usize>(),
            Self::Gather(lanes) => {
                let cost = |lane: &Lane| 2 + usize::from(lane.to != lane.bit);
                lanes.iter().map(cost).sum()
            }
        }
    }

    /// How many operations compute each of its lanes as it is now, one lane after the other.
    fn operations(&self) -> usize {
        match self {
            Self::Operation(_, rows, _) => 1 + rows.iter().map(Self::operations).sum::<usize>(),
            _ => 0,
        }
    }
}
