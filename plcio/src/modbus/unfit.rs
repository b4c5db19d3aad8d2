//! Points whose values do not fit, and when that was reported: of a value that fits and does not fit in turn there must not
//! be an event every time.

use std::collections::HashMap;
use std::time::{Duration, Instant};

/// How long nothing more is reported of a point.
const PAUSE: Duration = Duration::from_secs(60);

/// What was reported of points.
#[derive(Debug, Default)]
pub(super) struct Unfit {
    /// By the index of a point, when it was reported last that its value does not fit, and whether that is still so as far as
    /// was reported.
    points: HashMap<usize, (Instant, bool)>,
}

impl Unfit {
    /// Notes whether the value of a point fits. Returns whether that is to be reported: where it has changed, and for
    /// each point in a minute once.
    pub(super) fn note(&mut self, index: usize, fits: bool) -> bool {
        match self.points.get_mut(&index) {
            None if fits => false,
            None => {
                self.points.insert(index, (Instant::now(), true));
                true
            }
            Some((_, is_reported)) if fits => std::mem::take(is_reported),
            Some((_, true)) => false,
            Some((when, _)) if when.elapsed() < PAUSE => false,
            Some(reported) => {
                *reported = (Instant::now(), true);
                true
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_that_fits_and_does_not_in_turn_is_reported_once() {
        let mut unfit = Unfit::default();
        assert!(!unfit.note(1, true));
        assert!(unfit.note(1, false));
        assert!(!unfit.note(1, false));
        assert!(unfit.note(2, false), "another point");
        assert!(unfit.note(1, true));
        for _ in 0..5 {
            assert!(!unfit.note(1, false));
            assert!(!unfit.note(1, true));
        }
    }
}
