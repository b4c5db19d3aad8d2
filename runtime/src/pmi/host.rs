//! The host of a PMI program, which calls no functions: it only says until when a scan may run.

use plcc_abi::{Host, HostFn, TimeLimit};

/// The host for one scan.
#[derive(Debug)]
pub(super) struct PmiHost {
    /// Until when the scan may run, if there is a limit.
    pub(super) time: Option<TimeLimit>,
}

impl Host for PmiHost {
    fn call(&mut self, _: &mut [u8], _: HostFn, _: [u64; 4]) -> u64 {
        0
    }

    fn time_limit(&self) -> Option<TimeLimit> {
        self.time.clone()
    }
}
