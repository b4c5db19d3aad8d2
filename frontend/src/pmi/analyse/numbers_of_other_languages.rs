//! Numbers as other languages write them, and what PMI has in their place.

use super::other_languages::ErrorSite;
use crate::common::{Explanation, explanation};
use crate::pmi::read::section::Section;

/// The delay of a timer in seconds, or with a unit: PMI counts units of 20 ms.
pub(super) fn delay(site: &ErrorSite<'_, '_>) -> Option<Explanation> {
    if site.section != Some(Section::Timer) || !matches!(site.code, "PMI-5" | "PMI-12" | "PMI-30") {
        return None;
    }
    let written = site.around(|c| c.is_ascii_alphanumeric() || matches!(c, '.' | '#' | '_'));
    let value = written.rsplit('#').next().unwrap_or("");
    let unit = value.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.');
    let number = value.get(..value.len() - unit.len()).unwrap_or("");
    if unit.is_empty() && !number.contains('.') {
        return None;
    }
    let milliseconds_each = match unit.to_ascii_uppercase().as_str() {
        "" | "S" | "SEC" => 1000.0,
        "MS" => 1.0,
        "M" | "MIN" => 60_000.0,
        _ => return None,
    };
    let milliseconds = number.parse::<f64>().ok()? * milliseconds_each;
    let units = milliseconds / 20.0;
    if !(0.0..=32_767.0).contains(&units) {
        return None;
    }
    let rounded = units.round().max(1.0);
    let what = if (rounded - units).abs() < 1e-6 {
        format!("{milliseconds} ms are {rounded} units of 20 ms: write {rounded}")
    } else {
        format!("{milliseconds} ms are {units} units of 20 ms: write {rounded}")
    };
    explanation(format!("`{written}` is not a delay: a delay is a number of units of 20 ms"), what)
}

/// Hexadecimal and binary numbers, numbers with an exponent.
pub(super) fn other_number(site: &ErrorSite<'_, '_>) -> Option<Explanation> {
    if site.code == "PMI-1" {
        return None;
    }
    let written = site.around(|c| c.is_ascii_alphanumeric() || matches!(c, '#' | '$'));
    if let Some(value) = value_of(written) {
        let message = format!("`{written}` is not a number of PMI");
        return explanation(message, format!("numbers are decimal: write {value}"));
    }
    after_hash(site)
}

/// The value of a number that another language wrote.
fn value_of(written: &str) -> Option<i64> {
    let upper = written.to_ascii_uppercase();
    let radix = |digits: &str, radix| i64::from_str_radix(digits, radix).ok();
    if let Some((base, digits)) = upper.rsplit_once('#') {
        return match base.rsplit('#').next()? {
            "16" => radix(digits, 16),
            "8" => radix(digits, 8),
            "2" => radix(digits, 2),
            _ => None,
        };
    }
    if let Some(digits) = upper.strip_prefix("0X").or(upper.strip_prefix('$')) {
        return radix(digits, 16);
    }
    if !upper.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    if let Some(digits) = upper.strip_suffix('H') {
        return radix(digits, 16);
    }
    if let Some((number, exponent)) = upper.split_once('E') {
        let power = 10_i64.checked_pow(exponent.parse().ok()?)?;
        return number.parse::<i64>().ok()?.checked_mul(power);
    }
    None
}

/// An error after `16#FF`: the `#` continues the statement on the next line, where the error then
/// is.
fn after_hash(site: &ErrorSite<'_, '_>) -> Option<Explanation> {
    let written = site.number_before_hash()?;
    let value = value_of(written)?;
    explanation(
        format!("`{written}` is not a number of PMI: its `#` continues the statement on this line"),
        format!("numbers are decimal: write {value}"),
    )
}
