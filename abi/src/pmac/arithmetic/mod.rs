//! PMAC's arithmetic where it is not plain IEEE (rulings, Values).
//!
//! One library for every engine, so that results are the same on every machine: nothing here
//! uses the platform's mathematics.

use core::f64::consts::PI;

/// What a store makes of a value: NaN is 0, an infinity the largest double of its sign, -0 is 0.
#[inline]
pub fn finite(value: f64) -> f64 {
    if value.is_nan() {
        return 0.0;
    }
    value.clamp(-f64::MAX, f64::MAX) + 0.0
}

/// To the nearest integer, ties away from zero.
pub fn round(value: f64) -> f64 {
    let whole = libm::trunc(value);
    if (value - whole).abs() >= 0.5 { whole + libm::copysign(1.0, value) } else { whole }
}

/// `a / b`: by zero the largest double with `a`'s sign, 0 where `a` is 0 too.
pub fn div(a: f64, b: f64) -> f64 {
    if b != 0.0 {
        return a / b;
    }
    if a > 0.0 {
        f64::MAX
    } else if a < 0.0 {
        -f64::MAX
    } else {
        0.0
    }
}

/// `a % x`: for `x > 0` from 0 up to but not `x`, for `x < 0` from `x` up to but not `-x`; 0 for
/// `x = 0` and for what is not finite. Exact but for one rounding, which stays in range.
pub fn modulo(a: f64, x: f64) -> f64 {
    if x == 0.0 || !a.is_finite() || !x.is_finite() {
        return 0.0;
    }
    if x > 0.0 {
        let rest = libm::fmod(a, x);
        let rest = if rest < 0.0 { rest + x } else { rest };
        return if rest >= x { 0.0 } else { rest + 0.0 };
    }
    let y = -x;
    // Twice y may be infinite: then the remainder is `a` itself.
    let rest = libm::fmod(a, 2.0 * y);
    let rest = if rest >= y {
        (rest - y) - y
    } else if rest < x {
        (rest + y) + y
    } else {
        rest
    };
    if rest >= y { x } else { rest + 0.0 }
}

/// The `i32` that a number is, if it is one. All its bits are in the fixed-point form of the bit
/// operators.
#[inline]
pub fn whole(value: f64) -> Option<i32> {
    // The sum with 1.5 times 2^52 has an integer for its low bits.
    let whole = (value + 6_755_399_441_055_744.0).to_bits() as i32;
    (f64::from(whole) == value).then_some(whole)
}

/// Two's complement fixed point with 24 fraction bits, saturated to 64 bits.
pub fn to_fixed(value: f64) -> i64 {
    round(finite(value) * 16_777_216.0) as i64
}

/// Back from [`to_fixed`].
pub fn from_fixed(value: i64) -> f64 {
    value as f64 / 16_777_216.0
}

/// `a & b`.
pub fn and(a: f64, b: f64) -> f64 {
    from_fixed(to_fixed(a) & to_fixed(b))
}

/// `a | b`.
pub fn or(a: f64, b: f64) -> f64 {
    from_fixed(to_fixed(a) | to_fixed(b))
}

/// `a ^ b`.
pub fn xor(a: f64, b: f64) -> f64 {
    from_fixed(to_fixed(a) ^ to_fixed(b))
}

/// `a ~ b`: less than one apart.
pub fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1.0
}

/// An integer operation's result in 24 bits of two's complement.
pub fn wrap24(value: i64) -> i32 {
    ((value << 40) >> 40) as i32
}

/// The integer quotient towards zero, 0 by zero, in 24 bits.
pub fn int_div(a: i32, b: i32) -> i32 {
    wrap24(i64::from(a).checked_div(i64::from(b)).unwrap_or(0))
}

/// The integer form of [`modulo`], in 24 bits.
pub fn int_modulo(a: i32, x: i32) -> i32 {
    let (a, x) = (i64::from(a), i64::from(x));
    wrap24(match x {
        0 => 0,
        1.. => a.rem_euclid(x),
        _ => (a - x).rem_euclid(-2 * x) + x,
    })
}

/// ABS.
pub fn abs(value: f64) -> f64 {
    finite(value.abs())
}

/// INT: the greatest integer not above.
pub fn int(value: f64) -> f64 {
    finite(libm::floor(value))
}

/// SQRT; 0 below 0.
pub fn sqrt(value: f64) -> f64 {
    finite(libm::sqrt(value))
}

/// EXP; the largest double on overflow.
pub fn exp(value: f64) -> f64 {
    finite(libm::exp(value))
}

/// LN; 0 for 0 and below.
pub fn ln(value: f64) -> f64 {
    if value > 0.0 { finite(libm::log(value)) } else { 0.0 }
}

/// pi/180 less its nearest double, and 180/pi less its.
const RADIAN_HI: f64 = PI / 180.0;
const RADIAN_LO: f64 = 2.948_652_270_870_168_6e-19;
const DEGREE_HI: f64 = 180.0 / PI;
const DEGREE_LO: f64 = -1.987_849_567_057_628_5e-15;

/// `a * (hi + lo)` as a sum of two doubles.
fn scale(a: f64, hi: f64, lo: f64) -> (f64, f64) {
    let product = a * hi;
    (product, libm::fma(a, hi, -product) + a * lo)
}

/// Degrees, 0 to 90, to radians in two parts.
fn radians(degrees: f64) -> (f64, f64) {
    scale(degrees, RADIAN_HI, RADIAN_LO)
}

fn degrees(radians: f64) -> f64 {
    let (hi, lo) = scale(radians, DEGREE_HI, DEGREE_LO);
    hi + lo
}

/// The sine of 0 to 45 degrees.
fn sin_first(angle: f64) -> f64 {
    if angle == 30.0 {
        return 0.5;
    }
    let (hi, lo) = radians(angle);
    libm::sin(hi) + lo * libm::cos(hi)
}

/// The cosine of 0 to 45 degrees.
fn cos_first(angle: f64) -> f64 {
    let (hi, lo) = radians(angle);
    libm::cos(hi) - lo * libm::sin(hi)
}

/// The magnitude exactly reduced: how many quarter turns, and the rest of 0 to 90 degrees.
fn quarter(angle: f64) -> (u32, f64) {
    let turn = libm::fmod(angle.abs(), 360.0);
    let count = libm::floor(turn / 90.0).clamp(0.0, 3.0);
    let rest = turn - 90.0 * count;
    // The quotient may have been rounded up to a whole number.
    if rest < 0.0 { (count as u32 - 1, rest + 90.0) } else { (count as u32, rest) }
}

/// The sine of an angle of that many quarter turns and a rest.
fn sin_quarter(count: u32, rest: f64) -> f64 {
    let co = |rest: f64| if rest <= 45.0 { cos_first(rest) } else { sin_first(90.0 - rest) };
    let straight = |rest: f64| if rest <= 45.0 { sin_first(rest) } else { cos_first(90.0 - rest) };
    match count & 3 {
        0 => straight(rest),
        1 => co(rest),
        2 => -straight(rest),
        _ => -co(rest),
    }
}

/// SIN, in degrees unless `rad`.
pub fn sin(value: f64, rad: bool) -> f64 {
    if !value.is_finite() {
        return 0.0;
    }
    if rad {
        return libm::sin(value);
    }
    let (count, rest) = quarter(value);
    let sine = sin_quarter(count, rest);
    (if value < 0.0 { -sine } else { sine }) + 0.0
}

/// COS, in degrees unless `rad`.
pub fn cos(value: f64, rad: bool) -> f64 {
    if !value.is_finite() {
        return 0.0;
    }
    if rad {
        return libm::cos(value);
    }
    let (count, rest) = quarter(value);
    sin_quarter(count + 1, rest) + 0.0
}

/// TAN, in degrees unless `rad`; the largest double at 90 and 270 degrees.
pub fn tan(value: f64, rad: bool) -> f64 {
    if !value.is_finite() {
        return 0.0;
    }
    if rad {
        return finite(libm::tan(value));
    }
    let (count, rest) = quarter(value);
    let odd = count & 1 == 1;
    if rest == 0.0 {
        return if odd { f64::MAX } else { 0.0 };
    }
    // In the second and fourth quarter the tangent is that of the rest to 90 degrees, negative.
    let (angle, sign) = if odd { (90.0 - rest, -1.0) } else { (rest, 1.0) };
    let sign = if value < 0.0 { -sign } else { sign };
    if angle == 45.0 {
        return sign;
    }
    let (hi, lo) = radians(angle);
    let tangent = libm::tan(hi);
    sign * (tangent + lo * (1.0 + tangent * tangent))
}

/// ASIN, in degrees unless `rad`; 0 outside -1 to 1.
pub fn asin(value: f64, rad: bool) -> f64 {
    if value.is_nan() || value.abs() > 1.0 {
        return 0.0;
    }
    if rad {
        return libm::asin(value);
    }
    if value.abs() == 0.5 {
        return 60.0 * value;
    }
    if value.abs() == 1.0 {
        return 90.0 * value;
    }
    degrees(libm::asin(value))
}

/// ACOS, in degrees unless `rad`; 0 outside -1 to 1.
pub fn acos(value: f64, rad: bool) -> f64 {
    if value.is_nan() || value.abs() > 1.0 {
        return 0.0;
    }
    if rad {
        return libm::acos(value);
    }
    if value == 0.0 || value.abs() == 0.5 || value.abs() == 1.0 {
        return 90.0 - asin(value, false);
    }
    degrees(libm::acos(value))
}

/// ATAN, in degrees unless `rad`.
pub fn atan(value: f64, rad: bool) -> f64 {
    if value.is_nan() {
        return 0.0;
    }
    if rad {
        return libm::atan(value);
    }
    if value.abs() == 1.0 {
        return 45.0 * value;
    }
    if value.is_infinite() {
        return libm::copysign(90.0, value);
    }
    degrees(libm::atan(value))
}

/// ATAN2 of a sine and a cosine, from -180 to 180 degrees, or in radians if `rad`.
pub fn atan2(sine: f64, cosine: f64, rad: bool) -> f64 {
    if sine.is_nan() || cosine.is_nan() {
        return 0.0;
    }
    let (sine, cosine) = (sine + 0.0, cosine + 0.0);
    if rad {
        return libm::atan2(sine, cosine);
    }
    let sign = libm::copysign(1.0, sine);
    if sine == 0.0 {
        return if cosine < 0.0 { 180.0 } else { 0.0 };
    }
    if cosine == 0.0 {
        return 90.0 * sign;
    }
    if sine.abs() == cosine.abs() {
        return if cosine < 0.0 { 135.0 * sign } else { 45.0 * sign };
    }
    degrees(libm::atan2(sine, cosine))
}

#[cfg(test)]
mod tests;
