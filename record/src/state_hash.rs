//! The hash of a control's state, by which each tick of a replay is compared with the recorded one.
//!
//! The hash of a tick takes in the hash of the tick before, so that a difference is never forgotten. A
//! record has the lowest 15 bits of it for each tick, and all 64 bits with each checkpoint and at the
//! end.

use std::ops::Range;

use twox_hash::XxHash3_64;

use plcc_runtime::Executive;

/// The bits of the hash that are recorded for each tick. The highest bit of the two bytes tells a tick from
/// other entries.
const RECORDED_BITS: u64 = 0x7FFF;

/// The hash of all ticks so far.
#[derive(Clone, Debug)]
pub(super) struct StateHash {
    /// The parts of the image that are hashed, sorted, without overlaps.
    ranges: Vec<Range<usize>>,
    value: u64,
}

impl StateHash {
    /// The hash before any tick. Of each image it takes in the parts that the program is known to use, without
    /// the places that engines use in their own way. (The other parts are compared at checkpoints.)
    pub(super) fn new(executive: &dyn Executive) -> Self {
        let compared = executive.compared_ranges();
        let used = executive.used_ranges();
        let ranges = if used.is_empty() { compared } else { common(used, &compared) };
        let ranges = ranges.into_iter().map(|range| range.start as usize..range.end as usize);
        Self { ranges: ranges.collect(), value: 0 }
    }

    /// Takes in the image after a tick. Gives the bits that are recorded.
    pub(super) fn add(&mut self, image: &[u8]) -> u16 {
        for range in &self.ranges {
            let bytes = image.get(range.clone()).unwrap_or_default();
            self.value = XxHash3_64::oneshot_with_seed(self.value, bytes);
        }
        (self.value & RECORDED_BITS) as u16
    }

    /// The whole hash.
    pub(super) fn value(&self) -> u64 {
        self.value
    }

    /// Goes on from a recorded hash.
    pub(super) fn set(&mut self, value: u64) {
        self.value = value;
    }
}

/// The intersection of ranges in any order, which may overlap, with sorted ones that do not; the result is sorted
/// and has no overlaps.
fn common(mut ranges: Vec<Range<u32>>, sorted: &[Range<u32>]) -> Vec<Range<u32>> {
    ranges.sort_by_key(|range| range.start);
    let mut merged: Vec<Range<u32>> = vec![];
    for range in ranges {
        match merged.last_mut() {
            Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
            _ => merged.push(range),
        }
    }
    let mut found = vec![];
    for range in &merged {
        let touching = sorted.iter().skip_while(|other| other.end <= range.start);
        for other in touching.take_while(|other| other.start < range.end) {
            found.push(range.start.max(other.start)..range.end.min(other.end));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_merged_and_cut() {
        let ranges = vec![40..50, 0..8, 8..16, 12..20];
        assert_eq!(common(ranges, &[4..10, 15..45]), [4..10, 15..20, 40..45]);
        assert_eq!(common(vec![], &[4..10, 12..14]), []);
    }
}
