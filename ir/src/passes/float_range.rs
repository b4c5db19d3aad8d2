//! What is known of a double before the program runs: between which numbers it lies, whether it is an
//! integer, and whether it may be NaN or -0.
//!
//! ```text
//! v0: i32 = load words:0
//! v1: i32 = and v0, 7
//! v2: f64 = itof v1              an integer from 0 to 7
//! v3: f64 = load p:0             finite and not -0, if `p` is one of the module's finite regions
//! v4: f64 = fadd v2, v3          finite and not -0
//! v5: f64 = fmul v3, v3          perhaps infinite or -0
//! ```
//!
//! In this file an integer is one whose magnitude is at most 2^53. Every such integer is a double, so
//! that the arithmetic of integers gives exactly what that of doubles gives. Only the sign of a zero
//! differs; therefore each range says whether its double may be -0.

use plcc_abi::{DoubleRange, HostFn, IntegerForm};

use super::value_range::ValueRanges;
use crate::{
    BinaryOp, ConvertOp, FuncData, InstData, RegionId, SecondaryMap, Type, UnaryOp, Value,
};

/// Every integer of at most this magnitude is a double.
const EXACT: i64 = 1 << 53;

/// The bit operators of a control take integers from -`BIT_OPERANDS` to `BIT_OPERANDS` - 1 as they
/// are ([`IntegerForm::And`]). No result of one has a greater magnitude, whatever the operands are.
const BIT_OPERANDS: i64 = 1 << 39;

/// The range of a double.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum FloatRange {
    /// An integer.
    Int {
        /// The least that it may be, at least -2^53.
        low: i64,
        /// The greatest that it may be, at most 2^53.
        high: i64,
        /// Whether a zero may be -0.
        minus_zero: bool,
    },
    /// Any double.
    Real {
        /// The least that it may be, perhaps an infinity.
        low: f64,
        /// The greatest that it may be, perhaps an infinity.
        high: f64,
        /// Whether it may be NaN.
        nan: bool,
        /// Whether a zero may be -0.
        minus_zero: bool,
    },
}

impl FloatRange {
    /// Nothing is known.
    pub(super) const ANY: Self =
        Self::Real { low: f64::NEG_INFINITY, high: f64::INFINITY, nan: true, minus_zero: true };

    /// A double that is finite and not -0.
    pub(super) const FINITE: Self =
        Self::Real { low: -f64::MAX, high: f64::MAX, nan: false, minus_zero: false };

    /// An integer of 32 bits.
    pub(super) const INT32: Self =
        Self::Int { low: i32::MIN as i64, high: i32::MAX as i64, minus_zero: false };

    /// An integer from `low` to `high`, which is not -0.
    pub(super) fn int(low: i64, high: i64) -> Self {
        if low >= -EXACT && high <= EXACT {
            Self::Int { low, high, minus_zero: false }
        } else {
            // Conversions round to the nearest double, which keeps the order.
            let (low, high) = (low as f64, high as f64);
            Self::Real { low, high, nan: false, minus_zero: false }
        }
    }

    /// A constant, given as its bits.
    pub(super) fn constant(bits: u64) -> Self {
        let value = f64::from_bits(bits);
        let minus_zero = value == 0.0 && value.is_sign_negative();
        if value.fract() == 0.0 && value.abs() <= EXACT as f64 {
            Self::Int { low: value as i64, high: value as i64, minus_zero }
        } else if value.is_nan() {
            Self::Real { low: 0.0, high: 0.0, nan: true, minus_zero: false }
        } else {
            Self::Real { low: value, high: value, nan: false, minus_zero }
        }
    }

    /// The least and the greatest number, if it is an integer.
    pub(super) fn integers(self) -> Option<(i64, i64)> {
        match self {
            Self::Int { low, high, minus_zero: _ } => Some((low, high)),
            Self::Real { .. } => None,
        }
    }

    /// The least and the greatest number as doubles. If it may be NaN, they are those of the other
    /// numbers that it may be.
    pub(super) fn ends(self) -> (f64, f64) {
        match self {
            Self::Int { low, high, minus_zero: _ } => (low as f64, high as f64),
            Self::Real { low, high, .. } => (low, high),
        }
    }

    /// Whether all numbers of the range are integers of 32 bits.
    pub(super) fn is_int32(self) -> bool {
        self.integers()
            .is_some_and(|(low, high)| i32::try_from(low).is_ok() && i32::try_from(high).is_ok())
    }

    /// Whether it may be NaN.
    pub(super) fn may_be_nan(self) -> bool {
        matches!(self, Self::Real { nan: true, .. })
    }

    /// Whether it may be -0.
    pub(super) fn may_be_minus_zero(self) -> bool {
        match self {
            Self::Int { minus_zero, .. } | Self::Real { minus_zero, .. } => minus_zero,
        }
    }

    /// Whether it is neither infinite nor NaN.
    pub(super) fn is_finite(self) -> bool {
        let (low, high) = self.ends();
        !self.may_be_nan() && low >= -f64::MAX && high <= f64::MAX
    }

    /// Whether it may be 0 or -0.
    fn may_be_zero(self) -> bool {
        let (low, high) = self.ends();
        low <= 0.0 && high >= 0.0
    }

    /// Whether it may be infinite.
    fn may_be_infinite(self) -> bool {
        let (low, high) = self.ends();
        low < -f64::MAX || high > f64::MAX
    }

    /// Whether its sign bit may be set.
    fn may_be_negative(self) -> bool {
        self.ends().0 < 0.0 || self.may_be_minus_zero()
    }

    /// What is known of a double that lies in one range or the other.
    pub(super) fn join(self, other: Self) -> Self {
        let minus_zero = self.may_be_minus_zero() || other.may_be_minus_zero();
        if let (Some((a, b)), Some((x, y))) = (self.integers(), other.integers()) {
            return Self::Int { low: a.min(x), high: b.max(y), minus_zero };
        }
        let ((a, b), (x, y)) = (self.ends(), other.ends());
        let nan = self.may_be_nan() || other.may_be_nan();
        Self::Real { low: a.min(x), high: b.max(y), nan, minus_zero }
    }

    /// The range of an operation's result on one operand.
    fn unary(op: UnaryOp, x: Self) -> Self {
        let (low, high) = x.ends();
        match (op, x) {
            (UnaryOp::Fneg, _) => {
                let zero = x.may_be_zero();
                match x {
                    Self::Int { low, high, .. } => {
                        Self::Int { low: -high, high: -low, minus_zero: zero }
                    }
                    Self::Real { low, high, nan, .. } => {
                        Self::Real { low: -high, high: -low, nan, minus_zero: zero }
                    }
                }
            }
            (UnaryOp::Fabs, Self::Int { low, high, .. }) => {
                let most = low.abs().max(high.abs());
                let least = if low <= 0 && high >= 0 { 0 } else { low.abs().min(high.abs()) };
                Self::int(least, most)
            }
            (UnaryOp::Fabs, Self::Real { nan, .. }) => {
                let high = low.abs().max(high.abs());
                Self::Real { low: 0.0, high, nan, minus_zero: false }
            }
            (UnaryOp::Ffloor, _) => x.rounded(f64::floor, x.may_be_minus_zero()),
            (UnaryOp::Fceil, _) => x.rounded(f64::ceil, x.may_be_negative()),
            (UnaryOp::Ftrunc, _) => x.rounded(f64::trunc, x.may_be_negative()),
            (UnaryOp::Fsqrt, _) => Self::Real {
                low: low.max(0.0).sqrt(),
                high: high.max(0.0).sqrt(),
                nan: x.may_be_nan() || low < 0.0,
                minus_zero: x.may_be_minus_zero(),
            },
            (UnaryOp::Ffinite, Self::Int { .. }) => x,
            (UnaryOp::Ffinite, Self::Real { nan, minus_zero, .. }) => {
                let (mut low, mut high) =
                    (low.clamp(-f64::MAX, f64::MAX), high.clamp(-f64::MAX, f64::MAX));
                if nan {
                    (low, high) = (low.min(0.0), high.max(0.0));
                }
                Self::Real { low, high, nan: false, minus_zero }
            }
            (UnaryOp::Not | UnaryOp::Neg, _) => Self::ANY,
        }
    }

    /// The range of a double that `round` makes an integer of.
    fn rounded(self, round: fn(f64) -> f64, minus_zero: bool) -> Self {
        if let Self::Int { .. } = self {
            return self;
        }
        let ends = self.ends();
        let (low, high) = (round(ends.0), round(ends.1));
        let nan = self.may_be_nan();
        if !nan && low >= -(EXACT as f64) && high <= EXACT as f64 {
            return Self::Int { low: low as i64, high: high as i64, minus_zero };
        }
        Self::Real { low, high, nan, minus_zero }
    }

    /// The range of an operation's result on two operands.
    fn binary(op: BinaryOp, a: Self, b: Self) -> Self {
        let minus_zero = match op {
            // A sum is -0 only if both operands are.
            BinaryOp::Fadd => a.may_be_minus_zero() && b.may_be_minus_zero(),
            // A difference is -0 only if 0 is taken from -0.
            BinaryOp::Fsub => a.may_be_minus_zero() && b.may_be_zero(),
            // Products and quotients other than zero may come out as a zero with their sign.
            BinaryOp::Fmul | BinaryOp::Fdiv => a.may_be_negative() || b.may_be_negative(),
            // The others are on integers.
            _ => return Self::ANY,
        };
        if let (Some(a), Some(b)) = (a.integers(), b.integers())
            && let Some((low, high)) = integer_binary(op, a, b)
            && low >= -EXACT
            && high <= EXACT
        {
            let zero = low <= 0 && high >= 0;
            return Self::Int { low, high, minus_zero: minus_zero && zero };
        }
        let ((a_low, a_high), (b_low, b_high)) = (a.ends(), b.ends());
        let mut nan = a.may_be_nan() || b.may_be_nan();
        let (low, high) = match op {
            BinaryOp::Fadd => {
                nan |= a.may_be_infinite() && b.may_be_infinite();
                (a_low + b_low, a_high + b_high)
            }
            BinaryOp::Fsub => {
                nan |= a.may_be_infinite() && b.may_be_infinite();
                (a_low - b_high, a_high - b_low)
            }
            BinaryOp::Fmul => {
                nan |= a.may_be_infinite() && b.may_be_zero()
                    || a.may_be_zero() && b.may_be_infinite();
                corners([a_low * b_low, a_low * b_high, a_high * b_low, a_high * b_high])
            }
            BinaryOp::Fdiv if !b.may_be_zero() => {
                nan |= a.may_be_infinite() && b.may_be_infinite();
                corners([a_low / b_low, a_low / b_high, a_high / b_low, a_high / b_high])
            }
            _ => return Self::ANY,
        };
        // The sum of opposite infinities is NaN; then nothing is known of that end.
        let low = if low.is_nan() { f64::NEG_INFINITY } else { low };
        let high = if high.is_nan() { f64::INFINITY } else { high };
        Self::Real { low, high, nan, minus_zero }
    }

    /// The range of a host function's result. `args` are the ranges of its operands.
    fn call(function: HostFn, args: &[Self]) -> Self {
        let finite =
            |most: f64, minus_zero| Self::Real { low: -most, high: most, nan: false, minus_zero };
        match (function.integer_form(), args) {
            (Some(form @ (IntegerForm::And | IntegerForm::Or | IntegerForm::Xor)), &[a, b]) => {
                let all = a.integers().zip(b.integers());
                match all.and_then(|(a, b)| bit_operation(form, a, b)) {
                    Some((low, high)) => Self::int(low, high),
                    None => finite(BIT_OPERANDS as f64, false),
                }
            }
            (Some(IntegerForm::Modulo), &[a, by]) => {
                let by_integer = a.integers().and(by.integers());
                match by_integer {
                    Some((low, high)) if low == high && low > 0 => Self::int(0, low - 1),
                    Some((low, high)) if low == high && low < 0 => Self::int(low, -low - 1),
                    _ => {
                        let (low, high) = by.ends();
                        let most = low.abs().max(high.abs()).min(f64::MAX);
                        finite(if most.is_nan() { f64::MAX } else { most }, false)
                    }
                }
            }
            (Some(IntegerForm::Range), &[x, low, high]) => {
                match (x.integers(), low.integers(), high.integers()) {
                    (Some((least, most)), Some((_, low)), Some((high, _)))
                        if low <= least && most <= high =>
                    {
                        Self::int(least, most)
                    }
                    // The function rounds its number to an integer. If that is outside the range, it
                    // is divided by the length of the range, and the length is added to the remainder,
                    // or taken from it, at most once.
                    (_, Some((low, first)), Some((last, high))) if first <= last => {
                        let length = high - low + 1;
                        Self::int(low.min(-length), high.max(2 * length))
                    }
                    _ => Self::ANY,
                }
            }
            _ => match function.double_range() {
                DoubleRange::Any => Self::ANY,
                DoubleRange::Finite => Self::FINITE,
                DoubleRange::FiniteOrMinusZero => finite(f64::MAX, true),
            },
        }
    }
}

/// The least and the greatest of some results. NaN comes only of an infinity and 0, or of two
/// infinities; other operands from the same ranges may give 0, so that counts then.
fn corners(results: [f64; 4]) -> (f64, f64) {
    results.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &result| {
        let result = if result.is_nan() { 0.0 } else { result };
        (low.min(result), high.max(result))
    })
}

/// The bounds of an operation's result on integers between bounds; `None` for a division, and where a
/// bound does not fit an `i64`.
fn integer_binary(op: BinaryOp, a: (i64, i64), b: (i64, i64)) -> Option<(i64, i64)> {
    match op {
        BinaryOp::Fadd => Some((a.0 + b.0, a.1 + b.1)),
        BinaryOp::Fsub => Some((a.0 - b.1, a.1 - b.0)),
        BinaryOp::Fmul => {
            let (mut low, mut high) = (i64::MAX, i64::MIN);
            for (x, y) in [(a.0, b.0), (a.0, b.1), (a.1, b.0), (a.1, b.1)] {
                let product = x.checked_mul(y)?;
                (low, high) = (low.min(product), high.max(product));
            }
            Some((low, high))
        }
        _ => None,
    }
}

/// The bounds of a bit operation on integers; `None` if an operand may be too large for it.
fn bit_operation(form: IntegerForm, a: (i64, i64), b: (i64, i64)) -> Option<(i64, i64)> {
    if [a.0, a.1, b.0, b.1].iter().any(|v| !(-BIT_OPERANDS..BIT_OPERANDS).contains(v)) {
        return None;
    }
    let bits =
        |(low, high): (i64, i64)| 64 - (low ^ (low >> 63)).max(high ^ (high >> 63)).leading_zeros();
    let all = (1i64 << bits(a).max(bits(b))) - 1;
    Some(match (form, a.0 >= 0, b.0 >= 0) {
        (IntegerForm::And, true, true) => (0, a.1.min(b.1)),
        (IntegerForm::And, true, false) => (0, a.1),
        (IntegerForm::And, false, true) => (0, b.1),
        (_, true, true) => (0, all),
        _ => (-all - 1, all),
    })
}

/// The ranges of a function's doubles.
pub(super) struct FloatRanges<'a> {
    /// The module's regions of finite doubles.
    finite_regions: &'a [RegionId],
    /// For each value its range; for values of other types [`FloatRange::ANY`].
    ranges: SecondaryMap<Value, FloatRange>,
}

impl<'a> FloatRanges<'a> {
    /// A table in which nothing is known. `finite_regions` are those of the module.
    pub(super) fn new(func: &FuncData, finite_regions: &'a [RegionId]) -> Self {
        let mut ranges = SecondaryMap::with_default(FloatRange::ANY);
        ranges.resize(func.value_count());
        Self { finite_regions, ranges }
    }

    /// The range of a value.
    pub(super) fn get(&self, value: Value) -> FloatRange {
        self.ranges[value]
    }

    /// Enters the range of a value.
    pub(super) fn set(&mut self, value: Value, range: FloatRange) {
        self.ranges[value] = range;
    }

    /// Whether an instruction loads a double that is finite and not -0.
    pub(super) fn is_finite_load(&self, data: &InstData) -> bool {
        match data {
            InstData::Load { ty: Type::F64, at } => {
                // The doubles of a region are at multiples of 8.
                let aligned = at.offset % 8 == 0 && at.index.is_none_or(|i| i.scale % 8 == 0);
                aligned && self.finite_regions.contains(&at.region)
            }
            _ => false,
        }
    }

    /// What is known of the result of an instruction that gives a double. `integers` has what is
    /// known of integers.
    pub(super) fn of(
        &self,
        func: &FuncData,
        integers: &ValueRanges,
        data: &InstData,
    ) -> FloatRange {
        self.of_operands(func, integers, data, |value| self.get(value))
    }

    /// The same, with the ranges of the instruction's operands that `range` gives instead of those in
    /// the table.
    pub(super) fn of_operands(
        &self,
        func: &FuncData,
        integers: &ValueRanges,
        data: &InstData,
        range: impl Fn(Value) -> FloatRange,
    ) -> FloatRange {
        match *data {
            InstData::Fconst { bits } => FloatRange::constant(bits),
            InstData::Unary { op, arg } => FloatRange::unary(op, range(arg)),
            // A finite number less itself is 0; an infinity or NaN less itself is NaN.
            InstData::Binary { op: BinaryOp::Fsub, args: [a, b] }
                if a == b && range(a).is_finite() =>
            {
                FloatRange::int(0, 0)
            }
            InstData::Binary { op, args: [a, b] } => FloatRange::binary(op, range(a), range(b)),
            InstData::Select { cond: _, args: [a, b] } => range(a).join(range(b)),
            InstData::Convert { op: ConvertOp::IntToFloat, to: _, arg } => {
                let (low, high) = integers.bounds(arg, func.ty(arg));
                FloatRange::int(low, high)
            }
            InstData::Load { .. } if self.is_finite_load(data) => FloatRange::FINITE,
            InstData::HostCall { function, args } => {
                let mut ranges = [FloatRange::ANY; 4];
                let args = args.as_slice();
                for (slot, &arg) in ranges.iter_mut().zip(args) {
                    *slot = range(arg);
                }
                FloatRange::call(function, ranges.get(..args.len()).unwrap_or_default())
            }
            _ => FloatRange::ANY,
        }
    }

    /// Enters the range of `value`, the result of an instruction, if that is a double.
    pub(super) fn note(
        &mut self,
        func: &FuncData,
        integers: &ValueRanges,
        value: Value,
        data: &InstData,
    ) {
        if func.ty(value) == Type::F64 {
            let range = self.of(func, integers, data);
            self.set(value, range);
        }
    }
}

#[cfg(test)]
mod tests {
    use plcc_abi::pmac::pure_functions;

    use super::*;
    use crate::eval;

    /// Numbers at the edges of ranges and formats.
    const NUMBERS: [f64; 26] = [
        0.0,
        -0.0,
        0.5,
        -0.5,
        1.0,
        -1.0,
        2.0,
        -3.0,
        7.0,
        255.0,
        -256.0,
        100.25,
        2_147_483_647.0,
        -2_147_483_648.0,
        549_755_813_887.0,
        549_755_813_888.0,
        -549_755_813_888.0,
        4_503_599_627_370_496.0,
        9_007_199_254_740_991.0,
        9_007_199_254_740_992.0,
        -9_007_199_254_740_992.0,
        1e-300,
        -1e-300,
        f64::MAX,
        -f64::MAX,
        f64::INFINITY,
    ];

    fn constant(value: f64) -> FloatRange {
        FloatRange::constant(value.to_bits())
    }

    /// Whether a range allows a number.
    fn allows(range: FloatRange, value: f64) -> bool {
        if value.is_nan() {
            return range.may_be_nan();
        }
        if value == 0.0 && value.is_sign_negative() && !range.may_be_minus_zero() {
            return false;
        }
        let (low, high) = range.ends();
        let is_integer = value.fract() == 0.0 && value.abs() <= EXACT as f64;
        low <= value && value <= high && (is_integer || range.integers().is_none())
    }

    /// Ranges that contain both numbers.
    fn ranges(a: f64, b: f64) -> [FloatRange; 2] {
        let both = constant(a).join(constant(b));
        [both, both.join(constant(-7.0)).join(constant(9.0))]
    }

    #[test]
    fn results_lie_in_the_range_of_results() {
        let ops = [
            UnaryOp::Fneg,
            UnaryOp::Fabs,
            UnaryOp::Fsqrt,
            UnaryOp::Ffloor,
            UnaryOp::Fceil,
            UnaryOp::Ftrunc,
            UnaryOp::Ffinite,
        ];
        for a in NUMBERS {
            for b in NUMBERS {
                for range in ranges(a, b) {
                    for op in ops {
                        let found = FloatRange::unary(op, range);
                        for x in [a, b] {
                            let bits = eval::unary(op, Type::F64, x.to_bits() as i64);
                            let result = f64::from_bits(bits as u64);
                            assert!(allows(found, result), "{op:?} {x}: {result}, {found:?}");
                        }
                    }
                }
            }
        }
        for op in [BinaryOp::Fadd, BinaryOp::Fsub, BinaryOp::Fmul, BinaryOp::Fdiv] {
            for a in NUMBERS {
                for b in NUMBERS {
                    for (left, right) in [(constant(a), constant(b)), (wide(a), wide(b))] {
                        let found = FloatRange::binary(op, left, right);
                        let bits = |x: f64| x.to_bits() as i64;
                        let result = eval::binary(op, Type::F64, bits(a), bits(b));
                        let result = f64::from_bits(result as u64);
                        assert!(allows(found, result), "{op:?} {a} {b}: {result}, {found:?}");
                    }
                }
            }
        }
    }

    /// A range around a number.
    fn wide(value: f64) -> FloatRange {
        constant(value).join(constant(5.0)).join(constant(-2.0))
    }

    /// A range around a number that has no negative numbers if the number is not negative.
    fn upwards(value: f64) -> FloatRange {
        constant(value).join(constant(5.0))
    }

    #[test]
    fn results_of_host_functions_lie_in_the_range_of_results() {
        let functions = [
            HostFn::PmacMod,
            HostFn::PmacAnd,
            HostFn::PmacOr,
            HostFn::PmacXor,
            HostFn::PmacSin,
            HostFn::PmacTan,
            HostFn::PmacAsin,
            HostFn::PmacAtan2,
            HostFn::PmacSqrt,
            HostFn::PmacLn,
            HostFn::PmacExp,
            HostFn::PmacRange,
        ];
        for function in functions {
            let count = function.signature().0.len();
            for a in NUMBERS {
                for b in NUMBERS {
                    let args = [a, b, b.abs() + 10.0];
                    let words = [a.to_bits(), b.to_bits(), args[2].to_bits(), 0];
                    let result = pure_functions::call(function, words).map(f64::from_bits);
                    let result = result.expect("it is pure");
                    let around: [fn(f64) -> FloatRange; 3] = [constant, upwards, wide];
                    for (first, others) in around.iter().flat_map(|f| around.map(|o| (f, o))) {
                        let known = [first(args[0]), others(args[1]), others(args[2])];
                        let found = FloatRange::call(function, &known[..count.min(3)]);
                        assert!(allows(found, result), "{function:?} {a} {b}: {result}, {found:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn remainders_stay_within_their_bounds() {
        for by in [1.0, 2.0, 3.0, 8.0, -1.0, -2.0, -3.0, -8.0] {
            let x = FloatRange::int(-40, 40);
            let range = FloatRange::call(HostFn::PmacMod, &[x, constant(by)]);
            assert!(range.integers().is_some());
            for x in -40..=40 {
                let args = [f64::from(x).to_bits(), by.to_bits(), 0, 0];
                let value = pure_functions::call(HostFn::PmacMod, args).map(f64::from_bits);
                assert!(allows(range, value.expect("it is pure")), "{x} % {by}: {value:?}");
            }
        }
    }
}
