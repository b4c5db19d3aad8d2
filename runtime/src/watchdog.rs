//! The watchdog: a thread that says when a scan has taken too long.
//!
//! The scan's thread tells it by [`Watchdog::begin`] when a scan is due to end, and by
//! [`Watchdog::end`] that it has ended. Neither waits, allocates memory or calls the operating system,
//! but to read the clock. When a scan is still running at that time, the watchdog's thread stores the
//! time in the epoch, at which engines look ([`plcc_abi::deadline`]).
//!
//! The thread has a higher real-time priority than the scan's, where that is permitted, so that it runs
//! even if the computer has a single processor for both.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use plcc_abi::TimeLimit;

use crate::small_thread::small_thread;

/// The time at which a scan is due while none runs.
const NEVER: u64 = u64::MAX;
/// How many periods of the control a scan may take, unless the user says otherwise.
const PERIODS: u32 = 3;
/// The shortest time that a scan may take, unless the user says otherwise.
const SHORTEST_LIMIT: Duration = Duration::from_millis(50);

/// The thread looks again so soon after a scan was late.
const AFTER_LATE: Duration = Duration::from_micros(200);

/// What both threads know.
#[derive(Debug)]
struct Shared {
    /// The moment from which times are counted, in nanoseconds.
    start: Instant,
    /// When the scan that runs must have ended.
    due: AtomicU64,
    /// See [`TimeLimit::epoch`].
    epoch: AtomicU64,
    /// Whether the thread is to end.
    stopping: AtomicBool,
}

impl Shared {
    /// The time now.
    fn now(&self) -> u64 {
        u64::try_from(self.start.elapsed().as_nanos()).unwrap_or(NEVER - 1)
    }
}

/// The watchdog, for the thread that runs the scans. A clone is the same watchdog; its thread ends when
/// the last one is dropped.
#[derive(Clone, Debug)]
pub struct Watchdog {
    shared: Arc<Shared>,
    limit: Option<Duration>,
    _stop: Arc<StopOnDrop>,
}

/// Ends the watchdog's thread when it is dropped.
#[derive(Debug)]
struct StopOnDrop {
    shared: Arc<Shared>,
    thread: JoinHandle<()>,
}

/// What a user says of the time that a scan may take on the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WatchdogLimit {
    /// There is no limit.
    Off,
    /// It may take this long.
    Time(Duration),
}

/// How long a scan may take on the clock where the user says nothing: three periods of the control, at
/// least 50 ms.
pub fn usual_limit(period: Duration) -> Duration {
    period.saturating_mul(PERIODS).max(SHORTEST_LIMIT)
}

impl Watchdog {
    /// Starts the thread. `limit` is how long a scan of any task may take on the clock, if there is
    /// such a limit. `shortest` is the shortest time that [`begin`](Self::begin) will be given; the thread
    /// never sleeps longer than that, so that it does not miss the end of such a time. `prepare` is
    /// called first in the thread, to give it its priority.
    ///
    /// # Errors
    /// When the operating system has no thread to give.
    pub fn start(
        limit: Option<Duration>,
        shortest: Duration,
        prepare: impl FnOnce() + Send + 'static,
    ) -> io::Result<Self> {
        let shared = Arc::new(Shared {
            start: Instant::now(),
            due: AtomicU64::new(NEVER),
            epoch: AtomicU64::new(0),
            stopping: AtomicBool::new(false),
        });
        let shortest = shortest.min(limit.unwrap_or(shortest)).max(Duration::from_micros(100));
        let seen = Arc::clone(&shared);
        let watch = move || {
            prepare();
            while !seen.stopping.load(Ordering::Relaxed) {
                thread::park_timeout(check_due(&seen).min(shortest));
            }
        };
        let thread = small_thread("watchdog").spawn(watch)?;
        let stop = StopOnDrop { shared: Arc::clone(&shared), thread };
        Ok(Self { shared, limit, _stop: Arc::new(stop) })
    }

    /// How long a scan of any task may take on the clock, if there is such a limit.
    pub fn limit(&self) -> Option<Duration> {
        self.limit
    }

    /// A scan begins, or goes on, that must have ended when `time` has passed. Gives the limit with which
    /// engines compare the epoch.
    pub fn begin(&self, time: Duration) -> TimeLimit<'_> {
        let time = u64::try_from(time.as_nanos()).unwrap_or(NEVER);
        // The thread may be about to store an epoch for the scan before. It is not later than now, and
        // this scan's limit is, so it does not stop this scan.
        let due = self.shared.now().saturating_add(time).clamp(1, NEVER - 1);
        self.shared.due.store(due, Ordering::Relaxed);
        TimeLimit { epoch: &self.shared.epoch, limit: due }
    }

    /// A scan begins that may take as long as the limit says, if there is one.
    pub fn begin_scan(&self) -> TimeLimit<'_> {
        self.limit.map_or(TimeLimit::NONE, |limit| self.begin(limit))
    }

    /// The scan has ended.
    pub fn end(&self) {
        self.shared.due.store(NEVER, Ordering::Relaxed);
    }
}

/// Stores the time in the epoch if the scan that runs should have ended by now. Gives how long the thread
/// may sleep if no other scan begins.
fn check_due(shared: &Shared) -> Duration {
    let due = shared.due.load(Ordering::Relaxed);
    let now = shared.now();
    if due > now {
        return Duration::from_nanos(due - now);
    }
    shared.epoch.store(now, Ordering::Relaxed);
    // The scan may be given some more time.
    AFTER_LATE
}

impl Drop for StopOnDrop {
    fn drop(&mut self) {
        self.shared.stopping.store(true, Ordering::Relaxed);
        // It ends by itself; nobody waits for it.
        self.thread.thread().unpark();
    }
}

#[cfg(test)]
mod tests {
    use plcc_abi::engine::NoHost;

    use super::*;

    #[test]
    fn the_limit_is_three_periods_and_at_least_fifty_milliseconds() {
        let limit = |ms| usual_limit(Duration::from_millis(ms)).as_millis();
        assert_eq!((limit(1), limit(16), limit(20), limit(100)), (50, 50, 60, 300));
        assert_eq!(usual_limit(Duration::MAX), Duration::MAX);
    }

    #[test]
    fn a_scan_that_does_not_end_is_late_at_last() {
        let limit = Duration::from_millis(2);
        let watchdog = Watchdog::start(Some(limit), limit, || {}).unwrap();
        let mut time = watchdog.begin(limit);
        // This loop does not end unless the thread does what it is for.
        while !time.is_over(&mut NoHost) {
            thread::yield_now();
        }
        // The next scan has a later limit, which that epoch has not reached.
        let hour = Duration::from_secs(3600);
        assert!(!watchdog.begin(hour).is_late());
    }

    #[test]
    fn only_a_scan_that_runs_can_be_late() {
        let shared = Shared {
            start: Instant::now(),
            due: AtomicU64::new(NEVER),
            epoch: AtomicU64::new(0),
            stopping: AtomicBool::new(false),
        };
        assert!(check_due(&shared) > Duration::from_secs(3600));
        assert_eq!(shared.epoch.load(Ordering::Relaxed), 0);
        shared.due.store(shared.now() + 3_600_000_000_000, Ordering::Relaxed);
        let left = check_due(&shared).as_secs();
        assert!((3000..3600).contains(&left), "{left}");
        shared.due.store(0, Ordering::Relaxed);
        check_due(&shared);
        assert_ne!(shared.epoch.load(Ordering::Relaxed), 0);
    }
}
