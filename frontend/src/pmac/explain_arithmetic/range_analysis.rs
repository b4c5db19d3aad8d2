//! Range analysis: what is known of a value before the program runs.
//!
//! [`Bounds`] says of a value that it is an integer between two others, a double of at most some
//! magnitude (and whether it may be NaN or -0), or a truth value. The bounds of an operation follow
//! from those of its operands. Integers are kept within ±2^53, where every integer is a double, so
//! integer arithmetic gives exactly what the control's floating point gives. The sign of a zero
//! does not matter: stores drop it, and comparators and functions do not depend on it.

use plcc_abi::pmac::{Field, Format};

use crate::pmac::ast::Bin;

/// What is known of a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Bounds {
    /// An integer, not less than the first and not greater than the second.
    Int(i64, i64),
    /// A double: the most that its magnitude can be, whether it may be NaN, and whether it may be
    /// -0.
    Real { most: f64, nan: bool, minus_zero: bool },
    /// A truth value.
    Truth,
}

/// Every integer of at most this magnitude is a double.
const EXACT: i64 = 1 << 53;

/// Integers of a magnitude below this keep all their bits in the fixed-point form on which the
/// control's bit operators work. No result of a bit operator has a greater magnitude.
const FIXED: i64 = 1 << 39;

impl Bounds {
    /// Any value that a variable can hold.
    pub(crate) const FINITE: Self = Self::Real { most: f64::MAX, nan: false, minus_zero: false };

    /// The value of an M-variable that is defined as `*`, that is, as no word of memory: 21 bits,
    /// signed.
    pub(crate) const STAR: Self = Self::Int(-(1 << 20), (1 << 20) - 1);

    /// The result of a function such as SIN: finite, and perhaps -0.
    pub(crate) const FUNCTION: Self = Self::Real { most: f64::MAX, nan: false, minus_zero: true };

    /// The bounds of a literal.
    pub(crate) fn constant(value: f64) -> Self {
        if value.fract() == 0.0 && value.abs() <= EXACT as f64 {
            Self::Int(value as i64, value as i64)
        } else {
            Self::Real { most: value.abs(), nan: value.is_nan(), minus_zero: false }
        }
    }

    /// The bounds of a field of a word.
    pub(crate) fn field(field: Field) -> Self {
        let width = u32::from(field.width.clamp(1, 24));
        match field.format {
            Format::U => Self::Int(0, (1 << width) - 1),
            Format::S => Self::Int(-(1 << (width - 1)), (1 << (width - 1)) - 1),
            // Six digits of up to 15 each.
            Format::D | Format::C => Self::Int(0, 1_666_665),
        }
    }

    /// The value as a double: the most that its magnitude can be, whether it may be NaN, and
    /// whether it may be -0.
    pub(crate) fn real(self) -> (f64, bool, bool) {
        match self {
            Self::Int(low, high) => {
                (low.unsigned_abs().max(high.unsigned_abs()) as f64, false, false)
            }
            Self::Real { most, nan, minus_zero } => (most, nan, minus_zero),
            Self::Truth => (1.0, false, false),
        }
    }

    /// The bounds of the magnitude of an integer from `low` to `high`.
    pub(crate) fn magnitude(low: i64, high: i64) -> Self {
        let most = low.abs().max(high.abs());
        let least = if low <= 0 && high >= 0 { 0 } else { low.abs().min(high.abs()) };
        Self::Int(least, most)
    }

    /// The result of unary minus.
    pub(crate) fn negated(self) -> Self {
        match self {
            Self::Int(low, high) => Self::Int(-high, -low),
            Self::Real { most, nan, .. } => Self::Real { most, nan, minus_zero: true },
            Self::Truth => Self::Truth,
        }
    }

    /// The bounds of an operator's result: an integer only if integer arithmetic computes it.
    pub(crate) fn binary(op: Bin, a: Self, b: Self) -> Self {
        if let (Self::Int(a_low, a_high), Self::Int(b_low, b_high)) = (a, b)
            && let Some(result) = integer(op, (a_low, a_high), (b_low, b_high))
        {
            return result;
        }
        let (a_most, a_nan, a_zero) = a.real();
        let (b_most, b_nan, b_zero) = b.real();
        let is_infinite = |most: f64| most == f64::INFINITY;
        let nan = a_nan || b_nan;
        match op {
            Bin::Add | Bin::Sub => Self::Real {
                most: a_most + b_most,
                nan: nan || (is_infinite(a_most) && is_infinite(b_most)),
                minus_zero: a_zero && (op == Bin::Sub || b_zero),
            },
            Bin::Mul => Self::Real {
                // 0 times an infinite bound would be NaN.
                most: if a_most == 0.0 || b_most == 0.0 { f64::INFINITY } else { a_most * b_most },
                nan: nan || is_infinite(a_most) || is_infinite(b_most),
                minus_zero: true,
            },
            Bin::Div => {
                let least = match b {
                    Self::Int(low, high) if low > 0 || high < 0 => 1.0,
                    _ => 0.0,
                };
                let most = if least > 0.0 { a_most } else { f64::INFINITY };
                Self::Real {
                    most,
                    nan: nan || (is_infinite(a_most) && is_infinite(b_most)),
                    minus_zero: true,
                }
            }
            Bin::Mod => Self::Real { most: b_most, nan: false, minus_zero: true },
            Bin::And | Bin::Or | Bin::Xor => {
                Self::Real { most: FIXED as f64, nan: false, minus_zero: false }
            }
        }
    }
}

/// The bounds of an operation on integers; `None` if integer arithmetic does not give its result.
fn integer(op: Bin, a: (i64, i64), b: (i64, i64)) -> Option<Bounds> {
    let (low, high) = match op {
        Bin::Add => (a.0 + b.0, a.1 + b.1),
        Bin::Sub => (a.0 - b.1, a.1 - b.0),
        Bin::Mul => {
            let corners = [(a.0, b.0), (a.0, b.1), (a.1, b.0), (a.1, b.1)];
            let products = corners.map(|(x, y)| i128::from(x) * i128::from(y));
            let low = products.iter().copied().min()?;
            let high = products.iter().copied().max()?;
            (i64::try_from(low).ok()?, i64::try_from(high).ok()?)
        }
        Bin::Mod => {
            // Integers are used for a constant divisor only.
            let x = b.0;
            if b.0 != b.1 || x == 0 {
                return None;
            }
            if x > 0 { (0, x - 1) } else { (x, -x - 1) }
        }
        Bin::And | Bin::Or | Bin::Xor => {
            if [a.0, a.1, b.0, b.1].iter().any(|v| v.abs() >= FIXED) {
                return None;
            }
            let bits = |(low, high): (i64, i64)| {
                64 - (low ^ (low >> 63)).max(high ^ (high >> 63)).leading_zeros()
            };
            let all = (1i64 << bits(a).max(bits(b))) - 1;
            match (op, a.0 >= 0, b.0 >= 0) {
                (Bin::And, true, true) => (0, a.1.min(b.1)),
                (Bin::And, true, false) => (0, a.1),
                (Bin::And, false, true) => (0, b.1),
                (_, true, true) => (0, all),
                _ => (-all - 1, all),
            }
        }
        Bin::Div => return None,
    };
    (low >= -EXACT && high <= EXACT).then_some(Bounds::Int(low, high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use plcc_abi::pmac::expression;

    /// Every pair of integers at the edges of some bounds: the integer result is the double's.
    #[test]
    fn integer_results_are_those_of_doubles() {
        let edges: Vec<i64> = [0, 1, 2, 7, 8, 255, 8_388_607, 16_777_215, 1 << 38, 1 << 52, EXACT]
            .iter()
            .flat_map(|&v| [v - 1, v, v + 1, -v])
            .filter(|v| v.abs() <= EXACT)
            .collect();
        let ops = [Bin::Add, Bin::Sub, Bin::Mul, Bin::Mod, Bin::And, Bin::Or, Bin::Xor];
        for op in ops {
            for &a in &edges {
                for &b in &edges {
                    let Bounds::Int(low, high) =
                        Bounds::binary(op, Bounds::Int(a, a), Bounds::Int(b, b))
                    else {
                        continue;
                    };
                    let exact = match op {
                        Bin::Add => a + b,
                        Bin::Sub => a - b,
                        Bin::Mul => a * b,
                        Bin::Mod if b > 0 => a.rem_euclid(b),
                        Bin::Mod => (a - b).rem_euclid(-2 * b) + b,
                        Bin::And => a & b,
                        Bin::Or => a | b,
                        _ => a ^ b,
                    };
                    assert_eq!(
                        expression::binary(op, a as f64, b as f64) + 0.0,
                        exact as f64,
                        "{a} {op:?} {b}"
                    );
                    assert!((low..=high).contains(&exact), "{a} {op:?} {b}");
                }
            }
        }
    }

    #[test]
    fn bounds_of_a_result_hold_for_all_operands_within_their_bounds() {
        let ranges = [(0, 1), (0, 255), (-128, 127), (-5, 3), (3, 9), (-9, -2)];
        for op in [Bin::Add, Bin::Sub, Bin::Mul, Bin::And, Bin::Or, Bin::Xor] {
            for a in ranges {
                for b in ranges {
                    let bounds = Bounds::binary(op, Bounds::Int(a.0, a.1), Bounds::Int(b.0, b.1));
                    let Bounds::Int(low, high) = bounds else { panic!("{op:?}") };
                    for x in a.0..=a.1 {
                        for y in b.0..=b.1 {
                            let value = expression::binary(op, x as f64, y as f64) as i64;
                            assert!((low..=high).contains(&value), "{x} {op:?} {y}: {value}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn remainders_stay_within_their_bounds() {
        for by in [1, 2, 3, 8, -1, -2, -3, -8] {
            let bounds = Bounds::binary(Bin::Mod, Bounds::Int(-40, 40), Bounds::Int(by, by));
            let Bounds::Int(low, high) = bounds else { panic!("{by}") };
            for x in -40..=40 {
                let value = expression::binary(Bin::Mod, f64::from(x), by as f64) as i64;
                assert!((low..=high).contains(&value), "{x} % {by}: {value}");
            }
        }
    }

    #[test]
    fn fields_stay_within_their_bounds() {
        let words = [0, 1, 0x80_0000, 0x7F_FFFF, 0xFF_FFFF, 0xAA_AAAA, 0x55_5555, 0x99_9999];
        for width in 1..=24u8 {
            for offset in 0..=24 - width {
                for format in [Format::U, Format::S, Format::D, Format::C] {
                    let field = Field { offset, width, format };
                    let Bounds::Int(low, high) = Bounds::field(field) else { panic!("{field:?}") };
                    for word in words {
                        let value = plcc_abi::pmac::fixed::read_field(word, field).into();
                        assert!((low..=high).contains(&value), "{field:?} {word:x}: {value}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_range_of_a_double_says_whether_it_can_be_infinite_or_nan() {
        let sum = Bounds::binary(Bin::Add, Bounds::FINITE, Bounds::constant(1.0));
        assert_eq!(sum.real(), (f64::MAX, false, false));
        assert_eq!(
            Bounds::binary(Bin::Add, Bounds::FINITE, Bounds::FINITE).real().0,
            f64::INFINITY
        );
        assert!(Bounds::binary(Bin::Mul, Bounds::FINITE, Bounds::FINITE).real().2);
        let wide = Bounds::binary(Bin::Mul, Bounds::FINITE, Bounds::FINITE);
        assert!(Bounds::binary(Bin::Sub, wide, wide).real().1);
    }
}
