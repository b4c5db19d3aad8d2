//! Rules for fields and single bits of words, which are most of what PLC programs work with.
//!
//! Truth values that are bits of words are combined as words: one word is shifted so that the two
//! bits are at the same position, and one bit of the result is the truth value. That is shorter
//! than making two truth values.
//!
//! ```text
//! v2: i1 = bit v0, 5              v1: i32 = lshr v0, 3
//! v4: i1 = bit v9, 2       ==>    v2: i32 = and v1, v9
//! v5: i1 = and v2, v4             v5: i1 = bit v2, 2
//! ```

use super::fold::{Fold, Rewrite};
use super::value_range::mask;
use crate::InstBuilder;
use crate::{BinaryOp, ConvertOp, ExtractOp, Field, InstData, Type, UnaryOp, Value, eval};

/// AND, OR, XOR and NOT that are nested in each other are followed to this depth.
const MAX_DEPTH: u32 = 4;

/// A truth value that is a bit of an integer.
#[derive(Clone, Copy)]
struct Bit {
    /// The integer.
    of: Value,
    ty: Type,
    /// The number of the bit, from 0 for the lowest.
    number: i64,
    /// Whether the truth value is the opposite of the bit.
    opposite: bool,
}

impl Fold<'_> {
    /// The bit of an integer that a truth value is, or whose opposite it is; `None` if it is
    /// computed in another way.
    fn bit_of(&self, value: Value) -> Option<Bit> {
        let opposite = self.not_of(value);
        match *self.func.def_inst(opposite.unwrap_or(value))? {
            InstData::Bit { arg: of, number } => {
                let (ty, number) = (self.func.ty(of), number.into());
                Some(Bit { of, ty, number, opposite: opposite.is_some() })
            }
            _ => None,
        }
    }

    /// The integer of a type and the number of its bit that a value is, widened with zeros.
    pub(super) fn extended_bit(&self, ty: Type, value: Value) -> Option<(Value, i64)> {
        let &InstData::Convert { op: ConvertOp::Zext, to: _, arg } = self.func.def_inst(value)?
        else {
            return None;
        };
        match self.func.def_inst(arg) {
            Some(&InstData::Bit { arg: of, number }) if self.func.ty(of) == ty => {
                Some((of, number.into()))
            }
            _ => None,
        }
    }

    /// The operand and the distance of the unsigned right shift that defines a value.
    fn shifted_right(&self, value: Value) -> Option<(Value, i64)> {
        let [x, by] = self.operands(value, BinaryOp::Lshr)?;
        let width = i64::from(self.func.ty(value).bits());
        Some((x, self.func.constant(by).filter(|by| (0..width).contains(by))?))
    }

    /// What the reading of a field can be replaced by. A field that begins with the lowest bit is a mask, and a single bit
    /// is a truth value.
    pub(super) fn fold_extract(
        &mut self,
        op: ExtractOp,
        ty: Type,
        arg: Value,
        field: Field,
    ) -> Option<Rewrite> {
        if let Some(x) = self.func.constant(arg) {
            return Some(Rewrite::Const(eval::extract(op, ty, field, x)));
        }
        if field == Field::whole(ty) {
            return Some(Rewrite::Value(arg));
        }
        let ones = self.ranges.possible_ones(arg) >> field.first & field.ones();
        match op {
            _ if ones == 0 => Some(Rewrite::Const(0)),
            ExtractOp::Signed if ones >> (field.width - 1) == 0 => {
                Some(Rewrite::Inst(InstData::Extract { op: ExtractOp::Unsigned, arg, field }))
            }
            ExtractOp::Signed => None,
            ExtractOp::Unsigned if field.width == 1 => {
                let bit = InstData::Bit { arg, number: field.first };
                let bit = self.insert_simplified(bit, Type::I1);
                Some(Rewrite::convert(ConvertOp::Zext, ty, bit))
            }
            ExtractOp::Unsigned if field.first == 0 => {
                let mask = self.constant(ty, field.ones() as i64);
                Some(Rewrite::binary(BinaryOp::And, arg, mask))
            }
            ExtractOp::Unsigned => None,
        }
    }

    /// A value that was shifted left, and right again by `right` bits or more: a field of it.
    pub(super) fn shifted_both_ways(
        &mut self,
        op: BinaryOp,
        ty: Type,
        a: Value,
        right: i64,
    ) -> Option<Rewrite> {
        let [arg, left] = self.operands(a, BinaryOp::Shl)?;
        let left = self.func.constant(left).filter(|left| (0..=right).contains(left))?;
        let bits = i64::from(ty.bits());
        if right >= bits {
            return None;
        }
        let field = Field { first: (right - left) as u8, width: (bits - right) as u8 };
        let op = match op {
            BinaryOp::Ashr => ExtractOp::Signed,
            _ => ExtractOp::Unsigned,
        };
        Some(Rewrite::Inst(InstData::Extract { op, arg, field }))
    }

    /// An integer of which a field is replaced: what is left of it, joined with the new bits in their place.
    pub(super) fn replace_field(
        &mut self,
        ty: Type,
        [word, bits]: [Value; 2],
        field: Field,
    ) -> Rewrite {
        let masked = |this: &mut Self, value: Value, mask: u64| {
            let mask = this.constant(ty, mask as i64);
            this.insert_simplified(InstData::Binary { op: BinaryOp::And, args: [value, mask] }, ty)
        };
        let rest = masked(self, word, !field.mask());
        let mut new = bits;
        if self.func.ty(bits) == Type::I1 {
            let wide = InstData::Convert { op: ConvertOp::Zext, to: ty, arg: bits };
            new = self.insert_simplified(wide, ty);
        }
        if field.first > 0 {
            let by = self.constant(ty, field.first.into());
            let args = [new, by];
            new = self.insert_simplified(InstData::Binary { op: BinaryOp::Shl, args }, ty);
        }
        let new = masked(self, new, field.mask());
        Rewrite::binary(BinaryOp::Or, rest, new)
    }

    /// AND, OR or XOR of two bits: one of the words is shifted so that its bit is where that of the
    /// other is, the words are combined, and one bit of the result is taken.
    pub(super) fn combine_bits(&mut self, op: BinaryOp, [a, b]: [Value; 2]) -> Option<Rewrite> {
        let (x, y) = (self.bit_of(a)?, self.bit_of(b)?);
        if x.ty != y.ty {
            return None;
        }
        let number = x.number.min(y.number);
        let neither = x.opposite && y.opposite && op != BinaryOp::Xor;
        let [x_at, y_at] = [x, y].map(|bit| {
            let at = self.moved(bit.of, number - bit.number);
            if bit.opposite && !neither { self.not(at) } else { at }
        });
        let op = match (neither, op) {
            (true, BinaryOp::And) => BinaryOp::Or,
            (true, _) => BinaryOp::And,
            (false, op) => op,
        };
        let arg = self.binary(op, x_at, y_at);
        let bit = InstData::Bit { arg, number: number as u8 };
        match neither {
            true => Some(Rewrite::not(self.build(bit))),
            false => Some(Rewrite::Inst(bit)),
        }
    }

    /// A word in which a bit is set or else cleared by a condition: the condition is put into the
    /// word as a bit.
    ///
    /// ```text
    /// v3: i32 = and v0, -5
    /// v4: i32 = or v0, 4                  v3: i32 = and v0, -5
    /// v5: i32 = select v1, v4, v3   ==>   v6: i32 = zext v1
    ///                                     v7: i32 = shl v6, 2
    ///                                     v5: i32 = or v3, v7
    /// ```
    pub(super) fn select_bit_of_word(
        &mut self,
        cond: Value,
        ty: Type,
        [a, b]: [Value; 2],
    ) -> Option<Rewrite> {
        let set_and_cleared = |this: &Self, set: Value, cleared: Value| {
            let [word, bit] = this.operands(set, BinaryOp::Or)?;
            let bit = this.func.constant(bit)? as u64 & mask(ty);
            let [other, kept] = this.operands(cleared, BinaryOp::And)?;
            let kept = this.func.constant(kept)? as u64 & mask(ty);
            // The word may have been masked before the bit was set.
            let before = match this.operands(word, BinaryOp::And) {
                Some([inner, by]) if inner == other => this.func.constant(by)? as u64 & mask(ty),
                _ if word == other => mask(ty),
                _ => return None,
            };
            let same = (before & !bit ^ kept) & this.ranges.possible_ones(other) == 0;
            (bit.is_power_of_two() && kept & bit == 0 && same).then_some(bit.trailing_zeros())
        };
        let (cond, number, cleared) = match set_and_cleared(self, a, b) {
            Some(number) => (cond, number, b),
            None => {
                let number = set_and_cleared(self, b, a)?;
                (self.not(cond), number, a)
            }
        };
        let bit = self.truth_at(ty, cond, number.into());
        Some(Rewrite::binary(BinaryOp::Or, cleared, bit))
    }

    /// A word of which a bit is set, or is cleared, if a bit of another word is on: that bit is shifted to its place and
    /// joined to the word.
    ///
    /// ```text
    /// v3: i1 = bit v1, 7                  v3: i32 = lshr v1, 5
    /// v4: i32 = or v0, 4           ==>    v4: i32 = and v3, 4
    /// v5: i32 = select v3, v4, v0         v5: i32 = or v0, v4
    /// ```
    pub(super) fn select_latched(
        &mut self,
        cond: Value,
        ty: Type,
        [a, b]: [Value; 2],
    ) -> Option<Rewrite> {
        if !self.combine_bits {
            return None;
        }
        let from = self.bit_of(cond).filter(|bit| bit.ty == ty)?;
        // Which bit of a word another value has set (or else cleared).
        let changed = |this: &Self, value: Value, word: Value| {
            let Some(&InstData::Binary { op, args: [x, bits] }) = this.func.def_inst(value) else {
                return None;
            };
            let bits = this.func.constant(bits)? as u64 & mask(ty);
            let (is_set, bit) = match op {
                BinaryOp::Or if x == word => (true, bits),
                BinaryOp::And => {
                    // What was joined to the word before is cleared with the bit.
                    let [y, joined] = this.operands(word, BinaryOp::Or).unwrap_or([word, x]);
                    let is_cleared = y == x && this.ranges.possible_ones(joined) & bits == 0;
                    if x != word && !is_cleared {
                        return None;
                    }
                    (false, this.ranges.possible_ones(word) & mask(ty) & !bits)
                }
                _ => return None,
            };
            bit.is_power_of_two().then(|| (is_set, i64::from(bit.trailing_zeros())))
        };
        let (word, (is_set, number), opposite) = match changed(self, a, b) {
            Some(change) => (b, change, from.opposite),
            None => (a, changed(self, b, a)?, !from.opposite),
        };
        let mut bit = self.moved(from.of, number - from.number);
        // The bit is inverted with the others of its word before these are masked.
        if is_set {
            if opposite {
                bit = self.not(bit);
            }
            bit = self.binary_imm(BinaryOp::And, bit, ty.wrap(1 << number));
            return Some(Rewrite::binary(BinaryOp::Or, word, bit));
        }
        if !opposite {
            bit = self.not(bit);
        }
        bit = self.binary_imm(BinaryOp::Or, bit, ty.wrap(!(1 << number)));
        Some(Rewrite::binary(BinaryOp::And, word, bit))
    }

    /// `(word & 1) << to`, which programs use to put a computed bit into a word: the bit is
    /// computed at position `to` from the beginning, if that takes no more shifts.
    pub(super) fn shift_lowest_bit(&mut self, ty: Type, a: Value, to: i64) -> Option<Rewrite> {
        if let Some((of, number)) = self.extended_bit(ty, a) {
            if number != to && !self.is_used_once(a) {
                return None;
            }
            let moved = self.moved(of, to - number);
            let mask = self.constant(ty, 1 << to);
            return Some(Rewrite::binary(BinaryOp::And, moved, mask));
        }
        let [word, mask] = self.operands(a, BinaryOp::And)?;
        if self.func.constant(mask) != Some(1) || !self.is_used_once(a) {
            return None;
        }
        if !(1..i64::from(ty.bits()) - 1).contains(&to)
            || self.extra_shifts(word, to, MAX_DEPTH)? > 0
        {
            return None;
        }
        let word = self.lowest_bit_at(word, to, MAX_DEPTH);
        let mask = self.constant(ty, 1 << to);
        Some(Rewrite::binary(BinaryOp::And, word, mask))
    }

    /// The AND, OR, XOR or NOT that defines a value, and its operands (that of NOT twice). `None`
    /// if the value has further uses, since then it cannot be computed at another position instead.
    fn logic_operands(&self, value: Value, depth: u32) -> Option<(InstData, [Value; 2])> {
        let data = *self.func.def_inst(value)?;
        match data {
            _ if depth == 0 || !self.is_used_once(value) => None,
            InstData::Binary { op: BinaryOp::And | BinaryOp::Or | BinaryOp::Xor, args: [x, y] } => {
                Some((data, [x, y]))
            }
            InstData::Unary { op: UnaryOp::Not, arg } => Some((data, [arg, arg])),
            _ => None,
        }
    }

    /// How many more shifts it takes to compute the lowest bit of a value at position `to` instead;
    /// `None` if it is not possible.
    fn extra_shifts(&self, value: Value, to: i64, depth: u32) -> Option<i32> {
        if self.func.constant(value).is_some() {
            return None;
        }
        if let Some((data, [x, y])) = self.logic_operands(value, depth) {
            let extra = self.extra_shifts(x, to, depth - 1)?;
            return match data {
                InstData::Unary { .. } => Some(extra),
                _ => Some(extra + self.extra_shifts(y, to, depth - 1)?),
            };
        }
        Some(match self.shifted_right(value) {
            None => 1,
            Some((_, by)) => i32::from(by != to) - i32::from(self.is_used_once(value)),
        })
    }

    /// Computes a value whose bit at position `to` is the lowest bit of `value`.
    fn lowest_bit_at(&mut self, value: Value, to: i64, depth: u32) -> Value {
        if let Some((data, [x, y])) = self.logic_operands(value, depth) {
            let x = self.lowest_bit_at(x, to, depth - 1);
            return match data {
                InstData::Binary { op, .. } => {
                    let y = self.lowest_bit_at(y, to, depth - 1);
                    self.binary(op, x, y)
                }
                _ => self.not(x),
            };
        }
        let (x, from) = self.shifted_right(value).unwrap_or((value, 0));
        self.moved(x, to - from)
    }

    /// A value shifted left by a number of bits, or right if that is negative.
    pub(super) fn moved(&mut self, value: Value, by: i64) -> Value {
        match by {
            0 => value,
            by if by > 0 => self.binary_imm(BinaryOp::Shl, value, by),
            by => self.binary_imm(BinaryOp::Lshr, value, -by),
        }
    }
}
