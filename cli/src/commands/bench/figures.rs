//! Times of many scans, and the figures that are printed of them.

use serde::Serialize;

/// Minimum, median and 99th percentile, in nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(super) struct Figures {
    pub(super) min: u64,
    pub(super) median: u64,
    pub(super) p99: u64,
}

/// Times below twice this many nanoseconds are counted exactly, longer ones to one part in this
/// many.
const FINE: u64 = 1 << FINE_BITS;
const FINE_BITS: u32 = 10;

/// Measurements in nanoseconds: how many there were of each length, so that many
/// take no more memory than few.
#[derive(Clone, Debug, Default)]
pub(super) struct Samples {
    counts: Vec<u64>,
    total: u64,
}

/// The place of a measurement among the counts.
fn place(ns: u64) -> usize {
    let shift = (u64::BITS - ns.leading_zeros()).saturating_sub(FINE_BITS + 1);
    (u64::from(shift) * FINE + (ns >> shift)) as usize
}

/// The least measurement of a place.
fn least(place: usize) -> u64 {
    let place = place as u64;
    let shift = (place / FINE).saturating_sub(1);
    (place - shift * FINE) << shift
}

impl Samples {
    #[inline]
    pub(super) fn push(&mut self, ns: u64) {
        let place = place(ns);
        if place >= self.counts.len() {
            self.counts.resize(place + 1, 0);
        }
        if let Some(count) = self.counts.get_mut(place) {
            *count += 1;
        }
        self.total += 1;
    }

    pub(super) fn is_empty(&self) -> bool {
        self.total == 0
    }

    pub(super) fn figures(&self) -> Figures {
        let at = |hundredths: u64| {
            let wanted = (u128::from(self.total) * u128::from(hundredths) / 100) as u64;
            let mut before = 0;
            let found = self.counts.iter().position(|&count| {
                before += count;
                before > wanted
            });
            found.map_or(0, least)
        };
        Figures { min: at(0), median: at(50), p99: at(99) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn least_median_and_99th_percentile_of_samples() {
        let of = |ns: std::ops::Range<u64>| {
            let mut samples = Samples::default();
            ns.rev().for_each(|ns| samples.push(ns));
            samples.figures()
        };
        assert_eq!(of(0..0), Figures::default());
        assert_eq!(of(7..8), Figures { min: 7, median: 7, p99: 7 });
        assert_eq!(of(0..1000), Figures { min: 0, median: 500, p99: 990 });
    }

    #[test]
    fn the_histogram_is_exact_for_short_times_and_close_for_long_ones() {
        let mut last = 0;
        for ns in 0..5000 {
            assert!(place(ns) == last || place(ns) == last + 1, "{ns}");
            assert!(ns >= 2 * FINE || least(place(ns)) == ns, "{ns}");
            last = place(ns);
        }
        for ns in (0..5000).chain((1..64).map(|n| 1 << n)).chain([(1 << 40) + 12345, u64::MAX]) {
            let near = least(place(ns));
            assert!(near <= ns && ns - near <= ns / FINE, "{ns} is counted as {near}");
        }
    }
}
