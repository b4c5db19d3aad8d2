//! Decimal numbers of the table and of part programs, which are never floating point.

use alloc::string::String;

/// A number as its decimal digits say it: `digits` divided by ten to the power of `scale`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decimal {
    digits: i128,
    scale: u32,
}

/// The most digits that a number may have, and the largest exponent.
const MOST: usize = 24;

impl Decimal {
    /// A whole number.
    pub const fn whole(number: i128) -> Self {
        Self { digits: number, scale: 0 }
    }

    /// Reads `-12.5`, `+3`, `.5`, `7.` and, as TOML writes them, `1_000` and `1e3`. `None` for anything else, and for
    /// numbers with more than 24 digits.
    pub fn parse(text: &str) -> Option<Self> {
        let text: String = text.chars().filter(|c| *c != '_').collect();
        let (text, exponent) = match text.split_once(['e', 'E']) {
            Some((number, exponent)) => (number, exponent.parse::<i32>().ok()?),
            None => (text.as_str(), 0),
        };
        let negative = text.starts_with('-');
        let unsigned = text.strip_prefix(['-', '+']).unwrap_or(text);
        let (whole, fraction) = unsigned.split_once('.').unwrap_or((unsigned, ""));
        let is_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
        let length = whole.len() + fraction.len();
        if length == 0 || length > MOST || !is_digits(whole) || !is_digits(fraction) {
            return None;
        }
        let mut digits: i128 = 0;
        for byte in whole.bytes().chain(fraction.bytes()) {
            digits = digits * 10 + i128::from(byte - b'0');
        }
        let mut scale = i32::try_from(fraction.len()).ok()? - exponent;
        if scale.unsigned_abs() as usize > MOST {
            return None;
        }
        while scale < 0 {
            digits = digits.checked_mul(10).filter(|digits| *digits < 10_i128.pow(MOST as u32))?;
            scale += 1;
        }
        Some(Self { digits: if negative { -digits } else { digits }, scale: scale.unsigned_abs() })
    }

    /// The number times `factor` as a whole number, rounded half away from zero. `None` where it is too large.
    pub fn times(self, factor: i128) -> Option<i128> {
        let product = self.digits.checked_mul(factor)?;
        let divisor = 10_i128.checked_pow(self.scale)?;
        let (whole, rest) = (product / divisor, product % divisor);
        let up = rest.unsigned_abs() * 2 >= divisor.unsigned_abs();
        Some(if up { whole + product.signum() } else { whole })
    }

    /// The number, if it is whole; `2.0` is.
    pub fn integer(self) -> Option<i128> {
        let divisor = 10_i128.checked_pow(self.scale)?;
        (self.digits % divisor == 0).then_some(self.digits / divisor)
    }

    /// Whether it is below 0.
    pub fn is_negative(self) -> bool {
        self.digits < 0
    }

    /// Whether it is 0.
    pub fn is_zero(self) -> bool {
        self.digits == 0
    }
}

#[cfg(test)]
mod tests {
    use super::Decimal;

    #[test]
    fn numbers_are_taken_from_their_digits_and_rounded_half_away_from_zero() {
        let times = |text: &str, factor| Decimal::parse(text).unwrap().times(factor);
        assert_eq!(times("0.1", 1_000_000), Some(100_000));
        assert_eq!(times("-1.5", 1), Some(-2));
        assert_eq!(times("2.5", 1), Some(3));
        assert_eq!(times(".000001", 25_400_000), Some(25));
        assert_eq!(times("0.00000005", 10_000_000), Some(1));
        assert_eq!(times("1e3", 1), Some(1000));
        assert_eq!(times("1_000.", 2), Some(2000));
        assert_eq!(Decimal::parse("-3.0").unwrap().integer(), Some(-3));
        assert_eq!(Decimal::parse("3.1").unwrap().integer(), None);
    }

    #[test]
    fn what_is_no_number_is_none() {
        for text in ["", ".", "-", "1.2.3", "inf", "nan", "1e99", "x", "1234567890123456789012345"]
        {
            assert_eq!(Decimal::parse(text), None, "{text}");
        }
    }
}
