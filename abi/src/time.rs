//! Times with their units, as options and configurations have them: `60ms`, `1.5m`.

use alloc::string::String;
use core::time::Duration;

/// A time with its unit: us, ms, s, m (or min) or h.
///
/// # Errors
/// What is wrong with it.
pub fn duration(text: &str) -> Result<Duration, String> {
    let at = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(at);
    let unit = match unit.trim() {
        "us" => 0.000_001,
        "ms" => 0.001,
        "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err("a number and us, ms, s, m or h are expected, as in 5s or 200ms".into()),
    };
    let number = decimal(number.trim()).ok_or("it does not begin with a number, as in 5s")?;
    seconds(number, unit).ok_or_else(|| "that is too long".into())
}

/// The time between two scans: a number of milliseconds, or a time with its unit, more than 0 and less than an hour.
///
/// # Errors
/// What is wrong with it.
pub fn period(text: &str) -> Result<Duration, String> {
    let ms = decimal(text).map(|number| seconds(number, 0.001));
    let period = ms.unwrap_or_else(|| duration(text).ok());
    let hint = "a number of milliseconds or a time is expected, as in 20 or 20ms";
    let period = period.ok_or(hint)?;
    match period.is_zero() || period.as_secs() >= 3600 {
        true => Err("it is more than 0 and less than an hour".into()),
        false => Ok(period),
    }
}

/// A decimal number without a sign or an exponent, with or without a fraction.
fn decimal(text: &str) -> Option<f64> {
    let plain = text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    (plain && text.bytes().any(|byte| byte.is_ascii_digit())).then(|| text.parse().ok())?
}

/// `number` times `unit` seconds; `None` where that is negative or too long for a [`Duration`].
fn seconds(number: f64, unit: f64) -> Option<Duration> {
    Duration::try_from_secs_f64(number * unit).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_have_a_unit() {
        for (text, ms) in [("5s", 5000), ("200ms", 200), ("1.5m", 90_000), ("2 h", 7_200_000)] {
            assert_eq!(duration(text), Ok(Duration::from_millis(ms)), "{text}");
        }
        assert_eq!(
            (period("2.5"), period("20 ms")),
            (Ok(Duration::from_micros(2500)), Ok(Duration::from_millis(20)))
        );
        for text in ["0", "-1", "", ".", "20m s", "3600000", "1h", "inf", "0us"] {
            assert!(period(text).is_err(), "{text}");
        }
        for text in ["5", "s", "", "-5s", "1e3s", "5d", "99999999999999999999h", "NaNs"] {
            assert!(duration(text).is_err(), "{text}");
        }
    }
}
