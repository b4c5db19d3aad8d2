//! Fixed-point registers: rounding, widths, formats, and the 48-bit float (rulings, Values).

use super::arithmetic::{finite, round};
use super::definition::{Field, Format};

/// Below it, rounding is a conversion to an `i64`.
const SMALL: f64 = 4_611_686_018_427_387_904.0;

/// A value rounded to an integer, as 64 bits of two's complement: exact in its low bits however
/// large it is (1e300 has low bits 0).
#[inline]
pub fn bits(value: f64) -> u64 {
    if value.abs() < SMALL {
        let whole = value as i64;
        let rest = value - whole as f64;
        return (whole + i64::from(rest >= 0.5) - i64::from(rest <= -0.5)) as u64;
    }
    bits_of_large(value)
}

/// The same of a value rounded down.
#[inline]
pub fn floor_bits(value: f64) -> u64 {
    if value.abs() < SMALL {
        let whole = value as i64;
        return (whole - i64::from(value < whole as f64)) as u64;
    }
    bits_of_large(value)
}

fn bits_of_large(value: f64) -> u64 {
    let rounded = round(finite(value));
    if rounded.abs() < 9_223_372_036_854_775_808.0 {
        return (rounded as i64) as u64;
    }
    // At least 2^63: an integer mantissa of 53 bits times a power of two.
    let raw = rounded.to_bits();
    let exponent = ((raw >> 52) & 0x7FF) as u32;
    let mantissa = (raw & ((1 << 52) - 1)) | (1 << 52);
    let magnitude = mantissa.checked_shl(exponent.saturating_sub(1075)).unwrap_or(0);
    if rounded < 0.0 { magnitude.wrapping_neg() } else { magnitude }
}

/// The low bits of a value rounded to an integer, as an index takes them (`P(expr)`): `mask` is
/// one less than the number of variables.
pub fn index(value: f64, mask: u32) -> u32 {
    bits(value) as u32 & mask
}

/// The low `width` bits, sign-extended.
#[inline]
pub fn sign_extend(value: u64, width: u32) -> i64 {
    let shift = 64 - width.clamp(1, 64);
    ((value << shift) as i64) >> shift
}

const fn mask(width: u8) -> u32 {
    if width >= 24 { 0xFF_FFFF } else { (1 << width) - 1 }
}

/// Reads a field of a word.
pub fn read_field(word: u32, field: Field) -> i32 {
    let mask = mask(field.width);
    let bits = (word >> field.offset) & mask;
    match field.format {
        Format::U => bits as i32,
        Format::S => sign_extend(u64::from(bits), u32::from(field.width)) as i32,
        Format::D => from_bcd(bits) as i32,
        Format::C => from_bcd(!bits & mask) as i32,
    }
}

/// The bits that a value has in a format, before they are cut to the field's width.
pub fn field_bits(value: f64, format: Format) -> u32 {
    match format {
        Format::U | Format::S => bits(value) as u32,
        Format::D => to_bcd(value),
        Format::C => !to_bcd(value),
    }
}

/// The word with a field replaced by the low bits of `bits`.
pub fn insert_field(word: u32, field: Field, bits: u32) -> u32 {
    let mask = mask(field.width) << field.offset;
    ((word & !mask) | ((bits << field.offset) & mask)) & 0xFF_FFFF
}

/// Digits above 9 count with their weights.
fn from_bcd(bits: u32) -> u32 {
    (0..6).rev().fold(0, |sum, digit| sum * 10 + ((bits >> (4 * digit)) & 0xF))
}

/// The last six decimal digits of a value rounded to an integer; a negative one counts down from
/// a million, as a counter of six digits does.
pub fn to_bcd(value: f64) -> u32 {
    let rest = libm::fmod(round(finite(value)), 1e6) as i32;
    let mut rest = rest.rem_euclid(1_000_000) as u32;
    let mut bits = 0;
    for digit in 0..6 {
        bits |= (rest % 10) << (4 * digit);
        rest /= 10;
    }
    bits
}

/// A value in the 48-bit floating-point format as its X and Y words: 36 bits of two's complement
/// mantissa of magnitude 0.5 to 1 over 12 bits of exponent with the bias $800.
pub fn to_float48(value: f64) -> (u32, u32) {
    let value = finite(value);
    if value == 0.0 {
        return (0, 0);
    }
    let raw = value.to_bits();
    let (mut mantissa, mut exponent) = match ((raw >> 52) & 0x7FF) as i32 {
        0 => {
            let (fraction, exponent) = libm::frexp(value);
            (round(fraction * 34_359_738_368.0) as i64, exponent)
        }
        // The 53 bits of the double's mantissa rounded to 35, ties away from zero.
        exponent => {
            let magnitude = (raw & ((1 << 52) - 1)) | (1 << 52);
            let magnitude = ((magnitude + (1 << 17)) >> 18) as i64;
            (if value < 0.0 { -magnitude } else { magnitude }, exponent - 1022)
        }
    };
    if mantissa.unsigned_abs() == 1 << 35 {
        mantissa /= 2;
        exponent += 1;
    }
    let word = ((mantissa as u64) << 12) | (exponent + 0x800) as u64 & 0xFFF;
    ((word >> 24) as u32 & 0xFF_FFFF, word as u32 & 0xFF_FFFF)
}

/// The value of two words in the 48-bit floating-point format; any bits have one.
#[inline]
pub fn from_float48(x: u32, y: u32) -> f64 {
    let word = u64::from(x & 0xFF_FFFF) << 24 | u64::from(y & 0xFF_FFFF);
    let mantissa = sign_extend(word >> 12, 36);
    let exponent = (word & 0xFFF) as i32 - 0x800 - 35;
    // Where neither the power of two nor the product leaves the normal numbers, that is exact.
    if exponent.abs() < 960 {
        return mantissa as f64 * f64::from_bits(((exponent + 1023) as u64) << 52);
    }
    finite(libm::scalbn(mantissa as f64, exponent))
}

/// The nearest finite single's bits, never of -0.
pub fn to_single(value: f64) -> u32 {
    let single = (finite(value) as f32).clamp(f32::MIN, f32::MAX);
    if single == 0.0 { 0 } else { single.to_bits() }
}

/// The value of a single's bits, made finite.
pub fn from_single(bits: u32) -> f64 {
    finite(f64::from(f32::from_bits(bits)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_low_bits_of_a_number_are_exact() {
        for (value, expected) in [
            (0.5, 1),
            (-0.5, u64::MAX),
            (1.49999, 1),
            (-2.5, 3_u64.wrapping_neg()),
            (1e300, 0),
            (-1e300, 0),
            (f64::NAN, 0),
            (f64::INFINITY, 0),
            (f64::NEG_INFINITY, 0),
            (18_446_744_073_709_551_616.0, 0),
            (-18_446_744_073_709_551_616.0, 0),
            (9_223_372_036_854_775_808.0, 1 << 63),
            (9_223_372_036_854_777_856.0, (1 << 63) + 2048),
            (-9_223_372_036_854_777_856.0, ((1_u64 << 63) + 2048).wrapping_neg()),
            (36_893_488_147_419_111_424.0, 8192),
        ] {
            assert_eq!(bits(value), expected, "{value}");
        }
        assert_eq!(index(-1.0, 1023), 1023);
        assert_eq!(index(1024.5, 1023), 1);
        assert_eq!(index(f64::NAN, 1023), 0);
    }

    fn field(offset: u8, width: u8, format: Format) -> Field {
        Field { offset, width, format }
    }

    #[test]
    fn formats_read_as_the_guide_says() {
        assert_eq!(read_field(0x80_0000, field(0, 24, Format::U)), 0x80_0000);
        assert_eq!(read_field(0x80_0000, field(0, 24, Format::S)), -0x80_0000);
        assert_eq!(read_field(0x00_0F00, field(8, 4, Format::S)), -1);
        assert_eq!(read_field(0x00_0F00, field(8, 4, Format::U)), 15);
        assert_eq!(read_field(0x00_0001, field(0, 1, Format::S)), -1);
        assert_eq!(read_field(0x00_0001, field(0, 1, Format::U)), 1);
        assert_eq!(read_field(0x12_3456, field(0, 24, Format::D)), 123_456);
        assert_eq!(read_field(0x12_3456, field(4, 8, Format::D)), 45);
        assert_eq!(read_field(0x00_00FC, field(0, 8, Format::D)), 162);
        assert_eq!(read_field(0xFF_FFFF, field(16, 4, Format::C)), 0);
        assert_eq!(read_field(0xF8_FFFF, field(16, 4, Format::C)), 7);
    }

    #[test]
    fn writing_keeps_the_low_bits_and_the_other_fields() {
        let write =
            |value, word, field: Field| insert_field(word, field, field_bits(value, field.format));
        assert_eq!(write(1.0, 0, field(8, 1, Format::U)), 0x100);
        assert_eq!(write(2.0, 0xFF_FFFF, field(8, 1, Format::U)), 0xFF_FEFF);
        assert_eq!(write(-1.0, 0, field(0, 24, Format::S)), 0xFF_FFFF);
        assert_eq!(write(16_777_217.0, 0, field(0, 24, Format::U)), 1);
        assert_eq!(write(0.5, 0, field(0, 24, Format::U)), 1);
        assert_eq!(write(1e300, 0xFF_FFFF, field(0, 24, Format::U)), 0);
        assert_eq!(write(98.0, 0, field(8, 8, Format::D)), 0x9800);
        assert_eq!(write(1234.0, 0, field(0, 8, Format::D)), 0x34);
        assert_eq!(write(-1.0, 0, field(0, 8, Format::D)), 0x99);
        assert_eq!(write(1e300, 0, field(0, 24, Format::D)), to_bcd(1e300));
        assert_eq!(write(7.0, 0, field(16, 4, Format::C)), 0x08_0000);
    }

    #[test]
    fn complemented_digits_read_back() {
        for value in 0..10_000 {
            let field = field(4, 16, Format::C);
            let word = insert_field(0, field, field_bits(f64::from(value), field.format));
            assert_eq!(read_field(word, field), value);
        }
    }

    #[test]
    fn numbers_have_the_documented_48_bit_words() {
        for (value, words) in [
            (1.0, (0x40_0000, 0x801)),
            (-1.0, (0xC0_0000, 0x801)),
            (10.0, (0x50_0000, 0x804)),
            (0.0, (0, 0)),
            (-0.0, (0, 0)),
            (0.5, (0x40_0000, 0x800)),
            (-2.0, (0xC0_0000, 0x802)),
        ] {
            assert_eq!(to_float48(value), words, "{value}");
            assert_eq!(from_float48(words.0, words.1), value);
        }
        // 36 bits hold 35 of magnitude; one more rounds away from zero.
        let odd = 34_359_738_369.0;
        assert_eq!(to_float48(odd).1 & 0xFFF, 0x824);
        let (x, y) = to_float48(odd);
        assert_eq!(from_float48(x, y), 34_359_738_370.0);
        let (x, y) = to_float48(-odd);
        assert_eq!(from_float48(x, y), -34_359_738_370.0);
        // All ones round up to the next power of two.
        assert_eq!(to_float48(1.0 - f64::EPSILON), (0x40_0000, 0x801));
        let (x, y) = to_float48(f64::MAX);
        assert_eq!(from_float48(x, y), f64::MAX);
        let (x, y) = to_float48(5e-324);
        assert_eq!(from_float48(x, y), 5e-324);
        assert_eq!(from_float48(0x7F_FFFF, 0xFFF), f64::MAX);
        assert_eq!(from_float48(0x80_0000, 0xFFF), -f64::MAX);
        assert_eq!(from_float48(0xFF_FFFF, 0xFFF_000).to_bits(), 0_f64.to_bits());
    }

    /// The 48-bit words of a value, step by step.
    fn plain_float48(value: f64) -> (i64, i32) {
        let (fraction, exponent) = libm::frexp(value);
        let mantissa = round(fraction * 34_359_738_368.0) as i64;
        if mantissa.abs() == 1 << 35 { (mantissa / 2, exponent + 1) } else { (mantissa, exponent) }
    }

    #[test]
    fn short_ways_give_what_the_long_ones_give() {
        let mut rng = plcc_random::Rng::new(1);
        for _ in 0..200_000 {
            let any = f64::from_bits(rng.bits());
            // A number with few bits after the point, at which rounding matters, and its neighbours.
            let near = (rng.bits() as i64 >> rng.below(64)) as f64 / f64::from(1 << rng.below(12));
            let next = f64::from_bits(near.to_bits() + 1);
            for value in [any, near, next, -next] {
                assert_eq!(bits(value), bits_of_large(value), "{value:e}");
                assert_eq!(floor_bits(value), bits_of_large(libm::floor(value)), "{value:e}");
                if !value.is_finite() || value == 0.0 {
                    continue;
                }
                let (x, y) = to_float48(value);
                let (mantissa, exponent) = plain_float48(value);
                let word = u64::from(x) << 24 | u64::from(y);
                let read = (sign_extend(word >> 12, 36), (word & 0xFFF) as i32 - 0x800);
                assert_eq!(read, (mantissa, exponent), "{value:e}");
            }
            let (x, y) = (rng.bits() as u32 & 0xFF_FFFF, rng.bits() as u32 & 0xFF_FFFF);
            let word = u64::from(x) << 24 | u64::from(y);
            let exponent = (word & 0xFFF) as i32 - 0x800 - 35;
            let plain = finite(libm::scalbn(sign_extend(word >> 12, 36) as f64, exponent));
            assert_eq!(from_float48(x, y).to_bits(), plain.to_bits(), "{x:x} {y:x}");
        }
    }

    #[test]
    fn single_precision_is_the_nearest_finite_number() {
        assert_eq!(to_single(1.0), 0x3F80_0000);
        assert_eq!(to_single(0.1), 0.1_f32.to_bits());
        assert_eq!(to_single(1e300), f32::MAX.to_bits());
        assert_eq!(to_single(-1e-300), 0);
        assert_eq!(from_single(0x7F80_0000), f64::MAX);
        assert_eq!(from_single(0x7FC0_0000), 0.0);
        assert_eq!(from_single(0x8000_0000).to_bits(), 0);
    }
}
