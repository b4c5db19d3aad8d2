//! Overrides and speeds (NCT 6.4; cnc-side 3.14).

use super::state::State;
use super::{Nct, Step};

/// The per cents of F% and, with parameter 1204 at 0, of R%.
const FEED: [i64; 16] = [0, 1, 2, 5, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120];
/// How many of them R% has.
const RAPID_STEPS: usize = 14;
/// The per cents of S%.
const SPINDLE: [i64; 11] = [50, 60, 70, 80, 90, 100, 110, 120, 130, 140, 150];

/// The value of a code; codes above a table are its last.
fn of_code(table: &[i64], code: i64) -> i64 {
    let code = usize::try_from(code.max(0)).unwrap_or(usize::MAX);
    table.get(code).or(table.last()).copied().unwrap_or(0)
}

/// S%.
pub(super) fn spindle_override(step: &Step<'_, '_>) -> i64 {
    of_code(&SPINDLE, step.spindle_override_code)
}

impl Nct {
    /// The speed of the way in nanometres a minute, and how many per cent of it count.
    pub(super) fn speed(&self, state: &State, step: &Step<'_, '_>) -> (i128, i64) {
        let feed = of_code(&FEED, step.feed_code);
        let way = &state.way;
        if way.rapid {
            let rapid = match self.setup.rapid_override {
                None => of_code(FEED.get(..RAPID_STEPS).unwrap_or(&FEED), step.rapid_code),
                Some(first) => of_code(&[first, 25, 50, 100], step.rapid_code),
            };
            return (way.speed, if feed == 0 { 0 } else { rapid });
        }
        let most = self.setup.feed_max;
        let speed = if step.y(44, 2) { most } else { way.speed };
        let percent = if state.ignores_stop { 100 } else { feed };
        // The product is limited to the greatest feed.
        if speed.saturating_mul(percent.into()) > most.saturating_mul(100) {
            (most, 100)
        } else {
            (speed, percent)
        }
    }
}
