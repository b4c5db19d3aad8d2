//! How long a scan may take.
//!
//! A scan that takes too long must be stopped while program code runs. Another thread, the watchdog,
//! looks at the clock for it, since reading a clock costs more than a short scan. What the two share is
//! one number, the *epoch*: the watchdog stores there what the time is when a scan's time is up, and an
//! engine stops the scan when the epoch has reached the scan's [`TimeLimit`].
//!
//! The epoch is never reset, and every scan has a later limit than the ones before. So a watchdog that
//! stores a moment too late, when the next scan has begun, does not stop that one.
//!
//! Engines look at the epoch where code may jump back, between two chunks, and after each host
//! function, by a [`Deadline`]:
//!
//! ```
//! use std::sync::Arc;
//! use std::sync::atomic::{AtomicU64, Ordering};
//! use plcc_abi::engine::NoHost;
//! use plcc_abi::{Deadline, TimeLimit};
//!
//! let epoch = Arc::new(AtomicU64::new(0));
//! let limit = TimeLimit { epoch: Arc::clone(&epoch), limit: 5000 };
//! let mut deadline = Deadline::new(Some(limit));
//! assert!(!deadline.is_over(&mut NoHost));
//! epoch.store(5003, Ordering::Relaxed);
//! assert!(deadline.is_over(&mut NoHost));
//! ```

use alloc::sync::Arc;
use core::sync::atomic::{AtomicU64, Ordering};

use crate::Host;

/// Until when a scan may run.
#[derive(Clone, Debug)]
pub struct TimeLimit {
    /// The time as it was when the watchdog stored it last, in nanoseconds since a moment of the
    /// watchdog's choice.
    pub epoch: Arc<AtomicU64>,
    /// The scan is late once the epoch has reached this, which is never 0.
    pub limit: u64,
}

/// A scan's time limit while the scan runs, as an engine holds it.
#[derive(Debug)]
pub struct Deadline(Option<TimeLimit>);

impl Deadline {
    /// The deadline of a scan; a scan without a limit may take any time.
    #[inline]
    pub fn new(limit: Option<TimeLimit>) -> Self {
        Self(limit)
    }

    /// Whether the epoch has reached the limit.
    #[inline]
    pub fn is_late(&self) -> bool {
        match &self.0 {
            Some(TimeLimit { epoch, limit }) => epoch.load(Ordering::Relaxed) >= *limit,
            None => false,
        }
    }

    /// Whether the scan must be stopped: it is late, and the host does not give it more time.
    #[inline]
    pub fn is_over(&mut self, host: &mut dyn Host) -> bool {
        self.is_late() && self.ask(host)
    }

    /// Asks the host of a late scan whether that must be stopped, and takes its new limit.
    #[cold]
    fn ask(&mut self, host: &mut dyn Host) -> bool {
        match (host.extend_time(), &mut self.0) {
            (Some(later), Some(TimeLimit { epoch: _, limit })) => {
                *limit = later;
                false
            }
            _ => true,
        }
    }

    /// The limit as it is now; a scan without one has the highest number.
    #[inline]
    pub fn limit(&self) -> u64 {
        self.0.as_ref().map_or(u64::MAX, |limit| limit.limit)
    }

    /// The address of the epoch, for compiled code. It is valid as long as this value.
    #[inline]
    pub fn epoch(&self) -> *const AtomicU64 {
        /// The epoch of scans without a limit.
        static NEVER: AtomicU64 = AtomicU64::new(0);
        self.0.as_ref().map_or(&raw const NEVER, |limit| Arc::as_ptr(&limit.epoch))
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;
    use crate::HostFn;

    /// A host that extends the time to the limits of a list, from the last to the first.
    struct ExtendingHost(Vec<u64>);

    impl Host for ExtendingHost {
        fn call(&mut self, _: &mut [u8], _: HostFn, _: [u64; 4]) -> u64 {
            0
        }

        fn extend_time(&mut self) -> Option<u64> {
            self.0.pop()
        }
    }

    #[test]
    fn a_host_can_give_a_late_scan_more_time() {
        let epoch = Arc::new(AtomicU64::new(9));
        let mut deadline = Deadline::new(Some(TimeLimit { epoch: Arc::clone(&epoch), limit: 10 }));
        let mut host = ExtendingHost(alloc::vec![20]);
        assert!(!deadline.is_late() && !deadline.is_over(&mut host));
        epoch.store(10, Ordering::Relaxed);
        assert!(deadline.is_late() && !deadline.is_over(&mut host));
        assert_eq!(deadline.limit(), 20);
        assert!(!deadline.is_late());
        epoch.store(25, Ordering::Relaxed);
        assert!(deadline.is_over(&mut host));
        let mut never = Deadline::new(None);
        assert!(!never.is_late() && !never.is_over(&mut host));
        assert_eq!(never.limit(), u64::MAX);
    }
}
