//! Paces ticks by a clock (`--realtime`). The time at which each tick is due is counted from the start
//! of the run, so that a late tick does not delay all that follow.

use std::fmt::Debug;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// The longest time between two looks at the flag that Ctrl-C sets.
const MAX_SLEEP: Duration = Duration::from_millis(50);
/// Lateness of more than this is not made up for: the computer was suspended, or the process was
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

/// How late the ticks of a run began.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Punctuality {
    /// How many ticks began only when the next one was already due.
    pub overruns: u64,
    /// How late the latest tick began.
    pub latest: Duration,
}

/// Waits for the time of each tick, and counts late ones.
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

    /// Counts a tick that begins at `now` and sets when the next one is due, `tick` later.
    fn begin(&mut self, now: Instant, tick: Duration) {
        let late = now.saturating_duration_since(self.due);
        self.punctuality.latest = self.punctuality.latest.max(late);
        self.punctuality.overruns += u64::from(late >= tick);
        let base = if late > MAX_CATCH_UP { now } else { self.due };
        self.due = base.checked_add(tick).unwrap_or(base);
    }

    /// How late ticks have begun so far.
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
        assert_eq!(pacer.due, at(80), "the lateness is made up for");
        assert_eq!(pacer.punctuality.overruns, 1);
        assert_eq!(pacer.punctuality.latest, Duration::from_millis(30));
        pacer.begin(at(5000), tick);
        assert_eq!(pacer.due, at(5020), "more than a second is not made up for");
    }

    #[test]
    fn the_interrupt_flag_ends_the_waiting() {
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
