//! Why a command could not do its work.

use std::fmt::Display;
use std::path::Path;

/// Exit status: done.
pub(crate) const DONE: u8 = 0;
/// Exit status: the source has errors.
pub(crate) const ERRORS: u8 = 1;
/// Exit status: wrong usage, or a file that can't be read, written or used.
pub(crate) const USAGE: u8 = 2;
/// Exit status: the program was stopped by a run-time fault.
pub(crate) const STOPPED: u8 = 3;

/// A command's failure, said in full: exit status 2.
#[derive(Debug)]
pub(crate) struct Failure(pub(crate) String);

impl Failure {
    /// A file that something went wrong with.
    pub(crate) fn file(path: &Path, what: impl Display) -> Self {
        Self(format!("{}: {what}", path.display()))
    }
}

impl From<String> for Failure {
    fn from(message: String) -> Self {
        Self(message)
    }
}
