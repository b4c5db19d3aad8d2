//! What is told of many measurements.

use serde::Serialize;

/// Least, middle and nearly most, in nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(super) struct Figures {
    pub(super) min: u64,
    pub(super) median: u64,
    pub(super) p99: u64,
}

/// Measurements in nanoseconds.
#[derive(Clone, Debug, Default)]
pub(super) struct Samples(Vec<u32>);

impl Samples {
    pub(super) fn push(&mut self, ns: u64) {
        self.0.push(u32::try_from(ns).unwrap_or(u32::MAX));
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn figures(&self) -> Figures {
        let mut sorted = self.0.clone();
        sorted.sort_unstable();
        let at = |hundredths: usize| {
            let index = (sorted.len() * hundredths / 100).min(sorted.len().saturating_sub(1));
            sorted.get(index).copied().map_or(0, u64::from)
        };
        Figures { min: at(0), median: at(50), p99: at(99) }
    }
}

#[cfg(test)]
mod tests {
    use super::{Figures, Samples};

    #[test]
    fn figures_of_none_one_and_many() {
        let of = |ns: std::ops::Range<u64>| {
            let mut samples = Samples::default();
            ns.rev().for_each(|ns| samples.push(ns));
            samples.figures()
        };
        assert_eq!(of(0..0), Figures::default());
        assert_eq!(of(7..8), Figures { min: 7, median: 7, p99: 7 });
        assert_eq!(of(0..1000), Figures { min: 0, median: 500, p99: 990 });
    }
}
