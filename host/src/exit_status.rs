//! How a process ends that runs a program: its exit status, and why it could not run it.

use thiserror::Error;

use plcc_control::ControlError;

/// Exit status: done.
pub const DONE: u8 = 0;
/// Exit status: wrong usage, an input that is not valid, an output that can't be written.
pub const USAGE: u8 = 2;
/// Exit status: the program was stopped by a run-time fault.
pub const STOPPED: u8 = 3;
/// Exit status: Ctrl-C.
pub const INTERRUPTED: u8 = 130;

/// Why a program could not be run, or its results not be written: exit status 2. The message says
/// which file or option is meant.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct SessionError(pub String);

impl From<ControlError> for SessionError {
    fn from(error: ControlError) -> Self {
        Self(error.to_string())
    }
}
