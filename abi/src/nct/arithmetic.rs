//! NCT's arithmetic on local variables: ADD, SUB, MUL, DIV and CMP on signed numbers of 1, 2 or 4
//! bytes (NCT 4.16), and numbers in BCD (NCT 4.9).

/// A statement that computes with two operands, A and B.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// ADD: C is A + B.
    Add,
    /// SUB: C is A - B.
    Sub,
    /// MUL: C, of twice the bytes, is A · B.
    Mul,
    /// DIV: C is the quotient A / B, where A has twice the bytes; the remainder is right after.
    Div,
    /// CMP: sets flags as SUB does, and has no C.
    Cmp,
}

/// What a statement with two operands gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Computed {
    /// What goes to C, as many of its low bytes as [`Operation::result_size`] says.
    pub result: i64,
    /// Flag F0046: the result is 0.
    pub zero: bool,
    /// Flag F0047: the result is negative.
    pub sign: bool,
    /// Flag F0053: the result does not fit the format. DIV leaves the flag as it is.
    pub overflow: Option<bool>,
}

impl Operation {
    /// Bytes of A, of numbers whose format has `size` bytes.
    pub fn first_operand_size(self, size: u16) -> u16 {
        match self {
            Self::Div => size * 2,
            Self::Add | Self::Sub | Self::Mul | Self::Cmp => size,
        }
    }

    /// Bytes of C, of numbers whose format has `size` bytes; `None` for CMP, which has no C.
    pub fn result_size(self, size: u16) -> Option<u16> {
        match self {
            Self::Add | Self::Sub => Some(size),
            Self::Mul | Self::Div => Some(size * 2),
            Self::Cmp => None,
        }
    }

    /// What it gives for A and B, numbers of a format of `size` bytes (1, 2 or 4; DIV's A has twice
    /// as many). `None` for a division by 0.
    pub fn compute(self, a: i64, b: i64, size: u16) -> Option<Computed> {
        let flags_of = |shown: i64, overflow: Option<bool>, result: i64| Computed {
            result,
            zero: shown == 0,
            sign: shown < 0,
            overflow,
        };
        let overflow = |exact: i64| Some(exact != sign_extend(exact, size));
        Some(match self {
            Self::Add | Self::Sub => {
                let exact = if self == Self::Add { a.wrapping_add(b) } else { a.wrapping_sub(b) };
                flags_of(sign_extend(exact, size), overflow(exact), exact)
            }
            Self::Cmp => {
                let exact = a.wrapping_sub(b);
                flags_of(exact, overflow(exact), exact)
            }
            Self::Mul => {
                let exact = a.wrapping_mul(b);
                flags_of(exact, overflow(exact), exact)
            }
            Self::Div => {
                if b == 0 {
                    return None;
                }
                let (quotient, remainder) = (a.wrapping_div(b), a.wrapping_rem(b));
                let bits = u32::from(size) * 8;
                let low = quotient & 1_i64.wrapping_shl(bits).wrapping_sub(1);
                let result = remainder.wrapping_shl(bits) | low;
                flags_of(sign_extend(quotient, size), None, result)
            }
        })
    }
}

/// The low `size` bytes of a value as a signed number; all of it from 8 bytes on.
pub fn sign_extend(value: i64, size: u16) -> i64 {
    let unused = 64_u32.saturating_sub(u32::from(size) * 8);
    value.wrapping_shl(unused).wrapping_shr(unused)
}

/// The value of four decimal digits; `None` where one is above 9.
pub fn from_bcd(word: u16) -> Option<u16> {
    let mut value = 0;
    for shift in [12, 8, 4, 0] {
        let digit = word >> shift & 0xF;
        if digit > 9 {
            return None;
        }
        value = value * 10 + digit;
    }
    Some(value)
}

/// Four decimal digits of a value up to 9999; of a greater one the lowest four.
pub fn to_bcd(value: u16) -> u16 {
    let digit = |weight: u16| value / weight % 10;
    digit(1000) << 12 | digit(100) << 8 | digit(10) << 4 | digit(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_that_does_not_fit_its_format_overflows() {
        for (operation, a, b, size, result, zero, sign, overflow) in [
            (Operation::Add, 100, 27, 1, 127, false, false, false),
            (Operation::Add, 100, 28, 1, 128, false, true, true),
            (Operation::Sub, -32_768, 1, 2, -32_769, false, false, true),
            (Operation::Sub, 5, 5, 4, 0, true, false, false),
            (Operation::Mul, -128, -128, 1, 16_384, false, false, true),
            (Operation::Mul, -3, 4, 2, -12, false, true, false),
        ] {
            let overflow = Some(overflow);
            let computed = Some(Computed { result, zero, sign, overflow });
            assert_eq!(operation.compute(a, b, size), computed, "{operation:?} {a} {b}");
        }
    }

    #[test]
    fn a_comparison_shows_the_sign_of_the_exact_difference() {
        let computed = Operation::Cmp.compute(-128, 127, 1).unwrap();
        assert!(computed.sign);
        assert_eq!(computed.overflow, Some(true));
        assert!(Operation::Cmp.compute(7, 7, 1).unwrap().zero);
    }

    #[test]
    fn a_division_puts_the_remainder_behind_the_quotient() {
        let divide = |a, b, size| {
            let computed = Operation::Div.compute(a, b, size)?;
            assert_eq!(computed.overflow, None);
            let bits = u32::from(size) * 8;
            let remainder = sign_extend(computed.result >> bits, size);
            Some((sign_extend(computed.result, size), remainder, computed.zero, computed.sign))
        };
        assert_eq!(divide(-7, 2, 1), Some((-3, -1, false, true)));
        assert_eq!(divide(7, -2, 2), Some((-3, 1, false, true)));
        assert_eq!(divide(1, 2, 4), Some((0, 1, true, false)));
        assert_eq!(divide(i64::MIN, -1, 4), Some((0, 0, true, false)));
        assert_eq!(divide(1, 0, 4), None);
    }

    #[test]
    fn every_number_of_four_digits_comes_back_from_bcd() {
        for value in 0..=9999 {
            assert_eq!(from_bcd(to_bcd(value)), Some(value));
        }
        assert_eq!(from_bcd(0x1234), Some(1234));
        for word in [0xA000, 0x0A00, 0x00A0, 0x000A] {
            assert_eq!(from_bcd(word), None);
        }
    }
}
