//! An engine that wraps another one and makes a trap of each panic in a scan.
//!
//! A panic of a host function must not unwind through compiled code, so
//! [`NativeEngine`](crate::NativeEngine) catches it before that. The statement interpreter and the IR
//! interpreter unwind. [`PanicBarrier`] gives them the same outcome: the trap
//! [`TrapCode::HostPanic`], and no further scan. The module `session` puts it around every engine.

use std::panic::{AssertUnwindSafe, catch_unwind};

use plcc_abi::{Engine, Outcome, ResumePoint, Scan, TrapCode};

/// An engine whose panics in a scan are traps.
pub struct PanicBarrier<'a> {
    engine: &'a mut dyn Engine,
    /// A panic was caught. No further scan is executed.
    panicked: bool,
}

impl<'a> PanicBarrier<'a> {
    /// A barrier around an engine.
    pub fn new(engine: &'a mut dyn Engine) -> Self {
        Self { engine, panicked: false }
    }
}

impl Engine for PanicBarrier<'_> {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        if self.panicked {
            return Outcome::trap(TrapCode::HostPanic);
        }
        // Engine and host are not used again after a panic, so nobody sees what they left half
        // done; every byte of the image is valid whatever it holds.
        let engine = &mut *self.engine;
        let result = catch_unwind(AssertUnwindSafe(|| engine.call(task, from, scan)));
        result.unwrap_or_else(|_| {
            self.panicked = true;
            Outcome::trap(TrapCode::HostPanic)
        })
    }
}
