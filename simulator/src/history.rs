//! Values of earlier ticks: actual positions and speeds follow the commands some ticks later (cnc-side 1.14).

use serde::{Deserialize, Serialize};

/// The commands of the last ticks, of several axes.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct History {
    /// For each of the last ticks the values, one behind the other.
    values: Vec<i128>,
    width: usize,
    /// Where the oldest values are.
    at: usize,
}

/// The most ticks by which something may lag.
pub(crate) const MAX_LAG: u64 = 10_000;

impl History {
    /// A history in which the values were always those of `before`. It has values for each of `ticks` ticks.
    pub(crate) fn new(before: &[i128], ticks: u64) -> Self {
        let ticks = ticks.min(MAX_LAG) as usize;
        Self { values: before.repeat(ticks), width: before.len(), at: 0 }
    }

    pub(crate) fn fits(&self, own: &Self) -> bool {
        self.values.len() == own.values.len() && self.width == own.width
    }

    /// Replaces all earlier values in a place.
    pub(crate) fn fill(&mut self, place: usize, value: i128) {
        for values in self.values.chunks_mut(self.width.max(1)) {
            if let Some(slot) = values.get_mut(place) {
                *slot = value;
            }
        }
    }

    /// Puts the values of this tick in, and replaces them by those of as many ticks ago.
    pub(crate) fn delay(&mut self, now: &mut [i128]) {
        if self.values.is_empty() {
            return;
        }
        if self.at >= self.values.len() {
            self.at = 0;
        }
        let oldest = self.values.get_mut(self.at..).and_then(|rest| rest.get_mut(..self.width));
        if let Some(oldest) = oldest.filter(|oldest| oldest.len() == now.len()) {
            oldest.swap_with_slice(now);
        }
        self.at += self.width;
    }
}

#[cfg(test)]
mod tests {
    use super::History;

    #[test]
    fn values_come_back_after_the_lag() {
        let mut history = History::new(&[7, 8], 2);
        let mut seen = vec![];
        for tick in 0..5 {
            let mut now = [tick, 10 * tick];
            history.delay(&mut now);
            seen.push(now);
        }
        assert_eq!(seen, [[7, 8], [7, 8], [0, 0], [1, 10], [2, 20]]);
        let mut none = History::new(&[1], 0);
        let mut now = [3];
        none.delay(&mut now);
        assert_eq!(now, [3]);
    }
}
