//! Shows the progress of long runs, as a line on a terminal that is overwritten again and again. In
//! simulated time [`Progress`] writes it; in real time a thread of the journal does, since a terminal
//! may be stopped (Ctrl-S).

use std::io::{self, IsTerminal, Write};
use std::time::Duration;

use std::time::Instant;

use crate::run::{AfterTick, Hook};

/// How long a run has lasted before its progress is shown.
pub(crate) const FIRST_SHOWN_AFTER: Duration = Duration::from_secs(1);
/// Time between two updates of the line.
pub(crate) const UPDATE_INTERVAL: Duration = Duration::from_millis(200);
/// The clock is read once in so many ticks, since reading it takes longer than a short tick.
const TICKS_PER_CLOCK_READ: u64 = 256;

/// The line that shows the progress of a run in simulated time.
#[derive(Debug)]
pub(crate) struct Progress {
    /// How many ticks the whole run has, if that is known.
    ticks: Option<u64>,
    start: Instant,
    /// When the line is shown or updated next.
    next: Instant,
    /// Whether standard error is a terminal.
    is_terminal: bool,
    /// Whether the line is shown.
    visible: bool,
}

impl Progress {
    /// For a run of this many ticks, where that is known.
    pub(crate) fn new(ticks: Option<u64>) -> Self {
        let start = Instant::now();
        let is_terminal = io::stderr().is_terminal();
        Self { ticks, start, next: start + FIRST_SHOWN_AFTER, is_terminal, visible: false }
    }

    fn update(&mut self, ticks: u64, now: Instant) {
        if now < self.next {
            return;
        }
        self.next = now + UPDATE_INTERVAL;
        self.visible = true;
        let line = line(ticks, self.ticks, now.saturating_duration_since(self.start));
        // A terminal that was closed is no reason to end the run.
        let _ = write!(io::stderr(), "\r{line}\x1b[K");
    }

    /// Removes the line.
    pub(crate) fn clear(&mut self) {
        if self.visible {
            let _ = write!(io::stderr(), "\r\x1b[K");
        }
    }
}

impl Hook for Progress {
    /// Updates the line, if standard error is a terminal and the last update is long enough ago.
    #[inline]
    fn after_tick(&mut self, now: &mut AfterTick<'_>) {
        if self.is_terminal && now.ticks.is_multiple_of(TICKS_PER_CLOCK_READ) {
            self.update(now.ticks, Instant::now());
        }
    }
}

/// The line's text, such as `42 %, 4200000 of 10000000 ticks, 3 s left`, after `ticks` ticks of `all` in
/// the time `elapsed`. Where `all` is not known, it says how many ticks a second are done.
pub(crate) fn line(ticks: u64, all: Option<u64>, elapsed: Duration) -> String {
    let rate = ticks as f64 / elapsed.as_secs_f64().max(1e-9);
    match all {
        Some(all) => {
            let percent = u128::from(ticks) * 100 / u128::from(all.max(1));
            let left = all.saturating_sub(ticks) as f64 / rate.max(1e-9);
            format!("{percent} %, {ticks} of {all} ticks, {left:.0} s left")
        }
        None => format!("{ticks} ticks, {rate:.0} a second, Ctrl-C ends"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_progress_line_says_how_long_the_run_takes() {
        let elapsed = Duration::from_secs(2);
        assert_eq!(line(250, Some(1000), elapsed), "25 %, 250 of 1000 ticks, 6 s left");
        assert_eq!(line(250, None, elapsed), "250 ticks, 125 a second, Ctrl-C ends");
        assert_eq!(line(0, Some(0), Duration::ZERO), "0 %, 0 of 0 ticks, 0 s left");
    }
}
