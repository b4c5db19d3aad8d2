//! How much of a run a record keeps (`--keep`).

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// How much a record keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// At most so many bytes, or a little more if a single checkpoint is longer. Once the record has become that
    /// long, at least the newest half of these bytes is always kept.
    Size(u64),
    /// At least the ticks of the last so much time of the control, and at most those of twice that time.
    Time(Duration),
}

impl Default for Keep {
    fn default() -> Self {
        Self::Size(200_000_000)
    }
}

/// The smallest record, in bytes.
const LEAST_SIZE: u64 = 100_000;
/// The units of sizes and times, and how many bytes or seconds they are.
const SIZES: [(&str, f64); 4] = [("kB", 1e3), ("KB", 1e3), ("MB", 1e6), ("GB", 1e9)];
const TIMES: [(&str, f64); 4] = [("s", 1.0), ("min", 60.0), ("h", 3600.0), ("d", 86400.0)];

impl FromStr for Keep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let at = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
        let (number, unit) = text.split_at(at);
        let number = number.trim();
        let plain = number.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
        let number: Option<f64> = number.parse().ok().filter(|_| plain);
        let number = number.ok_or("a time or a size is expected, as in 10min or 200MB")?;
        let of = |units: &[(&str, f64)]| {
            units.iter().find(|(name, _)| *name == unit.trim()).map(|(_, factor)| number * factor)
        };
        if let Some(bytes) = of(&SIZES) {
            return match bytes as u64 {
                bytes if bytes < LEAST_SIZE => Err("at least 100kB are kept".into()),
                bytes => Ok(Self::Size(bytes)),
            };
        }
        let seconds = of(&TIMES).ok_or("the units are s, min, h and d, kB, MB and GB")?;
        match Duration::try_from_secs_f64(seconds) {
            Ok(time) if time >= Duration::from_secs(1) => Ok(Self::Time(time)),
            Ok(_) => Err("at least 1s is kept".into()),
            Err(_) => Err("that is too long".into()),
        }
    }
}

impl fmt::Display for Keep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size(bytes) => write!(f, "{}kB", bytes / 1000),
            Self::Time(time) => write!(f, "{}s", time.as_secs()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_a_time_or_a_size() {
        assert_eq!("10min".parse(), Ok(Keep::Time(Duration::from_secs(600))));
        assert_eq!("1.5 h".parse(), Ok(Keep::Time(Duration::from_secs(5400))));
        assert_eq!("200MB".parse(), Ok(Keep::Size(200_000_000)));
        assert_eq!("200MB".parse(), Ok(Keep::default()));
        for text in ["", "10", "MB", "-5MB", "0s", "1kB", "5 tons", "1e9h", "99999999999999999999h"]
        {
            assert!(text.parse::<Keep>().is_err(), "{text}");
        }
    }
}
