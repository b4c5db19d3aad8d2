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
//! function, by the [`limit`](crate::Scan::limit) of the scan:
//!
//! ```
//! use std::sync::atomic::{AtomicU64, Ordering};
//! use plcc_abi::TimeLimit;
//! use plcc_abi::engine::NoHost;
//!
//! let epoch = AtomicU64::new(0);
//! let mut limit = TimeLimit { epoch: &epoch, limit: 5000 };
//! assert!(!limit.is_over(&mut NoHost));
//! epoch.store(5003, Ordering::Relaxed);
//! assert!(limit.is_over(&mut NoHost));
//! ```

use core::sync::atomic::{AtomicU64, Ordering};
use core::time::Duration;

use crate::Host;

/// Until when a scan may run. It is part of a [`Scan`](crate::Scan), so that an engine has it without
/// a call of the host.
#[derive(Clone, Copy, Debug)]
pub struct TimeLimit<'a> {
    /// The time as it was when the watchdog stored it last, in nanoseconds since a moment of the
    /// watchdog's choice.
    pub epoch: &'a AtomicU64,
    /// The scan is late once the epoch has reached this, which is never 0.
    pub limit: u64,
}

/// The epoch of scans without a limit.
static NO_EPOCH: AtomicU64 = AtomicU64::new(0);

impl TimeLimit<'_> {
    /// The limit of a scan that may take any time.
    pub const NONE: Self = Self { epoch: &NO_EPOCH, limit: u64::MAX };

    /// Whether the epoch has reached the limit.
    #[inline]
    pub fn is_late(&self) -> bool {
        self.epoch.load(Ordering::Relaxed) >= self.limit
    }

    /// Gives the scan more time, for what was done meanwhile and is not the program's doing.
    pub fn extend(&mut self, time: Duration) {
        let time = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        self.limit = self.limit.saturating_add(time);
    }

    /// Whether the scan must be stopped: it is late, and the host does not give it more time.
    #[inline]
    pub fn is_over(&mut self, host: &mut dyn Host) -> bool {
        self.is_late() && self.request_extension(host)
    }

    /// Asks the host of a late scan whether that must be stopped, and takes its new limit.
    #[cold]
    fn request_extension(&mut self, host: &mut dyn Host) -> bool {
        match host.extend_time() {
            Some(later) => {
                self.limit = later;
                false
            }
            None => true,
        }
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
        let epoch = AtomicU64::new(9);
        let mut time = TimeLimit { epoch: &epoch, limit: 10 };
        let mut host = ExtendingHost(alloc::vec![20]);
        assert!(!time.is_late() && !time.is_over(&mut host));
        epoch.store(10, Ordering::Relaxed);
        assert!(time.is_late() && !time.is_over(&mut host));
        assert_eq!(time.limit, 20);
        assert!(!time.is_late());
        epoch.store(25, Ordering::Relaxed);
        assert!(time.is_over(&mut host));
        time.extend(Duration::from_nanos(6));
        assert!(!time.is_over(&mut host));
        let mut none = TimeLimit::NONE;
        none.extend(Duration::MAX);
        assert!(!none.is_late());
    }
}
