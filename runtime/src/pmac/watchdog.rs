//! The two-part watchdog (guide, The Watchdog Timer): it wants background at least every 512
//! real-time interrupts, and interrupts at a rate of about 50 Hz or more. In simulated time
//! neither can fail, so it watches only where ticks are paced by the clock.

use std::time::{Duration, Instant};

use crate::Stop;

/// Longest time between interrupts.
const SLOWEST: Duration = Duration::from_millis(20);
/// How many late interrupts in a row trip it: a hiccup of the host is no failure.
const LATE: u32 = 25;
/// Interrupts without background.
const INTERRUPTS: u32 = 512;

const STARVED: &str = "background was not done within 512 real-time interrupts";

/// When things last happened.
#[derive(Debug, Default)]
pub(super) struct Watchdog {
    interrupt: Option<Instant>,
    late: u32,
    /// Interrupts since background was done.
    alone: u32,
    background: Option<Instant>,
}

impl Watchdog {
    /// A real-time interrupt comes.
    pub(super) fn interrupt(&mut self) -> Result<(), Stop> {
        self.interrupt_at(Instant::now())
    }

    /// Background is done; `interval` is the time between interrupts in seconds.
    pub(super) fn background(&mut self, interval: f64) -> Result<(), Stop> {
        self.background_at(Instant::now(), interval)
    }

    /// Whether an interval has passed since the interrupt came.
    pub(super) fn is_overdue(&self, interval: f64) -> bool {
        self.interrupt.is_some_and(|last| last.elapsed().as_secs_f64() > interval)
    }

    fn interrupt_at(&mut self, now: Instant) -> Result<(), Stop> {
        let last = self.interrupt.replace(now);
        let is_late = last.is_some_and(|last| now.saturating_duration_since(last) > SLOWEST);
        self.late = if is_late { self.late + 1 } else { 0 };
        if self.late >= LATE {
            return Err(trip("the real-time interrupt came less than 50 times a second"));
        }
        self.alone += 1;
        if self.alone >= INTERRUPTS { Err(trip(STARVED)) } else { Ok(()) }
    }

    fn background_at(&mut self, now: Instant, interval: f64) -> Result<(), Stop> {
        self.alone = 0;
        let last = self.background.replace(now);
        let passed = last.map_or(Duration::ZERO, |last| now.saturating_duration_since(last));
        // Never less than the slowest interrupts would allow.
        if passed.as_secs_f64() > f64::from(INTERRUPTS) * interval.max(SLOWEST.as_secs_f64() / 16.0)
        {
            return Err(trip(STARVED));
        }
        Ok(())
    }
}

fn trip(message: &str) -> Stop {
    Stop { code: "WATCHDOG".into(), message: message.into(), place: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_late_interrupts_in_a_row_trip_the_watchdog() {
        let mut watchdog = Watchdog::default();
        let mut now = Instant::now();
        for _ in 0..LATE {
            assert_eq!(watchdog.interrupt_at(now), Ok(()));
            now += Duration::from_millis(30);
        }
        assert!(watchdog.interrupt_at(now).is_err());
        let mut watchdog = Watchdog::default();
        for step in 0..500 {
            now += Duration::from_millis(if step % 20 == 0 { 100 } else { 1 });
            assert_eq!(watchdog.interrupt_at(now), Ok(()));
        }
    }

    #[test]
    fn interrupts_without_background_trip_the_watchdog() {
        let mut watchdog = Watchdog::default();
        let now = Instant::now();
        for _ in 0..2 {
            for _ in 1..INTERRUPTS {
                assert_eq!(watchdog.interrupt_at(now), Ok(()));
            }
            assert_eq!(watchdog.background_at(now, 0.001), Ok(()));
        }
        for _ in 1..INTERRUPTS {
            assert_eq!(watchdog.interrupt_at(now), Ok(()));
        }
        assert!(watchdog.interrupt_at(now).is_err());
    }

    #[test]
    fn background_that_does_not_run_trips_the_watchdog() {
        let mut watchdog = Watchdog::default();
        let start = Instant::now();
        assert_eq!(watchdog.background_at(start, 0.001), Ok(()));
        assert_eq!(watchdog.background_at(start + Duration::from_millis(500), 0.001), Ok(()));
        assert!(watchdog.background_at(start + Duration::from_millis(1500), 0.001).is_err());
    }
}
