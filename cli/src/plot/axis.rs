//! Axes: the range of values that a panel shows, and the round numbers that are written beside it.

/// How many numbers stand beside an axis, about.
const NUMBERS: f64 = 6.0;

/// How many characters there is room for beneath the axis of time.
const CHARACTERS: usize = 70;

/// A range of values, with round numbers in it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axis {
    low: f64,
    high: f64,
    /// The distance of two round numbers: `digit` (1, 2 or 5) times 10 to the power of `exponent`.
    digit: f64,
    exponent: i32,
}

impl Axis {
    /// The axis of time, from 0 to an end.
    pub(super) fn of_time(end: f64) -> Self {
        let mut axis = Self::new(0.0, if end > 0.0 { end } else { 1.0 });
        // The numbers stand beside each other.
        while axis.numbers().iter().map(|(_, text)| text.len() + 1).sum::<usize>() > CHARACTERS {
            (axis.digit, axis.exponent) = match axis.digit {
                1.0 => (2.0, axis.exponent),
                2.0 => (5.0, axis.exponent),
                _ => (1.0, axis.exponent + 1),
            };
        }
        axis
    }

    /// An axis that has room for all values.
    pub(super) fn of_values(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = range(values);
        let margin = (high / 20.0) - (low / 20.0);
        match margin > 0.0 {
            true => Self::new(low - margin, high + margin),
            // All are the same.
            false => {
                let around = if low == 0.0 { 1.0 } else { low.abs() / 2.0 };
                Self::new(low - around, high + around)
            }
        }
    }

    /// Axes for values of two variables on which the same distance is equally long.
    pub(super) fn of_equal_scale(x: &[f64], y: &[f64]) -> (Self, Self) {
        let ((x_low, x_high), (y_low, y_high)) =
            (range(x.iter().copied()), range(y.iter().copied()));
        let half = (x_high / 2.0 - x_low / 2.0).max(y_high / 2.0 - y_low / 2.0) * 1.1;
        let half = if half > 0.0 { half } else { 1.0 };
        let around = |low: f64, high: f64| {
            let center = low / 2.0 + high / 2.0;
            Self::new(center - half, center + half)
        };
        (around(x_low, x_high), around(y_low, y_high))
    }

    fn new(low: f64, high: f64) -> Self {
        let (low, high) = (low.max(f64::MIN / 2.0), high.min(f64::MAX / 2.0));
        let high = if high > low { high } else { low + low.abs().max(1.0) };
        let raw = (high - low) / NUMBERS;
        let mut exponent = 0;
        while exponent < 300 && power(exponent + 1) <= raw {
            exponent += 1;
        }
        while exponent > -300 && power(exponent) > raw {
            exponent -= 1;
        }
        let digit = [5.0, 2.0].into_iter().find(|digit| digit * power(exponent) <= raw);
        Self { low, high, digit: digit.unwrap_or(1.0), exponent }
    }

    /// Where a value lies: 0 at the low end, 1 at the high end.
    pub(super) fn share(&self, value: f64) -> f64 {
        (value.clamp(self.low, self.high) - self.low) / (self.high - self.low)
    }

    /// The width of a part of the axis that is one of `columns`.
    pub(super) fn column(&self, columns: f64) -> f64 {
        (self.high - self.low) / columns.max(1.0)
    }

    /// The round numbers, each with its text.
    pub(super) fn numbers(&self) -> Vec<(f64, String)> {
        let step = self.digit * power(self.exponent);
        let first = (self.low / step).ceil();
        let at = |count: u32| {
            let steps = (first + f64::from(count)) * self.digit;
            if self.exponent < 0 {
                steps / power(-self.exponent)
            } else {
                steps * power(self.exponent)
            }
        };
        let all = (0..32).map(at).take_while(|&value| value <= self.high);
        all.map(|value| (value, self.text(value))).collect()
    }

    /// A round number as it is written.
    fn text(&self, value: f64) -> String {
        let decimals = usize::try_from(-self.exponent).unwrap_or(0);
        if decimals > 6 || value.abs() >= 1e9 {
            return format!("{value:.3e}");
        }
        let text = format!("{value:.decimals$}");
        if text.trim_start_matches(['-', '0', '.']).is_empty() { "0".into() } else { text }
    }
}

/// The smallest and the largest value.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let all = values.fold(None, |range: Option<(f64, f64)>, value| {
        Some(range.map_or((value, value), |(low, high)| (low.min(value), high.max(value))))
    });
    all.unwrap_or((0.0, 0.0))
}

/// 10 to the power of `exponent`, by multiplications alone.
fn power(exponent: i32) -> f64 {
    let product = (0..exponent.unsigned_abs()).fold(1.0, |product: f64, _| product * 10.0);
    if exponent < 0 { 1.0 / product } else { product }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &Axis) -> Vec<String> {
        axis.numbers().into_iter().map(|(_, text)| text).collect()
    }

    #[test]
    fn round_numbers_stand_beside_an_axis() {
        assert_eq!(texts(&Axis::of_time(600.0)), ["0", "100", "200", "300", "400", "500", "600"]);
        // Of 2000 there would be 15.
        let long = texts(&Axis::of_time(28_000.0));
        assert_eq!(long, ["0", "5000", "10000", "15000", "20000", "25000"]);
        assert_eq!(
            texts(&Axis::of_time(0.7)),
            ["0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6", "0.7"]
        );
        let same = Axis::of_values([5.0, 5.0].into_iter());
        assert!((same.share(5.0) - 0.5).abs() < 1e-12);
        assert_eq!(texts(&Axis::of_values(std::iter::empty())).len(), 11);
    }

    #[test]
    fn extreme_values_have_an_axis_too() {
        for values in [[f64::MAX, f64::MIN], [f64::MAX, f64::MAX], [0.0, 5e-324], [1e300, 1e300]] {
            let axis = Axis::of_values(values.into_iter());
            assert!(values.iter().all(|&value| axis.share(value).is_finite()), "{values:?}");
            assert!(axis.numbers().len() <= 32);
        }
    }
}
