//! The instructions that compute a row of bits as a word.

use super::{Lane, MAX_KNOWN, Operation, Row, Rows};
use crate::InstBuilder;
use crate::{BinaryOp, ConvertOp, Type, Value};

impl Rows<'_> {
    /// Inserts the instructions that compute a row, before the instruction at the place `at`; returns the word. `places`
    /// has, for each lane, the first place at which its value is known.
    pub(super) fn emit(&mut self, ty: Type, row: &Row, places: &[usize], at: usize) -> Value {
        if let Row::Operation(_, _, lanes) | Row::Gather(lanes) = row
            && let Some(known) = self.known(lanes)
        {
            return known;
        }
        let (word, lanes) = match row {
            Row::Known(word) => return *word,
            Row::Word(word, by) => {
                self.at = at;
                return self.shifted(*word, *by);
            }
            Row::Operation(operation, rows, lanes) => {
                let args: Vec<Value> =
                    rows.iter().map(|row| self.emit(ty, row, places, at)).collect();
                self.at = at;
                let word = match *operation {
                    Operation::Not => self.not(args[0]),
                    Operation::Binary(op) => self.binary(op, args[0], args[1]),
                };
                (word, lanes)
            }
            Row::Gather(lanes) => (self.gather(ty, lanes, places), lanes),
        };
        if self.known.len() >= MAX_KNOWN {
            self.known.pop_front();
        }
        let lanes = lanes.iter().map(|&lane| self.with_first_load(lane)).collect();
        self.known.push_back((lanes, word));
        word
    }

    /// Moves each lane to its place in the word, at the first place at which its value is known.
    fn gather(&mut self, ty: Type, lanes: &[Lane], places: &[usize]) -> Value {
        let mut lanes: Vec<(usize, Lane)> = places.iter().copied().zip(lanes.to_vec()).collect();
        lanes.sort_by_key(|&(at, _)| at);
        let mut all = None;
        for (at, lane) in lanes {
            self.at = at;
            let by = i32::from(lane.to) - i32::from(lane.bit);
            let bit = if self.func.ty(lane.value) == Type::I1 {
                let wide = self.convert(ConvertOp::Zext, ty, lane.value);
                self.shifted(wide, by)
            } else {
                let moved = self.shifted(lane.value, by);
                self.binary_imm(BinaryOp::And, moved, 1 << lane.to)
            };
            all = Some(match all {
                None => bit,
                Some(all) => self.binary(BinaryOp::Or, all, bit),
            });
        }
        // A row has lanes.
        all.unwrap_or(Value::NONE)
    }

    /// A word shifted left by `by` bits; if the number is negative, right.
    fn shifted(&mut self, word: Value, by: i32) -> Value {
        match by {
            0 => word,
            1.. => self.binary_imm(BinaryOp::Shl, word, i64::from(by)),
            _ => self.binary_imm(BinaryOp::Lshr, word, -i64::from(by)),
        }
    }
}
