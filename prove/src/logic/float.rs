//! Doubles as lists of literals, with the operations of the IR on them: IEEE 754 binary64, rounded to the nearest, to even
//! between two. A result that is not a number has the bits that processors of x86-64 give it.

use plcc_ir::FloatCond;

use super::{FALSE, Graph, Lit, TRUE};

/// Bits of the fraction.
const FRACTION: usize = 52;
/// Bits of the significand, with the one that is not stored.
const SIGNIFICAND: usize = FRACTION + 1;
/// Bits in which exponents are computed, with a sign.
const EXPONENT: usize = 14;
/// What is added to an exponent where it is stored.
const BIAS: i64 = 1023;
/// The exponent of infinities and of what is not a number.
const SPECIAL: i64 = 2047;

/// A double in its parts.
struct Parts {
    sign: Lit,
    /// As it is stored, but 1 for numbers that are not normal.
    exponent: Vec<Lit>,
    significand: Vec<Lit>,
    is_zero: Lit,
    is_infinite: Lit,
    is_nan: Lit,
}

/// A bit of a number.
fn bit(bits: &[Lit], number: usize) -> Lit {
    bits.get(number).copied().unwrap_or(FALSE)
}

/// A number of bits, from the bit `first` on.
fn field(bits: &[Lit], first: usize, count: usize) -> Vec<Lit> {
    (first..first + count).map(|number| bit(bits, number)).collect()
}

/// One number above another: the bits of `low` first.
fn join(low: &[Lit], high: &[Lit]) -> Vec<Lit> {
    low.iter().chain(high).copied().collect()
}

impl Graph {
    fn parts(&mut self, x: &[Lit]) -> Parts {
        let (fraction, stored) = (field(x, 0, FRACTION), field(x, FRACTION, 11));
        let is_normal = self.is_not_zero(&stored);
        let has_fraction = self.is_not_zero(&fraction);
        let is_special = self.all(stored.iter().copied());
        let mut exponent = self.resize(&stored, EXPONENT, FALSE);
        if let Some(lowest) = exponent.first_mut() {
            *lowest = self.or(*lowest, !is_normal);
        }
        Parts {
            sign: bit(x, 63),
            exponent,
            significand: join(&fraction, &[is_normal]),
            is_zero: self.and(!is_normal, !has_fraction),
            is_infinite: self.and(is_special, !has_fraction),
            is_nan: self.and(is_special, has_fraction),
        }
    }

    fn infinity(&self, sign: Lit) -> Vec<Lit> {
        let magnitude = self.number(63, SPECIAL << FRACTION);
        join(&magnitude, &[sign])
    }

    /// What is not a number: an operand that is none, or a new one.
    fn nan(&mut self, operands: &[(&[Lit], Lit)]) -> Vec<Lit> {
        let mut nan = join(&self.number(51, 0), &[TRUE; 13]);
        for (x, is_nan) in operands.iter().rev() {
            let mut quiet = x.to_vec();
            if let Some(bit) = quiet.get_mut(FRACTION - 1) {
                *bit = TRUE;
            }
            nan = self.choose_bits(*is_nan, &quiet, &nan);
        }
        nan
    }

    /// A number shifted to the right; the lowest bit of the result is 1 also where a bit that is lost was 1.
    fn shift_sticky(&mut self, a: &[Lit], by: &[Lit]) -> Vec<Lit> {
        let mut value = a.to_vec();
        for (stage, &cond) in by.iter().enumerate() {
            let distance = (1_usize << stage.min(16)).min(value.len());
            let lost = self.any(value.iter().copied().take(distance));
            let mut moved = field(&value, distance, value.len());
            if let Some(lowest) = moved.first_mut() {
                *lowest = self.or(*lowest, lost);
            }
            value = self.choose_bits(cond, &moved, &value);
        }
        value
    }

    /// A number shifted to the left until its highest bit is 1, and the exponent less by as much.
    fn normalised(&mut self, significand: &[Lit], exponent: &[Lit]) -> (Vec<Lit>, Vec<Lit>) {
        let width = significand.len();
        let (mut value, mut by) = (significand.to_vec(), vec![]);
        for stage in (0..usize::BITS - width.leading_zeros()).rev() {
            let distance = 1_usize << stage;
            let is_clear = match distance < width {
                true => !self.any(value.iter().copied().rev().take(distance)),
                false => FALSE,
            };
            let moved = join(&vec![FALSE; distance.min(width)], &value);
            value = self.choose_bits(is_clear, &moved, &value);
            by.insert(0, is_clear);
        }
        let by = self.resize(&by, exponent.len(), FALSE);
        let exponent = self.subtract(exponent, &by).0;
        (value, exponent)
    }

    /// The double of a sign and a significand whose highest bit is 1, or that is 0. `exponent` is how that of the highest bit would
    /// be stored.
    fn rounded(&mut self, sign: Lit, significand: &[Lit], exponent: &[Lit]) -> Vec<Lit> {
        // Two bits behind the significand say how it is rounded.
        let width = SIGNIFICAND + 2;
        let behind = significand.len().saturating_sub(width);
        let lost = self.any(significand.iter().copied().take(behind));
        let mut value = match significand.len() < width {
            true => join(&vec![FALSE; width - significand.len()], significand),
            false => field(significand, behind, width),
        };
        if let Some(lowest) = value.first_mut() {
            *lowest = self.or(*lowest, lost);
        }
        let is_zero = !self.is_not_zero(&value);
        // A number below the normal ones has fewer bits.
        let (zero, one) = (self.number(EXPONENT, 0), self.number(EXPONENT, 1));
        let is_small = self.less_signed(exponent, &one);
        let missing = self.subtract(&one, exponent).0;
        let most = self.number(EXPONENT, 63);
        let is_gone = self.less_signed(&most, &missing);
        let by: Vec<Lit> = missing.iter().take(6).map(|&bit| self.or(bit, is_gone)).collect();
        let small = self.shift_sticky(&value, &by);
        let value = self.choose_bits(is_small, &small, &value);
        let stored = self.choose_bits(is_small, &zero, exponent);
        let up = self.or(bit(&value, 0), bit(&value, 2));
        let up = self.and(up, bit(&value, 1));
        let plain = join(&field(&value, 2, FRACTION), &stored);
        let mut unit = vec![FALSE; plain.len()];
        if let Some(lowest) = unit.first_mut() {
            *lowest = up;
        }
        let all = self.add(&plain, &unit);
        let most = self.number(EXPONENT, SPECIAL);
        let is_large = !self.less_signed(&stored, &most);
        let infinity = self.infinity(sign);
        let number = join(&field(&all, 0, 63), &[sign]);
        let number = self.choose_bits(is_large, &infinity, &number);
        let zero = join(&self.number(63, 0), &[sign]);
        self.choose_bits(is_zero, &zero, &number)
    }

    /// Whether a condition holds, by what [`compare_floats`](Self::compare_floats) gives.
    pub fn float_condition(
        &mut self,
        cond: FloatCond,
        (equal, less, unordered): (Lit, Lit, Lit),
    ) -> Lit {
        let at_most = self.or(less, equal);
        match cond {
            FloatCond::Eq => equal,
            FloatCond::Ne => !equal,
            FloatCond::Lt => less,
            FloatCond::Le => at_most,
            FloatCond::Gt => self.and(!at_most, !unordered),
            FloatCond::Ge => self.and(!less, !unordered),
            FloatCond::EqOrNan => self.or(equal, unordered),
        }
    }

    /// Whether two doubles are equal, and whether the first is less. Neither holds of what is not a number; the third says that
    /// one is none.
    pub fn compare_floats(&mut self, a: &[Lit], b: &[Lit]) -> (Lit, Lit, Lit) {
        let (x, y) = (self.parts(a), self.parts(b));
        let unordered = self.or(x.is_nan, y.is_nan);
        let both_zero = self.and(x.is_zero, y.is_zero);
        let same = self.equal(a, b);
        let equal = self.or(same, both_zero);
        let (low_a, low_b) = (field(a, 0, 63), field(b, 0, 63));
        let smaller = self.less_unsigned(&low_a, &low_b);
        let larger = self.less_unsigned(&low_b, &low_a);
        let by_size = self.choose(x.sign, larger, smaller);
        let signs_differ = self.xor(x.sign, y.sign);
        let less = self.choose(signs_differ, x.sign, by_size);
        let less = self.all([less, !both_zero, !unordered]);
        (self.and(equal, !unordered), less, unordered)
    }

    /// The double of an integer, in two's complement.
    pub fn float_of_int(&mut self, a: &[Lit]) -> Vec<Lit> {
        let sign = a.last().copied().unwrap_or(FALSE);
        let size = self.negate_if(sign, a);
        let exponent = self.number(EXPONENT, BIAS + a.len() as i64 - 1);
        let (significand, exponent) = self.normalised(&size, &exponent);
        self.rounded(sign, &significand, &exponent)
    }

    /// The integer of 32 bits of a double, rounded towards 0; the lowest one where it does not fit.
    pub fn int_of_float(&mut self, x: &[Lit]) -> Vec<Lit> {
        let parts = self.parts(x);
        let limit = self.number(EXPONENT, BIAS + 31);
        let fits = self.less_signed(&parts.exponent, &limit);
        let one = self.number(EXPONENT, BIAS);
        let is_below_one = self.less_signed(&parts.exponent, &one);
        // The significand of a number of 31 bits, moved down by what is missing.
        let most = self.number(EXPONENT, BIAS + 30);
        let missing = self.subtract(&most, &parts.exponent).0;
        let top = field(&parts.significand, SIGNIFICAND - 31, 32);
        let size = self.shift(&top, &field(&missing, 0, 5), false, FALSE);
        let size: Vec<Lit> = size.into_iter().map(|bit| self.and(bit, !is_below_one)).collect();
        let value = self.negate_if(parts.sign, &size);
        let lowest = self.number(32, i32::MIN.into());
        self.choose_bits(fits, &value, &lowest)
    }

    /// The low 64 bits of a double that is rounded to the nearest integer, away from 0 between two; 0 for what is not finite.
    pub fn bits_of_float(&mut self, x: &[Lit]) -> Vec<Lit> {
        let parts = self.parts(x);
        // Twice the number without its fraction says how it is rounded.
        let whole = self.number(EXPONENT, BIAS + FRACTION as i64 - 1);
        let half = self.number(EXPONENT, BIAS - 1);
        let is_small = self.less_signed(&parts.exponent, &half);
        let is_whole = !self.less_signed(&parts.exponent, &whole);
        let significand = self.resize(&parts.significand, 65, FALSE);
        let right = self.subtract(&whole, &parts.exponent).0;
        let right = self.shift(&significand, &field(&right, 0, 6), false, FALSE);
        let left = self.subtract(&parts.exponent, &whole).0;
        let is_far = self.any(left.iter().copied().skip(7));
        let left = self.shift(&significand, &field(&left, 0, 7), true, FALSE);
        let left: Vec<Lit> = left.into_iter().map(|bit| self.and(bit, !is_far)).collect();
        let twice = self.choose_bits(is_whole, &left, &right);
        let one = self.number(65, 1);
        let twice = self.add(&twice, &one);
        let special = self.or(parts.is_nan, parts.is_infinite);
        let is_nothing = self.or(special, is_small);
        let size: Vec<Lit> = twice.iter().skip(1).map(|&bit| self.and(bit, !is_nothing)).collect();
        self.negate_if(parts.sign, &size)
    }

    /// Whether a double is the number that [`int_of_float`](Self::int_of_float) gives, and whether it is not a number.
    pub fn is_integer(&mut self, x: &[Lit]) -> (Lit, Lit) {
        let int = self.int_of_float(x);
        let back = self.float_of_int(&int);
        let (equal, _, unordered) = self.compare_floats(&back, x);
        (equal, unordered)
    }

    /// A double without its fraction. `up` says when it is rounded away from 0, by its sign.
    pub fn without_fraction(&mut self, x: &[Lit], up: impl Fn(Lit) -> Lit) -> Vec<Lit> {
        let parts = self.parts(x);
        let one = self.number(EXPONENT, BIAS);
        let is_below_one = self.less_signed(&parts.exponent, &one);
        let whole = self.number(EXPONENT, BIAS + FRACTION as i64);
        let is_whole = !self.less_signed(&parts.exponent, &whole);
        let bits = self.subtract(&whole, &parts.exponent).0;
        // A 1 at each place that is kept, and at the one above.
        let ones = vec![TRUE; SIGNIFICAND];
        let kept = self.shift(&ones, &field(&bits, 0, 6), true, FALSE);
        let mut has_fraction = FALSE;
        let mut cut = vec![];
        for (&bit, &keep) in x.iter().zip(&join(&kept, &[TRUE; 11])) {
            let lost = self.and(bit, !keep);
            has_fraction = self.or(has_fraction, lost);
            cut.push(self.and(bit, keep));
        }
        let mut unit = vec![];
        for place in 0..cut.len() {
            let below = place.checked_sub(1).map_or(FALSE, |place| bit(&kept, place));
            let here = if place < kept.len() { bit(&kept, place) } else { below };
            unit.push(self.and(here, !below));
        }
        let away = self.and(has_fraction, up(parts.sign));
        let unit: Vec<Lit> = unit.into_iter().map(|bit| self.and(bit, away)).collect();
        let rounded = self.add(&cut, &unit);
        let rounded = self.choose_bits(is_whole, x, &rounded);
        let small_up = self.and(!parts.is_zero, up(parts.sign));
        let one = self.number(63, BIAS << FRACTION);
        let small: Vec<Lit> = one.into_iter().map(|bit| self.and(bit, small_up)).collect();
        let small = join(&small, &[parts.sign]);
        let number = self.choose_bits(is_below_one, &small, &rounded);
        let nan = self.nan(&[(x, TRUE)]);
        self.choose_bits(parts.is_nan, &nan, &number)
    }

    /// A double, or the nearest finite one; 0 for what is not a number.
    pub fn finite(&mut self, x: &[Lit]) -> Vec<Lit> {
        let parts = self.parts(x);
        let largest = self.number(63, f64::MAX.to_bits() as i64);
        let largest = join(&largest, &[parts.sign]);
        let finite = self.choose_bits(parts.is_infinite, &largest, x);
        finite.into_iter().map(|bit| self.and(bit, !parts.is_nan)).collect()
    }

    /// The sum of two doubles.
    pub fn add_floats(&mut self, a: &[Lit], b: &[Lit]) -> Vec<Lit> {
        let (x, y) = (self.parts(a), self.parts(b));
        let is_smaller = self.less_unsigned(&field(a, 0, 63), &field(b, 0, 63));
        let mut pick = |one: &[Lit], other: &[Lit]| {
            (self.choose_bits(is_smaller, other, one), self.choose_bits(is_smaller, one, other))
        };
        let (large, small) = pick(&x.significand, &y.significand);
        let (exponent, low) = pick(&x.exponent, &y.exponent);
        let sign = self.choose(is_smaller, y.sign, x.sign);
        // Three bits more, so that what is lost of the smaller one counts.
        let (large, small) = (join(&[FALSE; 3], &large), join(&[FALSE; 3], &small));
        let distance = self.subtract(&exponent, &low).0;
        let is_far = self.any(distance.iter().copied().skip(6));
        let by: Vec<Lit> = distance.iter().take(6).map(|&bit| self.or(bit, is_far)).collect();
        let small = self.shift_sticky(&small, &by);
        let (large, small) = (join(&large, &[FALSE]), join(&small, &[FALSE]));
        let differ = self.xor(x.sign, y.sign);
        let small: Vec<Lit> = small.into_iter().map(|bit| self.xor(bit, differ)).collect();
        let sum = self.add_carry(&large, &small, differ).0;
        let is_zero = !self.is_not_zero(&sum);
        let both = self.and(x.sign, y.sign);
        let sign = self.choose(is_zero, both, sign);
        let one = self.number(EXPONENT, 1);
        let exponent = self.add(&exponent, &one);
        let (significand, exponent) = self.normalised(&sum, &exponent);
        let number = self.rounded(sign, &significand, &exponent);
        let is_infinite = self.or(x.is_infinite, y.is_infinite);
        let infinity_sign = self.choose(x.is_infinite, x.sign, y.sign);
        let infinity = self.infinity(infinity_sign);
        let number = self.choose_bits(is_infinite, &infinity, &number);
        let opposite = self.all([x.is_infinite, y.is_infinite, differ]);
        self.or_nan(number, opposite, a, &x, b, &y)
    }

    /// The difference of two doubles.
    pub fn subtract_floats(&mut self, a: &[Lit], b: &[Lit]) -> Vec<Lit> {
        let is_nan = self.parts(b).is_nan;
        let mut b = b.to_vec();
        if let Some(sign) = b.last_mut() {
            *sign = self.xor(*sign, !is_nan);
        }
        self.add_floats(a, &b)
    }

    /// A result, or that it is not a number, where it is invalid or an operand is not a number.
    fn or_nan(
        &mut self,
        number: Vec<Lit>,
        invalid: Lit,
        a: &[Lit],
        x: &Parts,
        b: &[Lit],
        y: &Parts,
    ) -> Vec<Lit> {
        let nan = self.nan(&[(a, x.is_nan), (b, y.is_nan)]);
        let is_nan = self.any([invalid, x.is_nan, y.is_nan]);
        self.choose_bits(is_nan, &nan, &number)
    }

    /// The product of two doubles.
    pub fn multiply_floats(&mut self, a: &[Lit], b: &[Lit]) -> Vec<Lit> {
        let (x, y) = (self.parts(a), self.parts(b));
        let sign = self.xor(x.sign, y.sign);
        let wide = 2 * SIGNIFICAND;
        let (one, other) =
            (self.resize(&x.significand, wide, FALSE), self.resize(&y.significand, wide, FALSE));
        let product = self.multiply(&one, &other);
        let exponent = self.add(&x.exponent, &y.exponent);
        let bias = self.number(EXPONENT, BIAS - 1);
        let exponent = self.subtract(&exponent, &bias).0;
        let (significand, exponent) = self.normalised(&product, &exponent);
        let number = self.rounded(sign, &significand, &exponent);
        let is_infinite = self.or(x.is_infinite, y.is_infinite);
        let is_zero = self.or(x.is_zero, y.is_zero);
        let infinity = self.infinity(sign);
        let number = self.choose_bits(is_infinite, &infinity, &number);
        let invalid = self.and(is_infinite, is_zero);
        self.or_nan(number, invalid, a, &x, b, &y)
    }

    /// The quotient of two doubles.
    pub fn divide_floats(&mut self, a: &[Lit], b: &[Lit]) -> Vec<Lit> {
        let (x, y) = (self.parts(a), self.parts(b));
        let sign = self.xor(x.sign, y.sign);
        let (mut rest, above) = self.normalised(&x.significand, &x.exponent);
        let (divisor, below) = self.normalised(&y.significand, &y.exponent);
        let exponent = self.subtract(&above, &below).0;
        let bias = self.number(EXPONENT, BIAS);
        let exponent = self.add(&exponent, &bias);
        let divisor = join(&divisor, &[FALSE]);
        rest.push(FALSE);
        let mut quotient = vec![];
        for _ in 0..SIGNIFICAND + 3 {
            let (less, fits) = self.subtract(&rest, &divisor);
            rest = self.choose_bits(fits, &less, &rest);
            rest.insert(0, FALSE);
            rest.pop();
            quotient.insert(0, fits);
        }
        let more = self.is_not_zero(&rest);
        quotient.insert(0, more);
        let (significand, exponent) = self.normalised(&quotient, &exponent);
        let number = self.rounded(sign, &significand, &exponent);
        let to_zero = self.or(x.is_zero, y.is_infinite);
        let number: Vec<Lit> = number.into_iter().map(|bit| self.and(bit, !to_zero)).collect();
        let number = join(&field(&number, 0, 63), &[sign]);
        let to_infinity = self.or(x.is_infinite, y.is_zero);
        let infinity = self.infinity(sign);
        let number = self.choose_bits(to_infinity, &infinity, &number);
        let both_zero = self.and(x.is_zero, y.is_zero);
        let both_infinite = self.and(x.is_infinite, y.is_infinite);
        let invalid = self.or(both_zero, both_infinite);
        self.or_nan(number, invalid, a, &x, b, &y)
    }
}
