//! Opens the files that a run writes to while it lasts.

use std::fs::File;
use std::io;
use std::path::Path;

use plcc_files::{is_fifo, open_output, why_not_written};

use crate::exit_status::SessionError;

/// Whether a path is `-`, which is standard output.
pub(crate) fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Opens a file that grows: at its end, or (`append` is false) emptied. In real time a FIFO is opened
/// without waiting for its reader, who may also come and go later.
///
/// # Errors
/// When it can't be written; the message names it.
pub(crate) fn open(path: &Path, append: bool, realtime: bool) -> Result<File, SessionError> {
    if is_stdout(path) {
        return standard_output().map_err(|error| not_written(path, &error));
    }
    let opened = if realtime && is_fifo(path) {
        // On Linux a FIFO that is opened for reading too has a reader, and nobody is waited for.
        File::options().read(true).write(true).open(path)
    } else {
        open_output(path, append)
    };
    opened.map_err(|error| not_written(path, &error))
}

/// Standard output as a file, without the lock and the buffer that [`io::stdout`] has: a thread that is
/// stuck in writing must not hold up the end of the process.
#[cfg(unix)]
pub(crate) fn standard_output() -> io::Result<File> {
    use std::os::fd::AsFd;
    Ok(File::from(io::stdout().as_fd().try_clone_to_owned()?))
}

#[cfg(not(unix))]
pub(crate) fn standard_output() -> io::Result<File> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Says that a file can't be written, and why.
pub(crate) fn not_written(path: &Path, error: &io::Error) -> SessionError {
    SessionError(format!("{} can't be written: {}", path.display(), why_not_written(error)))
}
