//! What operators, functions and comparators give, as the statement interpreter computes it.
//!
//! Written from the guide's Mathematical Features and the rulings. The lowering has its own, and so have the values
//! that are computed at load and by the host ([`plcc_abi::pmac::expression`]), so that tests compare them. All of
//! them take what is not plain IEEE arithmetic from one library in `plcc-abi`, which the rulings pin.

use plcc_abi::pmac::arithmetic;

use crate::pmac::ast::{Bin, Cmp, Func};

/// What an operator gives for two numbers. A division by zero gives the largest double or 0; no
/// other result is made finite before it is stored.
#[inline]
pub(super) fn binary(op: Bin, left: f64, right: f64) -> f64 {
    match op {
        Bin::Add => left + right,
        Bin::Sub => left - right,
        Bin::Mul => left * right,
        Bin::Div if right != 0.0 => left / right,
        Bin::Div => arithmetic::div(left, right),
        Bin::Mod | Bin::And | Bin::Or | Bin::Xor => {
            // Converting to integers and back shows whether both are such: most are, and integers
            // are faster than the fixed-point form.
            let (i, j) = (left as i32, right as i32);
            if f64::from(i) != left || f64::from(j) != right {
                return fractional(op, left, right);
            }
            match op {
                Bin::And => f64::from(i & j),
                Bin::Or => f64::from(i | j),
                Bin::Xor => f64::from(i ^ j),
                _ if j > 0 => f64::from(i.rem_euclid(j)),
                Bin::Add | Bin::Sub | Bin::Mul | Bin::Div | Bin::Mod => {
                    arithmetic::modulo(left, right)
                }
            }
        }
    }
}

/// A remainder or bit operator of numbers that are not both integers of 32 bits.
#[cold]
fn fractional(op: Bin, left: f64, right: f64) -> f64 {
    match op {
        Bin::And => arithmetic::and(left, right),
        Bin::Or => arithmetic::or(left, right),
        Bin::Xor => arithmetic::xor(left, right),
        Bin::Add | Bin::Sub | Bin::Mul | Bin::Div | Bin::Mod => arithmetic::modulo(left, right),
    }
}

/// What a function returns. `cosine` is Q0 of the addressed coordinate system, which ATAN2 alone
/// reads; angles are in `radians` where I15 is not 0, else in degrees.
pub(super) fn function(func: Func, x: f64, cosine: f64, radians: bool) -> f64 {
    match func {
        Func::Sin => arithmetic::sin(x, radians),
        Func::Cos => arithmetic::cos(x, radians),
        Func::Tan => arithmetic::tan(x, radians),
        Func::Asin => arithmetic::asin(x, radians),
        Func::Acos => arithmetic::acos(x, radians),
        Func::Atan => arithmetic::atan(x, radians),
        Func::Atan2 => arithmetic::atan2(x, cosine, radians),
        Func::Sqrt => arithmetic::sqrt(x),
        Func::Ln => arithmetic::ln(x),
        Func::Exp => arithmetic::exp(x),
        Func::Abs => arithmetic::abs(x),
        Func::Int => arithmetic::int(x),
    }
}

/// Whether a comparator holds. As in IEEE arithmetic NaN is equal to nothing, above nothing and
/// below nothing; those that begin with `!` are the negations of the others.
#[inline]
pub(super) fn compare(cmp: Cmp, left: f64, right: f64) -> bool {
    let (positive, negated) = match cmp {
        Cmp::Eq => (left == right, false),
        Cmp::Ne => (left == right, true),
        Cmp::Gt => (left > right, false),
        Cmp::NotGt => (left > right, true),
        Cmp::Lt => (left < right, false),
        Cmp::NotLt => (left < right, true),
        Cmp::Near => ((left - right).abs() < 1.0, false),
        Cmp::NotNear => ((left - right).abs() < 1.0, true),
    };
    positive != negated
}

/// A truth value as a number: 1 or 0.
pub(super) fn truth(value: bool) -> f64 {
    f64::from(u8::from(value))
}

/// The low 24 bits of an integer, sign-extended: what is left of every result in a statement of
/// L-variables.
pub(super) fn wrap(value: i32) -> i32 {
    value << 8 >> 8
}

/// What an operator gives for two integers in a statement of L-variables.
pub(super) fn integer_binary(op: Bin, left: i32, right: i32) -> i32 {
    match op {
        Bin::Add => wrap(left.wrapping_add(right)),
        Bin::Sub => wrap(left.wrapping_sub(right)),
        Bin::Mul => wrap(left.wrapping_mul(right)),
        Bin::Div => arithmetic::int_div(left, right),
        Bin::Mod => arithmetic::int_modulo(left, right),
        Bin::And => left & right,
        Bin::Or => left | right,
        Bin::Xor => left ^ right,
    }
}

/// A comparator in a statement of L-variables, 1 or 0. Integers less than one apart are equal.
pub(super) fn integer_compare(cmp: Cmp, left: i32, right: i32) -> i32 {
    i32::from(match cmp {
        Cmp::Eq | Cmp::Near => left == right,
        Cmp::Ne | Cmp::NotNear => left != right,
        Cmp::Gt => left > right,
        Cmp::NotGt => left <= right,
        Cmp::Lt => left < right,
        Cmp::NotLt => left >= right,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_and_fixed_point_give_the_same() {
        let edges = [0.0, 1.0, 2.0, 7.0, 255.0, 8_388_607.0, 2_147_483_647.0, 2_147_483_648.0, 0.5];
        let all: Vec<f64> = edges.iter().flat_map(|v| [*v, -v]).collect();
        for &a in &all {
            for &b in &all {
                for op in [Bin::And, Bin::Or, Bin::Xor, Bin::Mod] {
                    assert_eq!(binary(op, a, b), fractional(op, a, b), "{a} {op:?} {b}");
                }
            }
        }
    }

    #[test]
    fn division_by_zero_is_the_largest_number() {
        assert_eq!(binary(Bin::Div, 3.0, 0.0), f64::MAX);
        assert_eq!(binary(Bin::Div, -3.0, 0.0), -f64::MAX);
        assert_eq!(binary(Bin::Div, 0.0, 0.0), 0.0);
        assert_eq!(binary(Bin::Div, 3.0, -0.0), f64::MAX);
    }

    #[test]
    fn only_negated_comparisons_hold_for_nan() {
        for cmp in [Cmp::Eq, Cmp::Gt, Cmp::Lt, Cmp::Near] {
            assert!(!compare(cmp, f64::NAN, 1.0), "{cmp:?}");
        }
        for cmp in [Cmp::Ne, Cmp::NotGt, Cmp::NotLt, Cmp::NotNear] {
            assert!(compare(cmp, f64::NAN, 1.0), "{cmp:?}");
        }
    }

    #[test]
    fn integers_wrap_at_24_bits() {
        assert_eq!(integer_binary(Bin::Add, 8_388_607, 1), -8_388_608);
        assert_eq!(integer_binary(Bin::Div, -7, 2), -3);
        assert_eq!(integer_binary(Bin::Div, 7, 0), 0);
        assert_eq!(integer_binary(Bin::Mod, 7, -3), 1);
    }
}
