//! The instructions that compute a row of bits as a word.

use super::{Lane, MAX_KNOWN, Operation, Row, Rows};
use crate::{BinaryOp, ConvertOp, InstData, Type, UnaryOp, Value};

impl Rows<'_> {
    /// Adds the instructions that compute a row, before the instruction at the place `at`; gives the word. `places`
    /// has, for each lane, the first place at which its value is known.
    pub(super) fn emit(
        &mut self,
        ty: Type,
        row: &Row,
        places: &[usize],
        at: usize,
    ) -> Option<Value> {
        if let Row::Operation(_, _, lanes) | Row::Gather(lanes) = row
            && let Some(known) = self.known(lanes)
        {
            return Some(known);
        }
        let (word, lanes) = match row {
            Row::Known(word) => return Some(*word),
            Row::Word(word, by) => return self.shifted(ty, *word, *by, at),
            Row::Operation(operation, rows, lanes) => {
                let mut args = vec![];
                for row in rows {
                    args.push(self.emit(ty, row, places, at)?);
                }
                let data = match (*operation, args.as_slice()) {
                    (Operation::Not, &[arg]) => InstData::Unary { op: UnaryOp::Not, arg },
                    (Operation::Binary(op), &[a, b]) => InstData::Binary { op, args: [a, b] },
                    _ => return None,
                };
                (self.insert(data, at)?, lanes)
            }
            Row::Gather(lanes) => (self.gather(ty, lanes, places)?, lanes),
        };
        if self.known.len() >= MAX_KNOWN {
            self.known.pop_front();
        }
        let lanes = lanes.iter().map(|&lane| self.with_first_load(lane)).collect();
        self.known.push_back((lanes, word));
        Some(word)
    }

    /// Moves each lane to its place in the word, at the first place at which its value is known.
    fn gather(&mut self, ty: Type, lanes: &[Lane], places: &[usize]) -> Option<Value> {
        let mut lanes: Vec<(usize, Lane)> = places.iter().copied().zip(lanes.to_vec()).collect();
        lanes.sort_by_key(|&(at, _)| at);
        let mut all = None;
        for (at, lane) in lanes {
            let by = i32::from(lane.to) - i32::from(lane.bit);
            let bit = if self.func.ty(lane.value) == Type::I1 {
                let wide = InstData::Convert { op: ConvertOp::Zext, to: ty, arg: lane.value };
                let wide = self.insert(wide, at)?;
                self.shifted(ty, wide, by, at)?
            } else {
                let moved = self.shifted(ty, lane.value, by, at)?;
                self.with_const(BinaryOp::And, ty, moved, 1 << lane.to, at)?
            };
            all = match all {
                None => Some(bit),
                Some(all) => {
                    self.insert(InstData::Binary { op: BinaryOp::Or, args: [all, bit] }, at)
                }
            };
        }
        all
    }

    /// A word shifted left by `by` bits; if the number is negative, right.
    fn shifted(&mut self, ty: Type, word: Value, by: i32, at: usize) -> Option<Value> {
        match by {
            0 => Some(word),
            1.. => self.with_const(BinaryOp::Shl, ty, word, i64::from(by), at),
            _ => self.with_const(BinaryOp::Lshr, ty, word, -i64::from(by), at),
        }
    }

    /// Adds an operation with a constant before the instruction at a place; gives its result.
    pub(super) fn with_const(
        &mut self,
        op: BinaryOp,
        ty: Type,
        value: Value,
        by: i64,
        at: usize,
    ) -> Option<Value> {
        let by = self.insert(InstData::Iconst { ty, value: ty.wrap(by) }, at)?;
        self.insert(InstData::Binary { op, args: [value, by] }, at)
    }

    /// Adds an instruction before the instruction at a place; gives its result.
    pub(super) fn insert(&mut self, data: InstData, at: usize) -> Option<Value> {
        let inst = self.func.append(data, self.loc);
        data.for_each_arg(|value| {
            if let Some(count) = self.uses.get_mut(value.index()) {
                *count += 1;
            }
        });
        self.inserted.push((at, inst));
        self.func.result(inst)
    }
}
