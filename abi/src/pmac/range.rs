//! Ranges of I-variables.

use serde::{Deserialize, Serialize};

use super::arithmetic::{finite, round};

/// What an I-variable can hold (guide, appendix B).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Range {
    /// Integers from the first to the second, both included; others are rounded and wrap.
    Integer(i64, i64),
    /// Reals from the first to the second, both included; others wrap.
    Real(f64, f64),
}

impl Range {
    /// The value that is stored when `value` is assigned.
    pub fn convert(self, value: f64) -> f64 {
        let value = finite(value);
        match self {
            Self::Integer(low, high) => integer(value, low as f64, high as f64),
            Self::Real(low, high) => {
                if (low..=high).contains(&value) {
                    value
                } else {
                    wrap(value, low, high, high - low)
                }
            }
        }
    }
}

/// A value rounded and taken modulo a range of integers whose ends are included.
pub fn integer(value: f64, low: f64, high: f64) -> f64 {
    let value = round(finite(value));
    if (low..=high).contains(&value) {
        value + 0.0
    } else {
        wrap(value, low, high, high - low + 1.0)
    }
}

/// The value in a range that differs from `value` by a multiple of the range's length. The remainder is
/// exact, so a large value does not lose its low digits on the way.
fn wrap(value: f64, low: f64, high: f64, length: f64) -> f64 {
    let rest = libm::fmod(value, length) + 0.0;
    if rest < low {
        rest + length
    } else if rest > high {
        rest - length
    } else {
        rest
    }
}

#[cfg(test)]
mod tests {
    use super::Range;

    #[test]
    fn values_roll_over() {
        let range = Range::Integer(0, 3);
        for (value, stored) in [(5.0, 1.0), (-1.0, 3.0), (2.5, 3.0), (3.5, 0.0), (1e300, 0.0)] {
            assert_eq!(range.convert(value), stored, "{value}");
        }
        let range = Range::Integer(-8_388_608, 8_388_607);
        assert_eq!(range.convert(8_388_608.0), -8_388_608.0);
        assert_eq!(range.convert(-8_388_609.0), 8_388_607.0);
        assert_eq!(range.convert(1e300), 0.0);
        assert_eq!(range.convert(-1e300), 0.0);
        assert_eq!(range.convert(-16_777_215.0), 1.0);
        assert_eq!(Range::Integer(1, 4).convert(0.0), 4.0);
        let range = Range::Real(-2.0, 2.0);
        assert_eq!(range.convert(2.0), 2.0);
        assert_eq!(range.convert(2.5), -1.5);
        assert_eq!(range.convert(-1e300), 0.0);
        assert_eq!(range.convert(-2.5), 1.5);
        assert_eq!(range.convert(f64::NAN), 0.0);
    }
}
