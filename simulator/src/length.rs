//! Lengths in whole nanometres, and arithmetic on them that neither rounds twice nor overflows.

use plcc_abi::machine::simulator::{Decimal, Units};

/// Nanometres of a millimetre, and parts of a degree of a rotary axis.
const MILLIMETRE: i128 = 1_000_000;
/// Nanometres of an inch.
const INCH: i128 = 25_400_000;

/// How many nanometres a unit has.
pub(crate) fn unit(units: Units) -> i128 {
    match units {
        Units::Inch => INCH,
        Units::Millimetre => MILLIMETRE,
    }
}

/// How many nanometres the unit of an axis has: a rotary one counts degrees as millimetres.
pub(crate) fn unit_of_axis(units: Units, name: Option<char>) -> i128 {
    match name {
        Some('A' | 'B' | 'C') => MILLIMETRE,
        _ => unit(units),
    }
}

/// A number of units as nanometres, rounded half away from zero. Numbers are limited where they are read, so that the
/// product is never too large.
pub(crate) fn nanometres(number: Decimal, unit: i128) -> i128 {
    number.times(unit).unwrap_or(0)
}

/// The largest number of ticks that a time of the table may have.
pub(crate) const MAX_TICKS: u64 = 10_000_000;

/// A time as ticks, rounded up.
pub(crate) fn ticks(time_ns: u64, tick_ns: u64) -> u64 {
    time_ns.div_ceil(tick_ns.max(1)).min(MAX_TICKS)
}

/// `a * b / c`, cut off toward zero, where the product may have more than 128 bits. `b` and `c` are not negative, and
/// `b` is at most `c`.
pub(crate) fn scaled(a: i128, b: i128, c: i128) -> i128 {
    if c <= 0 || b >= c {
        return a;
    }
    if let Some(product) = a.checked_mul(b) {
        return product / c;
    }
    // Schoolbook: a bit of `a` at a time, with the rest of the division kept below `c`.
    let (magnitude, b, c) = (a.unsigned_abs(), b.unsigned_abs(), c.unsigned_abs());
    let (mut quotient, mut rest) = (0_u128, 0_u128);
    for bit in (0..128).rev() {
        quotient = quotient.wrapping_shl(1);
        rest <<= 1;
        if rest >= c {
            (quotient, rest) = (quotient + 1, rest - c);
        }
        if magnitude >> bit & 1 != 0 {
            rest += b;
            if rest >= c {
                (quotient, rest) = (quotient + 1, rest - c);
            }
        }
    }
    let quotient = i128::try_from(quotient).unwrap_or(i128::MAX);
    if a < 0 { -quotient } else { quotient }
}

/// The square root, cut off.
pub(crate) fn root(square: u128) -> i128 {
    square.isqrt() as i128
}

/// Nanometres as counts of an axis, cut off toward zero.
pub(crate) fn counts(nanometres: i128, counts: i64, unit: i128) -> i64 {
    let (product, unit) = (nanometres.saturating_mul(counts.into()), unit.max(1));
    // Each axis asks in each tick, and a division of 64 bits takes a fraction of the time of one of 128.
    if let (Ok(product), Ok(unit)) = (i64::try_from(product), i64::try_from(unit)) {
        return product / unit;
    }
    (product / unit).clamp(i64::MIN.into(), i64::MAX.into()) as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_of_more_than_128_bits_are_divided_exactly() {
        assert_eq!(scaled(7, 3, 4), 5);
        assert_eq!(scaled(-7, 3, 4), -5);
        assert_eq!(scaled(9, 4, 4), 9);
        let large = 5_080_000_000_000_i128;
        let total = large * 6_000_000_000_000;
        assert_eq!(scaled(large, total / 2, total), large / 2);
        assert_eq!(scaled(-large, total / 4, total), -large / 4);
        // Against the short way, where both are possible.
        for (a, b, c) in [(i128::MAX / 8, 3, 8), (i128::MAX / 3, 3, 8)] {
            let exact = a / c * b + a % c * b / c;
            assert_eq!(scaled(a, b, c), exact);
        }
    }

    #[test]
    fn times_are_rounded_up_and_counts_toward_zero() {
        assert_eq!((ticks(40_000_000, 20_000_000), ticks(41_000_000, 20_000_000)), (2, 3));
        assert_eq!(counts(-1_999, 1000, 1_000_000), -1);
        assert_eq!(counts(INCH, 10_000, INCH), 10_000);
        // Products beyond 64 bits.
        assert_eq!(counts(-(3 << 70) - 1, 1024, 1 << 40), -(3 << 40));
        assert_eq!((counts(i128::MAX, 9, 1), counts(i128::MIN, 9, 1)), (i64::MAX, i64::MIN));
    }
}
