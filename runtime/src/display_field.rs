//! How DISPLAY writes a value.

use plcc_abi::pmac::arithmetic::finite;

/// A value with so many decimals, right-aligned in a field; one that is too long keeps its
/// digits. Rounded half away from zero, never `-0`.
pub(crate) fn field(value: f64, width: u32, decimals: u32) -> String {
    let text = fixed(finite(value), decimals as usize);
    format!("{text:>width$}", width = width.min(255) as usize)
}

/// A finite value with so many decimals.
fn fixed(value: f64, decimals: usize) -> String {
    // Every double ends within 1074 decimals, so this is exact and only ties are left to us.
    let exact = format!("{:.1074}", value.abs());
    let (whole, fraction) = exact.split_once('.').unwrap_or((&exact, ""));
    let decimals = decimals.min(255);
    let (kept, rest) = fraction.split_at_checked(decimals).unwrap_or((fraction, ""));
    let mut digits: Vec<u8> = whole.bytes().chain(kept.bytes()).collect();
    if rest.as_bytes().first().is_some_and(|digit| *digit >= b'5') {
        round_up(&mut digits);
    }
    let point = digits.len() - kept.len();
    let mut text = String::with_capacity(digits.len() + 2);
    if value < 0.0 && digits.iter().any(|digit| *digit != b'0') {
        text.push('-');
    }
    for (at, digit) in digits.iter().enumerate() {
        if at == point {
            text.push('.');
        }
        text.push(char::from(*digit));
    }
    text
}

/// Adds one to the last digit.
fn round_up(digits: &mut Vec<u8>) {
    for digit in digits.iter_mut().rev() {
        if *digit == b'9' {
            *digit = b'0';
        } else {
            *digit += 1;
            return;
        }
    }
    digits.insert(0, b'1');
}

#[cfg(test)]
mod tests {
    use super::field;

    #[test]
    fn values_stand_right_aligned_and_rounded() {
        for (value, width, decimals, text) in [
            (12.345, 8, 2, "   12.35"),
            (0.125, 1, 2, "0.13"),
            (-0.125, 6, 2, " -0.13"),
            (2.675, 0, 2, "2.67"),
            (0.5, 3, 0, "  1"),
            (-0.4, 3, 0, "  0"),
            (-0.004, 5, 2, " 0.00"),
            (999.995, 2, 1, "1000.0"),
            (9.5, 2, 0, "10"),
            (-1234567.0, 4, 0, "-1234567"),
            (1e21, 4, 1, "1000000000000000000000.0"),
            (f64::NAN, 3, 0, "  0"),
        ] {
            assert_eq!(field(value, width, decimals), text, "{value} {width}.{decimals}");
        }
    }
}
