//! Progress of long runs, on terminals.

use std::io::{self, IsTerminal, Write};
use std::time::{Duration, Instant};

/// Shorter runs need none.
const PATIENCE: Duration = Duration::from_secs(1);
/// Time between two updates.
const PAUSE: Duration = Duration::from_millis(200);
/// Ticks between two looks at the clock in simulated time.
const STRIDE: u64 = 256;

/// A line that is written over and over.
#[derive(Debug)]
pub(super) struct Progress {
    ticks: Option<u64>,
    start: Instant,
    next: Instant,
    terminal: bool,
    stride: u64,
    visible: bool,
}

impl Progress {
    pub(super) fn new(ticks: Option<u64>, realtime: bool) -> Self {
        let start = Instant::now();
        let terminal = io::stderr().is_terminal();
        let stride = if realtime { 1 } else { STRIDE };
        Self { ticks, start, next: start + PATIENCE, terminal, stride, visible: false }
    }

    /// Shows how many ticks there were, when it is time to.
    #[inline]
    pub(super) fn show(&mut self, ticks: u64) {
        if self.terminal && ticks.is_multiple_of(self.stride) {
            self.update(ticks, Instant::now());
        }
    }

    fn update(&mut self, ticks: u64, now: Instant) {
        if now < self.next {
            return;
        }
        self.next = now + PAUSE;
        self.visible = true;
        let line = line(ticks, self.ticks, now.saturating_duration_since(self.start));
        // A terminal that goes away takes nothing with it.
        let _ = write!(io::stderr(), "\r{line}\x1b[K");
    }

    /// Takes the line away.
    pub(super) fn clear(&mut self) {
        if self.visible {
            let _ = write!(io::stderr(), "\r\x1b[K");
        }
    }
}

/// `42 %, 4200000 of 10000000 ticks, 3 s left`.
fn line(ticks: u64, all: Option<u64>, elapsed: Duration) -> String {
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
    fn the_line_says_how_long_it_takes() {
        let elapsed = Duration::from_secs(2);
        assert_eq!(line(250, Some(1000), elapsed), "25 %, 250 of 1000 ticks, 6 s left");
        assert_eq!(line(250, None, elapsed), "250 ticks, 125 a second, Ctrl-C ends");
        assert_eq!(line(0, Some(0), Duration::ZERO), "0 %, 0 of 0 ticks, 0 s left");
    }
}
