//! How waveform viewers are shown a variable: as a line, as a bus of its own width, or as a curve.

use plcc_abi::place::{Direction, Place, Type};
use plcc_runtime::{Class, Properties, Value};

/// How many bits an integer has of which it is not known where it lies.
const UNKNOWN_WIDTH: u32 = 64;

/// How a VCD or an FST shows a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WaveformShape {
    /// As a line, which is 1 where the value is not 0.
    Line,
    /// As bits: a group of lines, a byte or a word.
    Bits {
        /// How many, from 1 to 64.
        width: u32,
        /// Whether the highest is a sign.
        signed: bool,
    },
    /// As a number with a fraction.
    Real,
}

impl WaveformShape {
    /// That of a variable, or of each element of an array: as many bits as it has where it lies.
    pub fn of(properties: &Properties) -> Self {
        let bits = |width, signed| Self::Bits { width, signed };
        // The value of a group of inputs is what its lines say; a group of outputs keeps what was assigned.
        let lines = properties.line.filter(|_| properties.direction == Direction::Input);
        let place = lines.or(properties.value).filter(|place| place.ty != Type::Double);
        match (properties.class, place) {
            (Class::Logical, _) => Self::Line,
            (_, Some(Place { ty, width, .. })) => {
                let signed = matches!(ty, Type::Integer | Type::Long | Type::SignedBits);
                bits(u32::from(width).clamp(1, UNKNOWN_WIDTH), signed)
            }
            (Class::Integer, None) => match properties.width {
                Some(width) => bits(u32::from(width).clamp(1, UNKNOWN_WIDTH), false),
                None => bits(UNKNOWN_WIDTH, true),
            },
            (Class::Fraction, None) => Self::Real,
        }
    }

    /// How many bits it has; `None` for a number with a fraction.
    pub fn width(self) -> Option<u32> {
        match self {
            Self::Line => Some(1),
            Self::Bits { width, .. } => Some(width),
            Self::Real => None,
        }
    }

    /// The bits of a value, the lowest one first. `None` where it has no bits, and where they do not hold it: a PMAC's program
    /// can give an M-variable another place while it runs, of another width.
    pub fn bits(self, value: &Value) -> Option<u64> {
        let (width, signed) = match (self, value) {
            (Self::Line, Value::Int(value)) => return Some((*value != 0).into()),
            (Self::Line, Value::Float(value)) => return Some((*value != 0.0).into()),
            (Self::Bits { width, signed }, _) => (width, signed),
            _ => return None,
        };
        let value = match value {
            Value::Int(value) => *value,
            Value::Float(value) if value.fract() == 0.0 && value.abs() < 2_f64.powi(53) => {
                *value as i64
            }
            Value::Float(_) | Value::Array(_) => return None,
        };
        let spare = UNKNOWN_WIDTH - width;
        let held = match signed {
            true => value << spare >> spare,
            false => ((value as u64) << spare >> spare) as i64,
        };
        (held == value).then_some((value as u64) << spare >> spare)
    }

    /// The smallest and the largest integer that the bits hold; `None` for a number with a fraction.
    pub fn range(self) -> Option<(i64, i64)> {
        let (width, signed) = match self {
            Self::Line => (1, false),
            Self::Bits { width, signed } => (width, signed),
            Self::Real => return None,
        };
        let spare = UNKNOWN_WIDTH - width;
        Some(match signed {
            true => (i64::MIN >> spare, i64::MAX >> spare),
            false => (0, i64::try_from(u64::MAX >> spare).unwrap_or(i64::MAX)),
        })
    }

    /// A value as a number with a fraction, as [`Real`](Self::Real) shows it.
    pub fn real(value: &Value) -> f64 {
        value.number().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_the_bits_of_their_width_and_no_others() {
        let word = WaveformShape::Bits { width: 16, signed: true };
        assert_eq!(word.bits(&Value::Int(-2)), Some(0xFFFE));
        assert_eq!(word.bits(&Value::Int(32768)), None);
        assert_eq!(word.range(), Some((-32768, 32767)));
        let digit = WaveformShape::Bits { width: 4, signed: false };
        assert_eq!(digit.bits(&Value::Int(15)), Some(15));
        assert_eq!(digit.bits(&Value::Int(-1)), None);
        assert_eq!(digit.bits(&Value::Int(16)), None);
        assert_eq!(digit.bits(&Value::Float(9.0)), Some(9));
        assert_eq!(digit.bits(&Value::Float(0.5)), None);
        let widest = WaveformShape::Bits { width: 64, signed: true };
        assert_eq!(widest.bits(&Value::Int(-1)), Some(u64::MAX));
        assert_eq!(WaveformShape::Line.bits(&Value::Int(5)), Some(1));
        assert_eq!(WaveformShape::Real.bits(&Value::Float(1.0)), None);
    }
}
