//! The way of the axes in one part of a block: straight, at a feed or in rapid traverse (cnc-side 1.12).

use serde::{Deserialize, Serialize};

use crate::arc::{Arc, Circle};
use crate::length::{root, scaled};

/// What a nanometre of way is in the unit of progress: nanometres a minute times per cent times nanoseconds.
pub(crate) const SCALE: i128 = 6_000_000_000_000;

/// A straight way. Its lists are as long as there are axes, and are used again for the next way.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Way {
    start: Vec<i128>,
    delta: Vec<i128>,
    /// Whether it is rapid traverse.
    pub(crate) rapid: bool,
    /// In nanometres.
    length: i128,
    /// In nanometres a minute: of rapid traverse that of the axis that leads.
    pub(crate) speed: i128,
    /// How far it is done, in the unit of progress.
    progress: i128,
    /// The arc, where it is one.
    arc: Option<Arc>,
}

impl Way {
    /// Room for a way of this number of axes.
    pub(crate) fn new(axes: usize) -> Self {
        Self { start: vec![0; axes], delta: vec![0; axes], ..Self::default() }
    }

    pub(crate) fn fits(&self, axes: usize) -> bool {
        self.start.len() == axes && self.delta.len() == axes
    }

    /// Begins a way from where the axes stand to `end`. `rapid` has the axes' speeds of rapid traverse; a feed is one
    /// speed for all.
    pub(crate) fn begin(
        &mut self,
        from: &[i128],
        end: &[i128],
        feed: Option<i128>,
        rapid: impl Iterator<Item = i128>,
    ) {
        for (slot, value) in self.start.iter_mut().zip(from) {
            *slot = *value;
        }
        for (slot, (end, from)) in self.delta.iter_mut().zip(end.iter().zip(from)) {
            *slot = end - from;
        }
        self.progress = 0;
        self.arc = None;
        self.rapid = feed.is_none();
        if let Some(feed) = feed {
            let squares = self.delta.iter().map(|delta| delta.unsigned_abs().saturating_pow(2));
            self.length = root(squares.fold(0, u128::saturating_add));
            self.speed = feed;
            return;
        }
        (self.length, self.speed) = (0, 1);
        for (delta, rapid) in self.delta.iter().zip(rapid) {
            let delta = delta.abs();
            if delta.saturating_mul(self.speed) > self.length.saturating_mul(rapid) {
                (self.length, self.speed) = (delta, rapid);
            }
        }
    }

    /// Makes the way that was just begun at a feed go along a circle.
    pub(crate) fn bend(&mut self, circle: Circle) {
        let [first, second] = circle.axes;
        let at = |axis: usize| self.start.get(axis).copied().unwrap_or(0);
        let ends = |axis: usize| at(axis) + self.delta.get(axis).copied().unwrap_or(0);
        let arc = circle.arc([at(first), at(second)], [ends(first), ends(second)]);
        let others = self.delta.iter().enumerate().filter(|(axis, _)| !circle.axes.contains(axis));
        let others = others.map(|(_, delta)| delta.unsigned_abs().saturating_pow(2));
        self.length = arc.length(others.fold(0, u128::saturating_add));
        self.arc = Some(arc);
    }

    /// How it is interpolated: 0 a line, 1 an arc, 2 an arc with a third axis.
    pub(crate) fn interpolation(&self) -> i64 {
        let Some(arc) = self.arc else { return 0 };
        let others = self.delta.iter().enumerate();
        let third =
            others.into_iter().any(|(axis, delta)| *delta != 0 && !arc.circle.axes.contains(&axis));
        1 + i64::from(third)
    }

    /// Whether an axis has any way at all, and in which direction.
    pub(crate) fn direction(&self, axis: usize) -> i128 {
        self.delta.get(axis).map_or(0, |delta| delta.signum())
    }

    /// Whether an axis moves, as those of an arc do even where they come back.
    pub(crate) fn moves(&self, axis: usize) -> bool {
        let bends = self.arc.is_some_and(|arc| arc.circle.axes.contains(&axis));
        bends || self.direction(axis) != 0
    }

    fn total(&self) -> i128 {
        self.length.saturating_mul(SCALE)
    }

    /// Whether the end is reached.
    pub(crate) fn is_done(&self) -> bool {
        self.progress >= self.total()
    }

    /// Goes on for a tick at `speed` nanometres a minute, at a percentage of it.
    pub(crate) fn advance(&mut self, speed: i128, percent: i64, tick_ns: u64) {
        let added = speed.saturating_mul(percent.into()).saturating_mul(tick_ns.into());
        self.progress = self.progress.saturating_add(added);
    }

    /// Where an axis is on the way now.
    pub(crate) fn position(&self, axis: usize) -> Option<i128> {
        let (start, delta) = (self.start.get(axis)?, self.delta.get(axis)?);
        if let Some(arc) = &self.arc
            && !self.is_done()
        {
            let part = self.progress as f64 / self.total() as f64;
            if let Some(position) = arc.position(axis, part) {
                return Some(position);
            }
        }
        Some(start + scaled(*delta, self.progress, self.total()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_feed_goes_along_the_straight_line() {
        let mut way = Way::new(2);
        // 30 mm and 40 mm at 3000 mm a minute: 50 mm in a second, 50 ticks of 20 ms.
        way.begin(&[0, 0], &[30_000_000, -40_000_000], Some(3_000_000_000), [].into_iter());
        for tick in 1..=50 {
            assert!(!way.is_done());
            way.advance(way.speed, 100, 20_000_000);
            assert_eq!(way.position(0), Some(600_000 * tick));
            assert_eq!(way.position(1), Some(-800_000 * tick));
        }
        assert!(way.is_done());
    }

    #[test]
    fn the_axis_that_needs_longest_leads_in_rapid_traverse() {
        let mut way = Way::new(2);
        way.begin(&[0, 0], &[10_000, 10_000], None, [9_000, 6_000].into_iter());
        assert_eq!((way.length, way.speed), (10_000, 6_000));
        way.begin(&[5, 5], &[5, 5], None, [9_000, 6_000].into_iter());
        assert!(way.is_done());
        assert_eq!(way.position(0), Some(5));
    }
}
