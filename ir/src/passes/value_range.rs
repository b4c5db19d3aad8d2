//! What is known of an integer before the program runs, from the operation that computes it: which
//! of its bits may be 1 (the others are surely 0), and between which bounds it lies as a signed
//! number.
//!
//! Both are kept for each value and entered when its definition is visited. Neither follows from
//! the other: of `v & 5` only bits 0 and 2 may be 1, while `v >> 28` of an `i32` lies between -8
//! and 7, but any of its bits may be 1. Of loads nothing is known but
//! that the highest byte of some words is 0 ([`ValueRanges::note_word`]); what branches pass to the
//! parameters of blocks is found by [`PassedBounds`], in the passes that need it.

use super::graph::Graph;
use crate::{
    Address, BinaryOp, Block, ConvertOp, ExtractOp, FuncData, InstData, PrimaryMap, SecondaryMap,
    Terminator, Type, UnaryOp, Value,
};

/// The bits of a word of 32 bits whose highest byte is 0.
const WORD_24: u64 = 0xFF_FFFF;

/// All bits of a type.
pub(super) fn mask(ty: Type) -> u64 {
    match ty.bits() {
        64 => u64::MAX,
        bits => (1 << bits) - 1,
    }
}

/// A mask of the highest bit of a number that is 1 and all bits below it.
fn up_to_highest_bit(most: u64) -> u64 {
    match most.leading_zeros() {
        0 => u64::MAX,
        zeros => (1 << (64 - zeros)) - 1,
    }
}

/// The least and the greatest number that a value may be, as signed numbers.
type Bounds = (i64, i64);

/// The bounds of all numbers of a type.
fn all_numbers(ty: Type) -> Bounds {
    match ty {
        Type::I1 => (0, 1),
        ty => (i64::MIN >> (64 - ty.bits()), i64::MAX >> (64 - ty.bits())),
    }
}

/// What is known of each value.
pub(super) struct ValueRanges {
    /// For each value a mask of the bits that may be 1.
    possible_ones: SecondaryMap<Value, u64>,
    /// For each value its bounds; `None` if nothing is known but the bits.
    bounds: SecondaryMap<Value, Option<Bounds>>,
}

impl ValueRanges {
    /// A table in which nothing is known.
    pub(super) fn new(func: &FuncData) -> Self {
        let mut possible_ones = SecondaryMap::with_default(u64::MAX);
        possible_ones.resize(func.value_count());
        for (value, data) in &func.values {
            possible_ones[value] = mask(data.ty);
        }
        Self { possible_ones, bounds: vec![None; func.value_count()].into() }
    }

    /// Enters the bounds of a value that is not a truth value.
    pub(super) fn set_bounds(&mut self, value: Value, ty: Type, bounds: Bounds) {
        self.possible_ones[value] = mask(ty);
        self.bounds[value] = Some(bounds);
    }

    /// A mask of the bits of a value that may be 1. As an unsigned number the value is not greater
    /// than the mask.
    pub(super) fn possible_ones(&self, value: Value) -> u64 {
        self.possible_ones[value]
    }

    /// The least and the greatest number that a value of a type may be, signed.
    pub(super) fn bounds(&self, value: Value, ty: Type) -> Bounds {
        let (low, high) = self.bounds[value].unwrap_or(all_numbers(ty));
        let possible_ones = self.possible_ones(value);
        if ty == Type::I1 || possible_ones >> (ty.bits() - 1) & 1 != 0 {
            return (low, high);
        }
        // The sign bit is 0, so the value is not negative and not greater than its possible bits.
        (low.max(0), high.min(possible_ones as i64))
    }

    /// Enters what is known of `value`, the result of an instruction.
    pub(super) fn note(&mut self, func: &FuncData, value: Value, data: &InstData) {
        let ty = func.ty(value);
        let all = mask(ty);
        let possible_ones = self.possible_ones_of(func, data, all) & all;
        let bounds = match ty {
            Type::F64 | Type::I1 => None,
            ty => self.bounds_of(func, data).filter(|&found| lies_within(found, all_numbers(ty))),
        };
        self.possible_ones[value] = possible_ones;
        self.bounds[value] = bounds;
    }

    /// Enters what is known of a whole word at an address in a region of words whose highest byte is 0, if it is one.
    pub(super) fn note_word(&mut self, value: Value, at: &Address) {
        let is_word = at.offset.is_multiple_of(4)
            && at.index.is_none_or(|index| index.scale.is_multiple_of(4));
        if is_word && let Some(ones) = self.possible_ones.get_mut(value) {
            *ones &= WORD_24;
        }
    }

    /// The bounds of a result, before it wraps; `None` where nothing is known.
    fn bounds_of(&self, func: &FuncData, data: &InstData) -> Option<Bounds> {
        let of = |value| self.bounds(value, func.ty(value));
        match *data {
            InstData::Iconst { ty: _, value } => Some((value, value)),
            InstData::Unary { op: UnaryOp::Neg, arg } => {
                let (low, high) = of(arg);
                Some((high.checked_neg()?, low.checked_neg()?))
            }
            InstData::Binary { op, args } => self.bounds_of_binary(func, op, args),
            InstData::Select { cond: _, args: [a, b] } => {
                let ((a, b), (x, y)) = (of(a), of(b));
                Some((a.min(x), b.max(y)))
            }
            InstData::Extract { op: ExtractOp::Signed, arg: _, field } => {
                let most = (field.ones() >> 1) as i64;
                Some((!most, most))
            }
            InstData::Convert { op: ConvertOp::Sext | ConvertOp::Trunc, to: _, arg } => {
                // If the operand may not fit the narrower type, the caller drops these bounds.
                (func.ty(arg) != Type::I1).then(|| of(arg))
            }
            _ => None,
        }
    }

    fn bounds_of_binary(
        &self,
        func: &FuncData,
        op: BinaryOp,
        [a, b]: [Value; 2],
    ) -> Option<Bounds> {
        let ty = func.ty(a);
        if !ty.is_int() {
            return None;
        }
        let ((low, high), (from, to)) = (self.bounds(a, ty), self.bounds(b, ty));
        match op {
            BinaryOp::Add => Some((low.checked_add(from)?, high.checked_add(to)?)),
            BinaryOp::Sub => Some((low.checked_sub(to)?, high.checked_sub(from)?)),
            BinaryOp::Mul => {
                let corners = [(low, from), (low, to), (high, from), (high, to)];
                let (mut least, mut most) = (i64::MAX, i64::MIN);
                for (x, y) in corners {
                    let product = x.checked_mul(y)?;
                    (least, most) = (least.min(product), most.max(product));
                }
                Some((least, most))
            }
            BinaryOp::Ashr => {
                let by = func.constant(b).filter(|by| (0..i64::from(ty.bits())).contains(by))?;
                Some((low >> by, high >> by))
            }
            BinaryOp::Smin => Some((low.min(from), high.min(to))),
            // The greater of a number and its opposite is the magnitude.
            BinaryOp::Smax if self.is_opposite(func, a, b) && low > all_numbers(ty).0 => {
                Some((0, high.max(-low)))
            }
            BinaryOp::Smax => Some((low.max(from), high.max(to))),
            BinaryOp::Smod if from > 0 => Some((0, to - 1)),
            BinaryOp::Srem if from > 0 => Some((low.max(1 - to).min(0), high.min(to - 1).max(0))),
            _ => None,
        }
    }

    /// Whether one value is the other with the opposite sign.
    fn is_opposite(&self, func: &FuncData, a: Value, b: Value) -> bool {
        let negated = |value| match func.def_inst(value) {
            Some(&InstData::Unary { op: UnaryOp::Neg, arg }) => Some(arg),
            _ => None,
        };
        negated(b) == Some(a) || negated(a) == Some(b)
    }

    /// The bits that may be 1 in the result of an instruction; `all` are the bits of its type.
    fn possible_ones_of(&self, func: &FuncData, data: &InstData, all: u64) -> u64 {
        match *data {
            InstData::Iconst { ty: _, value } => value as u64,
            InstData::Pack { from } => from.mask().into(),
            InstData::Binary { op, args: [a, b] } => {
                let by = || func.constant(b).map(|by| by as u64 & all);
                possible_ones_of_binary(op, self.possible_ones(a), self.possible_ones(b), by, all)
            }
            InstData::Select { cond: _, args: [a, b] } => {
                self.possible_ones(a) | self.possible_ones(b)
            }
            InstData::Extract { op, arg, field } => {
                let ones = self.possible_ones(arg) >> field.first & field.ones();
                let has_sign = op == ExtractOp::Signed && ones >> (field.width - 1) & 1 == 1;
                if has_sign { all } else { ones }
            }
            InstData::Insert { args: [word, bits], field } => {
                let rest = self.possible_ones(word) & !field.mask();
                rest | self.possible_ones(bits) << field.first & field.mask()
            }
            InstData::Convert { op, to: _, arg } => {
                let possible_ones = self.possible_ones(arg);
                let sign = 1 << (func.ty(arg).bits() - 1);
                match op {
                    ConvertOp::Zext | ConvertOp::Trunc => possible_ones,
                    ConvertOp::Sext if possible_ones & sign == 0 => possible_ones,
                    _ => all,
                }
            }
            _ => all,
        }
    }
}

/// The bits that may be 1 in the result of an operation on operands in which those of `a` and
/// `b` may be 1. `by` returns the second operand if it is a constant.
fn possible_ones_of_binary(
    op: BinaryOp,
    a: u64,
    b: u64,
    by: impl FnOnce() -> Option<u64>,
    all: u64,
) -> u64 {
    let within = |most: Option<u64>| match most {
        Some(most) if most <= all => up_to_highest_bit(most),
        _ => all,
    };
    match op {
        BinaryOp::And => a & b,
        BinaryOp::Or | BinaryOp::Xor => a | b,
        BinaryOp::Shl => {
            by().map_or(all, |by| a.checked_shl(u32::try_from(by).unwrap_or(64)).unwrap_or(0))
        }
        BinaryOp::Lshr => match by() {
            Some(by) => a.checked_shr(u32::try_from(by).unwrap_or(64)).unwrap_or(0),
            None => up_to_highest_bit(a),
        },
        BinaryOp::Udiv => up_to_highest_bit(by().map_or(a, |by| a.checked_div(by).unwrap_or(0))),
        BinaryOp::Urem => up_to_highest_bit(by().map_or(a, |by| a.min(by.saturating_sub(1)))),
        BinaryOp::Umin => up_to_highest_bit(a.min(b)),
        BinaryOp::Umax => up_to_highest_bit(a.max(b)),
        // The product of operands below 2^m and 2^n is below 2^(m+n).
        BinaryOp::Umulh => {
            let bits = |ones: u64| u64::BITS - ones.leading_zeros();
            let above = (bits(a) + bits(b)).saturating_sub(bits(all));
            if above < u64::BITS { (1 << above) - 1 } else { all }
        }
        BinaryOp::Add => within(a.checked_add(b)),
        BinaryOp::Mul => within(a.checked_mul(b)),
        _ => all,
    }
}

/// Whether all numbers between the first bounds are between the second.
fn lies_within((low, high): Bounds, (least, most): Bounds) -> bool {
    least <= low && high <= most
}

/// The bounds of the integers that branches pass to the parameters of blocks.
pub(super) struct PassedBounds {
    /// For each block the number of edges to it that have not been visited, and what those pass that
    /// have.
    blocks: PrimaryMap<Block, (u32, Vec<Bounds>)>,
}

impl PassedBounds {
    /// Nothing is visited yet.
    pub(super) fn new(graph: &Graph) -> Self {
        Self { blocks: graph.edges.values().map(|&edges| (edges, vec![])).collect() }
    }

    /// Enters the bounds of a block's parameters, if all branches to it were visited.
    pub(super) fn enter(&self, func: &FuncData, block: Block, ranges: &mut ValueRanges) {
        let (0, bounds) = &self.blocks[block] else { return };
        for (&param, &bounds) in func.block(block).params.iter().zip(bounds) {
            let ty = func.ty(param);
            if ty.is_int() && ty != Type::I1 {
                ranges.set_bounds(param, ty, bounds);
            }
        }
    }

    /// Visits a terminator.
    pub(super) fn note(&mut self, func: &FuncData, terminator: &Terminator, ranges: &ValueRanges) {
        terminator.for_each_block(|block, args| {
            let (missing, all) = &mut self.blocks[block];
            *missing = missing.saturating_sub(1);
            let bounds = args.iter().map(|&arg| match func.ty(arg) {
                Type::F64 | Type::I1 => (0, 0),
                ty => ranges.bounds(arg, ty),
            });
            if all.is_empty() {
                all.extend(bounds);
            } else {
                for (known, passed) in all.iter_mut().zip(bounds) {
                    *known = (known.0.min(passed.0), known.1.max(passed.1));
                }
            }
        });
    }
}
