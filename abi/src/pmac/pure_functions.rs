//! The host functions that depend on nothing but their arguments.

use super::expression::{self, Bin};
use super::{arithmetic, fixed, range};
use crate::HostFn;

/// The result of a pure function of PMAC's, `None` for any other: for hosts, and for compilers
/// that fold constants.
pub fn call(function: HostFn, args: [u64; 4]) -> Option<u64> {
    let [a, b, c, _] = args.map(f64::from_bits);
    let rad = args[1] as u32 != 0;
    let value = match function {
        HostFn::PmacMod => expression::binary(Bin::Mod, a, b),
        HostFn::PmacAnd => expression::binary(Bin::And, a, b),
        HostFn::PmacOr => expression::binary(Bin::Or, a, b),
        HostFn::PmacXor => expression::binary(Bin::Xor, a, b),
        HostFn::PmacSin => arithmetic::sin(a, rad),
        HostFn::PmacCos => arithmetic::cos(a, rad),
        HostFn::PmacTan => arithmetic::tan(a, rad),
        HostFn::PmacAsin => arithmetic::asin(a, rad),
        HostFn::PmacAcos => arithmetic::acos(a, rad),
        HostFn::PmacAtan => arithmetic::atan(a, rad),
        HostFn::PmacAtan2 => arithmetic::atan2(a, b, args[2] as u32 != 0),
        HostFn::PmacSqrt => arithmetic::sqrt(a),
        HostFn::PmacLn => arithmetic::ln(a),
        HostFn::PmacExp => arithmetic::exp(a),
        HostFn::PmacRange => range::integer(a, b, c),
        HostFn::PmacBits => return Some(fixed::bits(a)),
        HostFn::PmacBcd => return Some(u64::from(fixed::to_bcd(a))),
        _ => return None,
    };
    Some(value.to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DoubleRange;

    #[test]
    fn every_pure_function_is_answered() {
        let args = [3.5_f64.to_bits(), 0, 0, 0];
        for function in HostFn::ALL {
            let ours = function.name().starts_with("pmac_");
            assert_eq!(call(*function, args).is_some(), ours && function.is_pure(), "{function:?}");
        }
        let half = call(HostFn::PmacSin, [30_f64.to_bits(), 0, 0, 0]);
        assert_eq!(half, Some(0.5_f64.to_bits()));
        let angle = call(HostFn::PmacAtan2, [1_f64.to_bits(), 1_f64.to_bits(), 0, 0]);
        assert_eq!(angle, Some(45_f64.to_bits()));
    }

    /// Also of what is not finite, as operands of native code may be.
    #[test]
    fn results_are_in_the_range_of_their_function() {
        let operands = [
            0.0,
            -0.0,
            0.5,
            1.0,
            -1.0,
            3.0,
            -4.0,
            90.0,
            5e-324,
            1e300,
            -1e300,
            f64::MAX,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NAN,
        ];
        for function in HostFn::ALL.iter().filter(|it| it.double_range() != DoubleRange::Any) {
            for a in operands {
                for b in operands {
                    let args = [a.to_bits(), b.to_bits(), 0, 0];
                    let Some(bits) = call(*function, args) else { continue };
                    let result = f64::from_bits(bits);
                    let is_minus_zero = result == 0.0 && result.is_sign_negative();
                    let may_be = function.double_range() == DoubleRange::FiniteOrMinusZero;
                    assert!(result.is_finite(), "{function:?} {a} {b}: {result}");
                    assert!(may_be || !is_minus_zero, "{function:?} {a} {b}: {result}");
                }
            }
        }
    }
}
