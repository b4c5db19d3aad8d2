//! Overrides and speeds (NCT 6.4; cnc-side 3.14).

use super::parts::Kind;
use super::state::State;
use super::{Nct, Step};
use crate::setup::Setup;

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

/// F%.
pub(super) fn feed_override(step: &Step<'_, '_>) -> i64 {
    of_code(&FEED, step.feed_code)
}

/// R%; 0 where F% is 0.
pub(super) fn rapid_override(setup: &Setup, step: &Step<'_, '_>) -> i64 {
    match setup.rapid_override {
        _ if feed_override(step) == 0 => 0,
        None => of_code(FEED.get(..RAPID_STEPS).unwrap_or(&FEED), step.rapid_code),
        Some(first) => of_code(&[first, 25, 50, 100], step.rapid_code),
    }
}

/// S%.
pub(super) fn spindle_override(step: &Step<'_, '_>) -> i64 {
    of_code(&SPINDLE, step.spindle_override_code)
}

impl Nct {
    /// The speed of the way in nanometres a minute, and how many per cent of it count.
    pub(super) fn speed(&self, state: &State, step: &Step<'_, '_>, kind: Kind) -> (i128, i64) {
        let way = &state.way;
        if way.rapid {
            return (way.speed, rapid_override(&self.setup, step));
        }
        if kind == Kind::Thread {
            // F is the way of a revolution of the active spindle.
            let [first, second] = &state.spindles;
            let active = if step.y(66, 0) { second } else { first };
            return (way.speed.saturating_mul(active.actual.abs().into()), 100);
        }
        let most = self.setup.feed_max;
        let speed = if step.y(44, 2) { most } else { way.speed };
        let percent = if state.ignores_stop { 100 } else { feed_override(step) };
        // The product is limited to the greatest feed.
        if speed.saturating_mul(percent.into()) > most.saturating_mul(100) {
            (most, 100)
        } else {
            (speed, percent)
        }
    }
}
