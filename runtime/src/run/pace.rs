//! Pacing by the clock: every tick has its time, counted from the start, so that lateness does
//! not add up.

use std::fmt::Debug;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// The longest sleep, so that Ctrl-C is noticed in time.
const MAX_SLEEP: Duration = Duration::from_millis(50);
/// A tick that begins later than this is not caught up with: the machine slept, or the process was
/// stopped in a debugger.
const MAX_CATCH_UP: Duration = Duration::from_secs(1);

/// The time that a run in real time is paced by. A test gives a clock that does not really wait.
pub trait Clock: Debug {
    /// The time now. It never goes backwards.
    fn now(&self) -> Instant;

    /// Waits for this long, or longer.
    fn sleep(&self, time: Duration);
}

/// The operating system's monotonic clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct SystemClock;

impl Clock for SystemClock {
    fn now(&self) -> Instant {
        Instant::now()
    }

    fn sleep(&self, time: Duration) {
        thread::sleep(time);
    }
}

/// How well the clock was kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Punctuality {
    /// Ticks that began when the next one was due already.
    pub overruns: u64,
    /// The most that a tick began late.
    pub latest: Duration,
}

/// Says when ticks begin.
#[derive(Clone, Debug)]
pub struct Pacer {
    due: Instant,
    punctuality: Punctuality,
}

impl Pacer {
    /// The first tick is due at the time `now`.
    pub fn start(now: Instant) -> Self {
        Self { due: now, punctuality: Punctuality::default() }
    }

    /// Waits until the next tick is due, or the flag `interrupt` is set. `tick` is the time from
    /// that tick to the one after it.
    pub fn wait(&mut self, clock: &dyn Clock, tick: Duration, interrupt: Option<&AtomicBool>) {
        loop {
            let now = clock.now();
            let left = self.due.saturating_duration_since(now);
            if left.is_zero() {
                self.begin(now, tick);
                return;
            }
            if interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
                return;
            }
            clock.sleep(left.min(MAX_SLEEP));
        }
    }

    /// A tick begins.
    fn begin(&mut self, now: Instant, tick: Duration) {
        let late = now.saturating_duration_since(self.due);
        self.punctuality.latest = self.punctuality.latest.max(late);
        self.punctuality.overruns += u64::from(late >= tick);
        let base = if late > MAX_CATCH_UP { now } else { self.due };
        self.due = base.checked_add(tick).unwrap_or(base);
    }

    /// How well the clock was kept.
    pub fn punctuality(&self) -> Punctuality {
        self.punctuality
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lateness_is_counted_and_does_not_add_up() {
        let start = Instant::now();
        let mut pacer = Pacer::start(start);
        let tick = Duration::from_millis(20);
        let at = |ms| start + Duration::from_millis(ms);
        pacer.begin(at(0), tick);
        pacer.begin(at(25), tick);
        assert_eq!(pacer.punctuality.overruns, 0, "late, but within its time");
        pacer.begin(at(70), tick);
        pacer.begin(at(71), tick);
        assert_eq!(pacer.due, at(80), "made up for");
        assert_eq!(pacer.punctuality.overruns, 1);
        assert_eq!(pacer.punctuality.latest, Duration::from_millis(30));
        pacer.begin(at(5000), tick);
        assert_eq!(pacer.due, at(5020), "not made up for");
    }

    #[test]
    fn the_flag_ends_the_waiting() {
        /// A clock that stands, and on which nobody may wait.
        #[derive(Debug)]
        struct Standing(Instant);

        impl Clock for Standing {
            fn now(&self) -> Instant {
                self.0
            }

            fn sleep(&self, time: Duration) {
                panic!("waits for {time:?}, though the flag is set");
            }
        }

        let clock = Standing(Instant::now());
        let mut pacer = Pacer::start(clock.now());
        let hour = Duration::from_secs(3600);
        pacer.wait(&clock, hour, None);
        pacer.wait(&clock, hour, Some(&AtomicBool::new(true)));
    }
}
