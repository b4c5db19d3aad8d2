//! How numbers are written for people and in traces.

use alloc::{format, string::String};

/// A finite double as ECMAScript's `Number::toString` writes it: the shortest digits that read back as
/// the same number, with an exponent from 1e21 up and below 1e-6. `0` for what is not finite.
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return "0".into();
    }
    // Rust's `{:e}` gives the shortest digits, too. ECMAScript's text differs from it where two decimals
    // are equally short and near, and in the place of the point.
    let text = format!("{:e}", value.abs());
    let text = even_shortest(&text, value.abs()).unwrap_or(text);
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let digits: String = mantissa.chars().filter(char::is_ascii_digit).collect();
    let count = digits.len() as i32;
    let point = exponent + 1;
    let body = if count <= point && point <= 21 {
        format!("{digits}{}", "0".repeat((point - count) as usize))
    } else if 0 < point && point <= 21 {
        let (whole, fraction) = digits.split_at(point as usize);
        format!("{whole}.{fraction}")
    } else if -6 < point && point <= 0 {
        format!("0.{}{digits}", "0".repeat(-point as usize))
    } else {
        let (first, rest) = digits.split_at(1);
        let dot = if rest.is_empty() { "" } else { "." };
        let sign = if exponent < 0 { '-' } else { '+' };
        format!("{first}{dot}{rest}e{sign}{}", exponent.abs())
    };
    if value < 0.0 { format!("-{body}") } else { body }
}

/// The decimal that ECMAScript writes for a positive value whose text by `{:e}` is `text`; `None` if it
/// is `text` itself. They differ where the value lies half-way between two shortest decimals that both
/// read back as it: Rust writes the upper one, ECMAScript the one whose last digit is even.
fn even_shortest(text: &str, value: f64) -> Option<String> {
    let (mantissa, exponent) = text.split_once('e')?;
    let last = mantissa.bytes().last().filter(|digit| digit % 2 == 1)?;
    let kept = mantissa.get(..mantissa.len() - 1)?;
    let lower = format!("{kept}{}", char::from(last - 1));
    let below = format!("{lower}e{exponent}");
    if below.parse() != Ok(value) {
        return None;
    }
    // No double has more significant digits than this, so what is cut off is 0.
    let exact = format!("{value:.767e}");
    let rest = exact.strip_prefix(&lower)?.split_once('e')?.0;
    // A single digit has no point yet.
    let rest = rest.strip_prefix('.').unwrap_or(rest);
    let half = rest.strip_prefix('5').is_some_and(|rest| rest.bytes().all(|digit| digit == b'0'));
    half.then_some(below)
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_are_written_as_ecmascript_does() {
        for (value, text) in [
            (1.0, "1"),
            (-1.5, "-1.5"),
            (0.1, "0.1"),
            (1e20, "100000000000000000000"),
            (1e21, "1e+21"),
            (1.25e21, "1.25e+21"),
            (1e-6, "0.000001"),
            (1e-7, "1e-7"),
            (1.5e-7, "1.5e-7"),
            (123456.789, "123456.789"),
            (f64::MAX, "1.7976931348623157e+308"),
            (5e-324, "5e-324"),
            // Half-way between two shortest decimals, the second one next to a power of two.
            (10.0 / 16_777_216.0, "5.960464477539062e-7"),
            (1.0 / 16_777_216.0, "5.960464477539063e-8"),
            (-5.0 / 16_777_216.0, "-2.980232238769531e-7"),
            (9_007_199_254_740_993.0 / 2.0, "4503599627370496"),
            (-0.0, "0"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
