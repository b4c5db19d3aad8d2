//! Threads with a small stack, for work that needs none of the usual two mebibytes: writing files, watching,
//! waiting for signals.
//!
//! In real time all memory is locked, and with it every stack as a whole. With usual stacks that alone
//! took 4 ms of the time from the start of a control to its first tick.

use std::thread::Builder;

/// The length of such a stack in bytes. It has room for what a panic needs to be reported.
const STACK: usize = 256 << 10;

/// A thread of this name with a small stack, to be started. What it calls must neither recurse deeply nor
/// compile.
pub fn small_thread(name: &str) -> Builder {
    Builder::new().name(name.into()).stack_size(STACK)
}
