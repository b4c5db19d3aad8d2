//! The two-part watchdog (guide, The WatchdogTimer Timer): it wants background at least every 512
//! real-time interrupts, and interrupts at a rate of about 50 Hz or more. In simulated time
//! neither can fail, so it watches only where ticks are paced by the clock.

use std::time::{Duration, Instant};

use crate::{Stop, Trip};

/// The longest time between two interrupts; one that comes later is late.
const LONGEST_INTERVAL: Duration = Duration::from_millis(20);
/// How many late interrupts in a row trip the watchdog: a short pause of the computer is not a failure.
const MAX_LATE: u32 = 25;
/// How many interrupts without background trip it.
const MAX_INTERRUPTS_ALONE: u32 = 512;
/// The shortest time between interrupts with which the time of background is measured, in seconds: 512 of
/// them are 0.64 s. With a shorter one a short pause of the computer would trip the watchdog.
const SHORTEST_INTERVAL: f64 = 0.001_25;

/// When interrupts came and background was done, by which failures are noticed.
#[derive(Debug, Default)]
pub(super) struct WatchdogTimer {
    /// When the last interrupt came.
    interrupt: Option<Instant>,
    /// How many interrupts in a row were late.
    late: u32,
    /// How many interrupts came since background was done.
    alone: u32,
    /// When background was last done.
    background: Option<Instant>,
}

impl WatchdogTimer {
    /// A real-time interrupt comes. Why the watchdog trips, if it does.
    pub(super) fn interrupt(&mut self) -> Option<Trip> {
        self.interrupt_at(Instant::now())
    }

    /// Background is done; `interval` is the time between interrupts in seconds. Whether it came in time.
    pub(super) fn background(&mut self, interval: f64) -> bool {
        self.background_at(Instant::now(), interval)
    }

    /// Whether an interval has passed since the interrupt came.
    pub(super) fn is_overdue(&self, interval: f64) -> bool {
        self.interrupt.is_some_and(|last| last.elapsed().as_secs_f64() > interval)
    }

    fn interrupt_at(&mut self, now: Instant) -> Option<Trip> {
        let last = self.interrupt.replace(now);
        let is_late =
            last.is_some_and(|last| now.saturating_duration_since(last) > LONGEST_INTERVAL);
        self.late = if is_late { self.late + 1 } else { 0 };
        if self.late >= MAX_LATE {
            return Some(Trip::Slow);
        }
        self.alone += 1;
        (self.alone >= MAX_INTERRUPTS_ALONE).then_some(Trip::Starved)
    }

    fn background_at(&mut self, now: Instant, interval: f64) -> bool {
        self.alone = 0;
        let last = self.background.replace(now);
        let passed = last.map_or(Duration::ZERO, |last| now.saturating_duration_since(last));
        let longest = f64::from(MAX_INTERRUPTS_ALONE) * interval.max(SHORTEST_INTERVAL);
        passed.as_secs_f64() <= longest
    }
}

/// The stop of a program for which the watchdog has tripped.
pub(super) fn stop(trip: Trip) -> Stop {
    let message = match trip {
        Trip::Slow => "the real-time interrupt came less than 50 times a second",
        Trip::Starved => "background was not done within 512 real-time interrupts",
    };
    Stop { code: "WATCHDOG".into(), message: message.into(), place: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_late_interrupts_in_a_row_trip_the_watchdog() {
        let mut watchdog = WatchdogTimer::default();
        let mut now = Instant::now();
        for _ in 0..MAX_LATE {
            assert_eq!(watchdog.interrupt_at(now), None);
            now += Duration::from_millis(30);
        }
        assert!(watchdog.interrupt_at(now).is_some());
        let mut watchdog = WatchdogTimer::default();
        for step in 0..500 {
            now += Duration::from_millis(if step % 20 == 0 { 100 } else { 1 });
            assert_eq!(watchdog.interrupt_at(now), None);
        }
    }

    #[test]
    fn interrupts_without_background_trip_the_watchdog() {
        let mut watchdog = WatchdogTimer::default();
        let now = Instant::now();
        for _ in 0..2 {
            for _ in 1..MAX_INTERRUPTS_ALONE {
                assert_eq!(watchdog.interrupt_at(now), None);
            }
            assert!(watchdog.background_at(now, 0.001));
        }
        for _ in 1..MAX_INTERRUPTS_ALONE {
            assert_eq!(watchdog.interrupt_at(now), None);
        }
        assert!(watchdog.interrupt_at(now).is_some());
    }

    #[test]
    fn background_that_does_not_run_trips_the_watchdog() {
        let mut watchdog = WatchdogTimer::default();
        let start = Instant::now();
        assert!(watchdog.background_at(start, 0.001));
        assert!(watchdog.background_at(start + Duration::from_millis(500), 0.001));
        assert!(!watchdog.background_at(start + Duration::from_millis(1500), 0.001));
    }
}
