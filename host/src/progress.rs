//! Shows the progress of long runs, as a line on a terminal that is overwritten again and again. In
//! simulated time [`Progress`] writes it; in real time a thread of the journal does, since a terminal
//! may be stopped (Ctrl-S).

use std::io::{self, IsTerminal, Write};
use std::time::Instant;

use crate::journal::{FIRST_SHOWN_AFTER, UPDATE_INTERVAL, progress_line};
use crate::run::{AfterTick, Hook};

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
        let line = progress_line(ticks, self.ticks, now.saturating_duration_since(self.start));
        // A terminal that was closed is not a reason to end the run.
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
