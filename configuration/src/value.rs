//! The values that keys have: each function reads one kind, and says otherwise what is expected, as the end of a message about the
//! key.

use std::path::{Path, PathBuf};
use std::time::Duration;

use plcc_abi::time;
use toml::de::DeValue;

/// What a value is, or what is expected in its place.
pub type Result<T> = std::result::Result<T, String>;

/// The integer of a value.
pub(crate) fn integer(value: &DeValue<'_>) -> Option<i64> {
    let digits = value.as_integer()?;
    i64::from_str_radix(digits.as_str(), digits.radix()).ok()
}

/// A text.
///
/// # Errors
/// If it is none.
pub fn text(value: &DeValue<'_>) -> Result<String> {
    value.as_str().map(str::to_owned).ok_or_else(|| "a text in quotes is expected".into())
}

/// Reads a path, relative to a folder; otherwise it says what is expected.
pub fn path_in(folder: &Path) -> impl Fn(&DeValue<'_>) -> Result<PathBuf> + Copy {
    move |value| {
        let path = value.as_str().map(|path| folder.join(path));
        path.ok_or_else(|| "a path in quotes is expected".into())
    }
}

/// Yes or no.
///
/// # Errors
/// If it is neither.
pub fn bool(value: &DeValue<'_>) -> Result<bool> {
    value.as_bool().ok_or_else(|| "true or false is expected".into())
}

/// A finite number.
///
/// # Errors
/// If it is none.
pub fn number(value: &DeValue<'_>) -> Result<f64> {
    let number = match value {
        DeValue::Float(number) => number.as_str().replace('_', "").parse().ok(),
        other => integer(other).map(|number| number as f64),
    };
    number.filter(|number: &f64| number.is_finite()).ok_or_else(|| "a number is expected".into())
}

/// A list of texts, or one text.
///
/// # Errors
/// If it is neither.
pub fn list(value: &DeValue<'_>) -> Result<Vec<String>> {
    let one = |value: &DeValue<'_>| value.as_str().map(str::to_owned);
    let all = match value {
        DeValue::Array(values) => values.iter().map(|value| one(value.get_ref())).collect(),
        other => one(other).map(|text| vec![text]),
    };
    all.ok_or_else(|| "a list of texts is expected".into())
}

/// A time of a driver, from 1 ms to an hour.
///
/// # Errors
/// If it is none.
pub fn time(value: &DeValue<'_>) -> Result<Duration> {
    let parsed = value.as_str().and_then(|text| time::duration(text).ok());
    let range = Duration::from_millis(1)..=Duration::from_secs(3600);
    parsed
        .filter(|time| range.contains(time))
        .ok_or_else(|| "a time from 1ms to 1h is expected, as in \"20ms\"".into())
}

/// The same as a number of milliseconds, as the keys that end in `_ms` have it.
///
/// # Errors
/// If it is none.
pub fn milliseconds(value: &DeValue<'_>) -> Result<Duration> {
    let number = value.as_integer().and_then(|number| number.as_str().parse().ok());
    let number = number.filter(|ms| (1..=3_600_000).contains(ms)).map(Duration::from_millis);
    number.ok_or_else(|| "a number of milliseconds is expected".into())
}
