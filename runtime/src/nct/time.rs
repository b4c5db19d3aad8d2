//! How long a module of NCT may run in real time.
//!
//! The manual gives each module a share of the time (NCT 1.2): `:001`, and `:000` after it, 5 ms of
//! each slice, and `:002` its period. That is time of the control's processor, so it is counted as
//! processor time of the thread that runs the scans: another program that takes the processor away
//! for a while does not stop the PLC. Besides, `--watchdog` limits the time on the clock.
//!
//! Reading processor time is a call of the operating system, so it is not done for every module in every
//! slice. For a module that took long in the slice before, it is read at the beginning of its share; what
//! the module has used is then known exactly. For the others it is first read when as much time has passed
//! on the clock as their share is, since none can have used its share up before, and is counted from that
//! moment on. Such a module is stopped when it has used its share of processor time at the earliest, and
//! twice its share at the latest.

use std::cell::Cell;
use std::time::{Duration, Instant};

use plcc_abi::TimeLimit;

use crate::watchdog::Watchdog;

/// The shortest time for which a limit is renewed, since each renewal costs time too.
const SHORTEST_RENEWAL: Duration = Duration::from_micros(50);

/// What is known of the processor time that the thread had used when a share began, or when the module
/// was first found to be late.
#[derive(Debug, Default)]
pub(super) struct UsedBefore(Cell<Option<Duration>>);

impl UsedBefore {
    /// A share begins; `exact` says whether the processor time is read now.
    pub(super) fn begin(&self, exact: bool) {
        self.0.set(exact.then(processor_time));
    }

    /// The processor time that counts as used since then.
    fn used_since(&self) -> Duration {
        let now = processor_time();
        let before = self.0.get().unwrap_or(now);
        self.0.set(Some(before));
        now.saturating_sub(before)
    }
}

/// The processor time that this thread has used, or what a test says of it.
fn processor_time() -> Duration {
    #[cfg(test)]
    if let Some(time) = tests::PROCESSOR_TIME.get() {
        return time;
    }
    own_time()
}

/// The processor time that this thread has used.
#[cfg(target_os = "linux")]
fn own_time() -> Duration {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::ThreadCPUTime);
    let (seconds, nanoseconds) = (u64::try_from(time.tv_sec), u32::try_from(time.tv_nsec));
    Duration::new(seconds.unwrap_or(0), nanoseconds.unwrap_or(0))
}

/// On other systems the time on the clock stands for it.
#[cfg(not(target_os = "linux"))]
fn own_time() -> Duration {
    use std::sync::OnceLock;
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed()
}

/// What a module gets of the time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Share {
    /// When its share began, and how much processor time that is; in simulated time it has none, and
    /// may take any.
    pub(super) time: Option<(Instant, Duration)>,
    /// When this scan, or this slice's part of it, began, if a watchdog limits it. Reading the clock takes
    /// longer than a short scan.
    pub(super) began: Option<Instant>,
    /// Whether it is suspended, at its next safepoint, when its share is used up, as `:000` is. Other
    /// modules are stopped.
    pub(super) is_suspended: bool,
}

/// The time of a module while it runs.
#[derive(Debug)]
pub(super) struct ModuleTime<'a> {
    pub(super) share: &'a Share,
    pub(super) watchdog: Option<&'a Watchdog>,
    pub(super) used_before: &'a UsedBefore,
}

impl<'a> ModuleTime<'a> {
    /// What is left of its share.
    fn left_of_share(&self) -> Option<Duration> {
        let (began, time) = self.share.time?;
        // The thread can't have used more processor time than has passed.
        let passed = began.elapsed();
        if passed < time {
            return Some(time - passed);
        }
        Some(time.saturating_sub(self.used_before.used_since()))
    }

    /// What is left until the watchdog stops the scan.
    fn left_on_clock(&self) -> Option<Duration> {
        let limit = self.watchdog.and_then(Watchdog::limit)?;
        Some(limit.saturating_sub(self.share.began?.elapsed()))
    }

    /// Whether its share is used up.
    pub(super) fn is_used_up(&self) -> bool {
        self.left_of_share().is_some_and(|left| left.is_zero())
    }

    /// Whether it must be stopped, also between two safepoints.
    pub(super) fn is_over(&self) -> bool {
        self.left_on_clock().is_some_and(|left| left.is_zero())
            || !self.share.is_suspended && self.is_used_up()
    }

    /// The limit for the time until it may have used up what it has. `None` without a watchdog: time
    /// is then looked at only where the module is suspended, every so many safepoints.
    pub(super) fn limit(&self) -> Option<TimeLimit<'a>> {
        let limits = self.left_of_share().into_iter().chain(self.left_on_clock());
        Some(self.watchdog?.begin(limits.min()?.max(SHORTEST_RENEWAL)))
    }

    /// What [`Host::extend_time`](plcc_abi::Host::extend_time) gives for it.
    pub(super) fn extend(&self) -> Option<u64> {
        if self.is_over() {
            return None;
        }
        if self.is_used_up() {
            // It stays late, so that it is suspended at its next safepoint.
            return Some(1);
        }
        self.limit().map(|limit| limit.limit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    thread_local! {
        /// The processor time that a test gives its thread.
        pub(super) static PROCESSOR_TIME: Cell<Option<Duration>> = const { Cell::new(None) };
    }

    /// A share of real time that began a minute ago.
    fn share(time: Duration, is_suspended: bool) -> Share {
        let began = Instant::now().checked_sub(Duration::from_secs(60)).unwrap();
        Share { time: Some((began, time)), began: Some(began), is_suspended }
    }

    fn time<'a>(used_before: &'a UsedBefore, share: &'a Share) -> ModuleTime<'a> {
        ModuleTime { share, watchdog: None, used_before }
    }

    #[test]
    fn a_share_is_used_up_by_processor_time() {
        let millisecond = Duration::from_millis(1);
        let uses = |time| PROCESSOR_TIME.set(Some(millisecond * 7 + time));
        uses(Duration::ZERO);
        let used_before = UsedBefore::default();
        used_before.begin(true);
        let hour = share(Duration::from_secs(3600), false);
        let hour = time(&used_before, &hour);
        let short = share(millisecond, false);
        let short = time(&used_before, &short);
        let suspended = share(millisecond, true);
        let suspended = time(&used_before, &suspended);
        // A minute has passed, but the thread has waited.
        assert!(!short.is_used_up() && !short.is_over());
        uses(millisecond * 9 / 10);
        assert!(!short.is_used_up());
        assert_eq!(short.left_of_share(), Some(millisecond / 10));
        uses(millisecond);
        assert!(short.is_used_up() && short.is_over());
        assert!(suspended.is_used_up() && !suspended.is_over(), "it is suspended, not stopped");
        assert!(!hour.is_used_up() && !hour.is_over());
    }

    #[test]
    fn the_processor_time_of_a_thread_that_computes_grows() {
        let start = processor_time();
        while processor_time() == start {}
        assert!(processor_time() > start);
    }

    #[test]
    fn a_module_that_is_late_gets_a_share_if_nobody_knows_what_it_has_used() {
        let used_before = UsedBefore::default();
        used_before.begin(false);
        let second = Duration::from_secs(1);
        let began = Instant::now().checked_sub(second * 2).unwrap();
        let share = Share { time: Some((began, second)), began: Some(began), is_suspended: false };
        let late = time(&used_before, &share);
        assert!(late.left_of_share().is_some_and(|left| left > second / 2));
    }
}
