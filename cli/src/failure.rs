//! Why a command could not do its work.

use std::fmt::Display;
use std::io;
use std::path::Path;

/// Exit status: done.
pub(crate) const DONE: u8 = 0;
/// Exit status: the source has errors.
pub(crate) const ERRORS: u8 = 1;
/// Exit status: wrong usage, or a file that can't be read, written or used.
pub(crate) const USAGE: u8 = 2;
/// Exit status: the program was stopped by a run-time fault.
pub(crate) const STOPPED: u8 = 3;

/// A command's failure.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Said in full; exit status 2.
    Usage(String),
    /// Whoever reads standard output has gone, which is no mistake of anybody's.
    Closed,
}

impl Failure {
    /// A file that something went wrong with.
    pub(crate) fn file(path: &Path, what: impl Display) -> Self {
        Self::Usage(format!("{}: {what}", path.display()))
    }
}

impl From<String> for Failure {
    fn from(message: String) -> Self {
        Self::Usage(message)
    }
}

impl From<io::Error> for Failure {
    /// An error of standard output.
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::Closed,
            _ => Self::Usage(format!("standard output: {error}")),
        }
    }
}
