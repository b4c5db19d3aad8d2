//! Rules for bits that become their opposite (are *toggled*), mostly under a condition: an XOR of the bit, or of
//! the word that it is in.
//!
//! ```text
//! v2: i1 = not v0
//! v3: i1 = select v1, v2, v0        ==>    v3: i1 = xor v0, v1
//!
//! v2: i32 = and v0, ~4
//! v3: i32 = xor v0, v1
//! v4: i32 = and v3, 4                      v4: i32 = and v1, 4
//! v5: i32 = or v2, v4               ==>    v5: i32 = xor v0, v4
//!
//! v2: i32 = sub 1, v1  (0 or 1)     ==>    v2: i32 = xor v1, 1
//! ```

use super::fold::{Fold, Rewrite};
use super::fold_convert::BitOrigin;
use super::value_range::mask;
use crate::InstBuilder;
use crate::{BinaryOp, ConvertOp, InstData, Type, UnaryOp, Value};

/// Of the bits that are joined to those of a word, about this many are looked at.
const MAX_JOINED: usize = 32;
/// The origin of a bit is followed through at most this many truth values.
const MAX_TRUTH_VALUES: usize = 8;

impl Fold<'_> {
    /// `c - x`, where all bits of `x` are bits of the constant: none is borrowed, so that they are cleared there.
    pub(super) fn subtract_without_borrow(
        &mut self,
        ty: Type,
        [c, x]: [Value; 2],
        number: i64,
    ) -> Option<Rewrite> {
        let bits = number as u64 & mask(ty);
        let within = self.ranges.possible_ones(x) & mask(ty) & !bits == 0;
        within.then(|| Rewrite::binary(BinaryOp::Xor, x, c))
    }

    /// A select between a value and what is made of it by toggling bits, `x ^ y`: `x ^ (cond ? y : 0)`.
    pub(super) fn select_opposite(
        &mut self,
        cond: Value,
        ty: Type,
        [a, b]: [Value; 2],
    ) -> Option<Rewrite> {
        if ty == Type::I1 {
            if self.not_of(a) == Some(b) {
                return Some(Rewrite::binary(BinaryOp::Xor, b, cond));
            }
            if self.not_of(b) == Some(a) {
                let same = self.binary(BinaryOp::Xor, a, cond);
                return Some(Rewrite::not(same));
            }
            return None;
        }
        let toggled = |this: &Self, value: Value, by: Value| {
            let [x, bit] = this.operands(value, BinaryOp::Xor)?;
            let bit = this.func.constant(bit).filter(|_| x == by)? as u64 & mask(ty);
            bit.is_power_of_two().then(|| i64::from(bit.trailing_zeros()))
        };
        let (same, number, cond) = match toggled(self, a, b) {
            Some(number) => (b, number, cond),
            None => {
                let number = toggled(self, b, a)?;
                (a, number, self.not(cond))
            }
        };
        let bit = self.truth_at(ty, cond, number);
        Some(Rewrite::binary(BinaryOp::Xor, same, bit))
    }

    /// A truth value as bit `number` of an integer whose other bits are 0.
    pub(super) fn truth_at(&mut self, ty: Type, truth: Value, number: i64) -> Value {
        let wide = self.convert(ConvertOp::Zext, ty, truth);
        self.moved(wide, number)
    }

    /// A word of which bits are replaced, some of them by what was made of them by toggling.
    pub(super) fn toggled_bits(&mut self, ty: Type, [a, b]: [Value; 2]) -> Option<Rewrite> {
        if ty == Type::I1 {
            return None;
        }
        self.toggled_bits_of(ty, a, b).or_else(|| self.toggled_bits_of(ty, b, a))
    }

    /// `cleared | bits`, where `cleared` is a word without some bits, and `bits` are one or several of them, joined by
    /// ORs.
    fn toggled_bits_of(&mut self, ty: Type, cleared: Value, bits: Value) -> Option<Rewrite> {
        let [word, kept] = self.operands(cleared, BinaryOp::And)?;
        let mut kept = self.func.constant(kept)? as u64 & mask(ty);
        let joined = self.joined(bits);
        let (mut once, mut twice) = (0, 0);
        for &bits in &joined {
            let ones = self.ranges.possible_ones(bits) & mask(ty);
            twice |= once & ones;
            once |= ones;
        }
        // What is joined to the word, and then what toggles bits of that.
        let (mut ors, mut xors) = (vec![], vec![]);
        let mut toggled = 0;
        for mut bit in joined {
            let ones = self.ranges.possible_ones(bit) & mask(ty);
            if ones & (kept | twice) != 0 {
                ors.push((BinaryOp::Or, bit));
                continue;
            }
            // What toggles bits that the others do not have can also do that at the end.
            while let Some([x, y]) =
                self.operands(bit, BinaryOp::Xor).filter(|_| self.is_used_once(bit))
            {
                xors.push((BinaryOp::Xor, y));
                bit = x;
            }
            match self.toggled_by(ty, word, bit) {
                None => ors.push((BinaryOp::Or, bit)),
                Some((own, by)) => {
                    toggled |= own;
                    xors.extend(by.map(|by| (BinaryOp::Xor, by)));
                }
            }
        }
        if toggled == 0 {
            return None;
        }
        kept |= toggled;
        // The word may have fewer bits than its type, such as the 24 bits of a PMAC's words.
        let is_whole = self.ranges.possible_ones(word) & mask(ty) & !kept == 0;
        let mut value = match is_whole {
            true => word,
            false => self.binary_imm(BinaryOp::And, word, ty.wrap(kept as i64)),
        };
        ors.append(&mut xors);
        let Some((last, by)) = ors.pop() else { return Some(Rewrite::Value(value)) };
        for (op, by) in ors {
            value = self.binary(op, value, by);
        }
        Some(Rewrite::binary(last, value, by))
    }

    /// The values that ORs join to a value. Of those ORs that are used elsewhere, too, it is the result.
    fn joined(&self, value: Value) -> Vec<Value> {
        let (mut pending, mut found) = (vec![value], vec![]);
        while let Some(value) = pending.pop() {
            match self.operands(value, BinaryOp::Or) {
                Some([a, b]) if found.len() < MAX_JOINED && self.is_used_once(value) => {
                    pending.extend([b, a]);
                }
                _ => found.push(value),
            }
        }
        found
    }

    /// Which bits of a word, in their places, a value has, and what they were toggled by (`None` if they are as they
    /// were); `None` if it has other bits.
    fn toggled_by(&mut self, ty: Type, word: Value, bits: Value) -> Option<(u64, Option<Value>)> {
        let ones = self.ranges.possible_ones(bits) & mask(ty);
        if ones.is_power_of_two() {
            let by = self.bit_toggled_by(ty, word, bits, ones.trailing_zeros())?;
            return Some((ones, by));
        }
        let [x, kept] = self.operands(bits, BinaryOp::And)?;
        let own = self.func.constant(kept)? as u64 & mask(ty);
        if x == word {
            return Some((own & ones, None));
        }
        let by = match self.operands(x, BinaryOp::Xor).filter(|_| self.is_used_once(bits))? {
            [x, y] if x == word => y,
            [x, y] if y == word => x,
            _ => return None,
        };
        let by = self.binary(BinaryOp::And, by, kept);
        Some((own & ones, Some(by)))
    }

    /// What a bit of a word, in its place, was toggled by: `None` if it was not made by toggling, and `Some(None)` if it
    /// is the bit as it was.
    fn bit_toggled_by(
        &mut self,
        ty: Type,
        word: Value,
        bit: Value,
        number: u32,
    ) -> Option<Option<Value>> {
        let BitOrigin::Of(of_word, at, word_opposite) = self.bit_origin(word, number) else {
            return None;
        };
        let BitOrigin::Of(value, place, opposite) = self.bit_origin(bit, number) else {
            return None;
        };
        let toggled = opposite != word_opposite;
        if (value, place) == (of_word, at) {
            return match toggled {
                true => Some(Some(self.constant(ty, ty.wrap(1 << number)))),
                false => Some(None),
            };
        }
        let [p, q] = self.operands(value, BinaryOp::Xor).filter(|_| self.is_used_once(bit))?;
        let own = |x| match self.bit_origin(x, place) {
            BitOrigin::Of(value, place, opposite) => {
                ((value, place) == (of_word, at)).then_some(opposite)
            }
            BitOrigin::Constant(_) => None,
        };
        let (mut by, inner) = match own(p) {
            Some(opposite) => (q, opposite),
            None => (p, own(q)?),
        };
        let of = self.func.ty(by);
        if of != Type::I1 && of != ty {
            return None;
        }
        if toggled != inner {
            by = self.not(by);
        }
        Some(Some(self.bit_moved(ty, by, place, number)))
    }

    /// Where a bit of a value comes from, also through truth values.
    fn bit_origin(&self, value: Value, bit: u32) -> BitOrigin {
        let (mut value, mut bit, mut opposite) = (value, bit, false);
        for _ in 0..MAX_TRUTH_VALUES {
            match self.origin(value, bit) {
                BitOrigin::Constant(bit) => return BitOrigin::Constant(bit != opposite),
                BitOrigin::Of(of, at, other) => {
                    (value, bit, opposite) = (of, at, opposite != other);
                }
            }
            if self.func.ty(value) != Type::I1 {
                break;
            }
            match self.func.def_inst(value) {
                Some(&InstData::Unary { op: UnaryOp::Not, arg }) => {
                    (value, opposite) = (arg, !opposite);
                }
                Some(&InstData::Bit { arg, number }) => (value, bit) = (arg, number.into()),
                _ => break,
            }
        }
        BitOrigin::Of(value, bit, opposite)
    }

    /// Bit `from` of a value, as bit `to` of an integer whose other bits are 0.
    fn bit_moved(&mut self, ty: Type, value: Value, from: u32, to: u32) -> Value {
        if self.func.ty(value) == Type::I1 {
            return self.truth_at(ty, value, i64::from(to));
        }
        let moved = self.moved(value, i64::from(to) - i64::from(from));
        self.binary_imm(BinaryOp::And, moved, ty.wrap(1 << to))
    }
}
