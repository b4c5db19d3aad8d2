//! The arithmetic's results at its edges, and that nothing stored is NaN, infinite or -0.

use super::*;

const MAX: f64 = f64::MAX;
const INF: f64 = f64::INFINITY;
const NAN: f64 = f64::NAN;

#[test]
fn stores_are_finite_and_never_minus_zero() {
    assert_eq!(finite(NAN), 0.0);
    assert_eq!(finite(INF), MAX);
    assert_eq!(finite(-INF), -MAX);
    assert_eq!(finite(-0.0).to_bits(), 0);
    assert_eq!(finite(-5e-324), -5e-324);
}

#[test]
fn ties_round_away_from_zero() {
    for (value, expected) in [
        (0.5, 1.0),
        (-0.5, -1.0),
        (2.5, 3.0),
        (-2.5, -3.0),
        (0.499_999_999_999_999_94, 0.0),
        (4_503_599_627_370_497.0, 4_503_599_627_370_497.0),
        (4_503_599_627_370_495.5, 4_503_599_627_370_496.0),
        (1e300, 1e300),
    ] {
        assert_eq!(round(value), expected, "{value}");
    }
}

#[test]
fn division_by_zero_has_the_dividends_sign() {
    assert_eq!(div(1.0, 0.0), MAX);
    assert_eq!(div(1.0, -0.0), MAX);
    assert_eq!(div(-1e-300, 0.0), -MAX);
    assert_eq!(div(0.0, 0.0), 0.0);
    assert_eq!(div(NAN, 0.0), 0.0);
    assert_eq!(div(7.0, 2.0), 3.5);
}

#[test]
fn modulo_stays_in_range() {
    for (a, x, expected) in [
        (7.0, 3.0, 1.0),
        (-7.0, 3.0, 2.0),
        (-6.0, 3.0, 0.0),
        (7.0, -3.0, 1.0),
        (4.0, -3.0, -2.0),
        (3.0, -3.0, -3.0),
        (-3.0, -3.0, -3.0),
        (-4.0, -3.0, 2.0),
        (2.5, 1.0, 0.5),
        (-1e-300, 360.0, 0.0),
        (5.0, 0.0, 0.0),
        (INF, 3.0, 0.0),
        (3.0, INF, 0.0),
        (NAN, 3.0, 0.0),
        (MAX, -MAX, -MAX),
        (-MAX, -MAX, -MAX),
        (1e308, -MAX, 1e308),
        (1e300, 7.0, libm::fmod(1e300, 7.0)),
    ] {
        let result = modulo(a, x);
        assert_eq!(result, expected, "{a} % {x}");
        assert!(!(result == 0.0 && result.is_sign_negative()), "{a} % {x} is -0");
    }
    let samples =
        [0.1, 1.0, -1.0, 3.7, -3.7, 1e-10, -1e-10, 1e10, -1e17, 5e-324, -5e-324, 1e300, -MAX];
    for a in samples {
        for x in samples {
            let result = modulo(a, x);
            if x > 0.0 {
                assert!((0.0..x).contains(&result), "{a} % {x} = {result}");
            } else {
                assert!((x..-x).contains(&result), "{a} % {x} = {result}");
            }
        }
    }
}

#[test]
fn bit_operators_work_on_fractions_too() {
    assert_eq!(and(6.0, 3.0), 2.0);
    assert_eq!(or(6.0, 3.0), 7.0);
    assert_eq!(xor(6.0, 3.0), 5.0);
    assert_eq!(and(1.75, 0.5), 0.5);
    assert_eq!(and(-1.0, 255.0), 255.0);
    assert_eq!(or(-1.0, 255.0), -1.0);
    assert_eq!(xor(-1.0, 0.0), -1.0);
    assert_eq!(and(0.0, NAN), 0.0);
    // 2^-25 is a tie and rounds to one unit.
    assert_eq!(or(0.0, 2.0_f64.powi(-25)), 2.0_f64.powi(-24));
    assert_eq!(or(0.0, -2.0_f64.powi(-25)), -2.0_f64.powi(-24));
    assert_eq!(or(1e300, 0.0), 2.0_f64.powi(39));
    assert_eq!(or(-INF, 0.0), -2.0_f64.powi(39));
    assert_eq!(and(INF, 1.0), 1.0);
}

#[test]
fn near_holds_for_a_difference_below_one() {
    assert!(near(1.0, 1.999));
    assert!(!near(1.0, 2.0));
    assert!(!near(INF, INF));
}

#[test]
fn integers_wrap_at_24_bits() {
    assert_eq!(wrap24(0x7F_FFFF + 1), -0x80_0000);
    assert_eq!(wrap24(-0x80_0001), 0x7F_FFFF);
    assert_eq!(int_div(-7, 2), -3);
    assert_eq!(int_div(7, 0), 0);
    assert_eq!(int_div(-0x80_0000, -1), -0x80_0000);
    for a in -20..20 {
        for x in -7..7 {
            assert_eq!(
                f64::from(int_modulo(a, x)),
                modulo(f64::from(a), f64::from(x)),
                "{a} % {x}"
            );
        }
    }
}

#[test]
fn functions_are_finite_everywhere() {
    assert_eq!(sqrt(-1.0), 0.0);
    assert_eq!(sqrt(INF), MAX);
    assert_eq!(ln(0.0), 0.0);
    assert_eq!(ln(-1.0), 0.0);
    assert_eq!(ln(NAN), 0.0);
    assert_eq!(exp(1000.0), MAX);
    assert_eq!(exp(-1000.0), 0.0);
    assert_eq!(sin(-1e-300, false), -1e-300 * RADIAN_HI);
    assert_eq!(tan(-45.0, false), -1.0);
    assert_eq!(tan(-90.0, false), MAX);
    assert_eq!(asin(1.5, false), 0.0);
    assert_eq!(acos(-1.5, true), 0.0);
    assert_eq!(int(2.5), 2.0);
    assert_eq!(int(-2.5), -3.0);
    assert_eq!(abs(-INF), MAX);
    for rad in [false, true] {
        for value in [NAN, INF, -INF, MAX, -MAX, 1e22, 5e-324, 0.0, -0.0] {
            for function in [sin, cos, tan, asin, acos, atan] {
                assert!(function(value, rad).is_finite(), "{value}");
            }
            for cosine in [NAN, INF, -INF, 0.0, -0.0, 1.0] {
                assert!(atan2(value, cosine, rad).is_finite());
            }
            for function in [sqrt, ln, exp, int, abs] {
                assert!(function(value).is_finite());
            }
        }
    }
}

#[test]
fn degrees_are_exact_where_the_result_is() {
    for turn in [-720.0, -360.0, 0.0, 360.0, 3_600_000.0] {
        for (angle, sine, cosine) in
            [(0.0, 0.0, 1.0), (90.0, 1.0, 0.0), (180.0, 0.0, -1.0), (270.0, -1.0, 0.0)]
        {
            assert_eq!(sin(turn + angle, false), sine, "{angle}");
            assert_eq!(cos(turn + angle, false), cosine, "{angle}");
        }
        for (angle, sine) in [(30.0, 0.5), (150.0, 0.5), (210.0, -0.5), (330.0, -0.5)] {
            assert_eq!(sin(turn + angle, false), sine, "{angle}");
            assert_eq!(cos(turn + angle - 90.0, false), sine, "{angle}");
        }
        for (angle, tangent) in [
            (0.0, 0.0),
            (45.0, 1.0),
            (90.0, MAX),
            (135.0, -1.0),
            (180.0, 0.0),
            (225.0, 1.0),
            (270.0, MAX),
            (315.0, -1.0),
        ] {
            assert_eq!(tan(turn + angle, false), tangent, "{angle}");
        }
    }
    for (value, angle) in [(0.0, 0.0), (0.5, 30.0), (1.0, 90.0), (-0.5, -30.0), (-1.0, -90.0)] {
        assert_eq!(asin(value, false), angle);
        assert_eq!(acos(value, false), 90.0 - angle);
    }
    assert_eq!(atan(1.0, false), 45.0);
    assert_eq!(atan(-INF, false), -90.0);
    for (sine, cosine, angle) in [
        (0.0, 1.0, 0.0),
        (1.0, 1.0, 45.0),
        (1.0, 0.0, 90.0),
        (2.0, -2.0, 135.0),
        (0.0, -1.0, 180.0),
        (-0.0, -1.0, 180.0),
        (-1.0, -1.0, -135.0),
        (-3.0, 0.0, -90.0),
        (-1.0, 1.0, -45.0),
        (0.0, 0.0, 0.0),
    ] {
        assert_eq!(atan2(sine, cosine, false), angle, "{sine} {cosine}");
    }
}

#[test]
fn trigonometry_agrees_with_its_identities() {
    for step in 0..3600 {
        let angle = f64::from(step) / 7.0;
        let (sine, cosine) = (sin(angle, false), cos(angle, false));
        assert!((sine * sine + cosine * cosine - 1.0).abs() < 4e-16, "{angle}");
        assert!((sin(-angle, false) + sine).abs() < 1e-14);
        let back = modulo(atan2(sine, cosine, false), 360.0);
        let expected = modulo(angle, 360.0);
        let gap = modulo(back - expected, -180.0);
        assert!(gap.abs() < 1e-13, "{angle}");
        assert!((sin(angle * RADIAN_HI, true) - sine).abs() < 1e-13);
    }
}
