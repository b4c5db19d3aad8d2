//! Opens a file so that one process alone has it open for writing, by an advisory lock of the
//! operating system. The system gives the lock back when the process ends, however it ends.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind};
use std::path::Path;

use thiserror::Error;

/// How often a file is opened at most, when each time its name was given to another file before it could
/// be locked.
const MAX_ATTEMPTS: u32 = 100;

/// Why a file can't be opened and locked.
#[derive(Debug, Error)]
pub enum LockError {
    /// Another process has locked it. The file is open for reading.
    #[error("another process uses it")]
    Held(File),
    /// It can't be opened.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// Opens a file, or creates it empty, and locks it. Its contents stay as they are.
///
/// # Errors
/// When another process has locked it, or it can't be opened for writing. On a file system without
/// locks the file is opened without one.
pub fn open_locked(path: &Path) -> Result<File, LockError> {
    for _ in 0..MAX_ATTEMPTS {
        let mut options = OpenOptions::new();
        let file = options.read(true).write(true).create(true).truncate(false).open(path)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(LockError::Held(file)),
            Err(TryLockError::Error(error)) if error.kind() == ErrorKind::Unsupported => {}
            Err(TryLockError::Error(error)) if error.kind() == ErrorKind::Interrupted => continue,
            Err(TryLockError::Error(error)) => return Err(error.into()),
        }
        // Between our opening and our locking it, its owner may have removed or renamed it. Then the
        // name means another file now, or none.
        if has_name(&file, path) {
            return Ok(file);
        }
    }
    Err(LockError::Io(ErrorKind::ResourceBusy.into()))
}

/// Whether an open file is the one that has this name now.
#[cfg(unix)]
pub fn has_name(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (file.metadata(), fs::symlink_metadata(path)) {
        (Ok(open), Ok(named)) => (open.dev(), open.ino()) == (named.dev(), named.ino()),
        _ => false,
    }
}

/// Other systems do not let a file be removed that is open.
#[cfg(not(unix))]
pub fn has_name(_: &File, path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_locked_once_until_it_is_closed_or_renamed() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = temporary.path();
        let path = folder.join("file");
        fs::write(&path, "kept").unwrap();
        let first = open_locked(&path).unwrap();
        assert!(matches!(open_locked(&path), Err(LockError::Held(_))));
        assert_eq!(fs::read(&path).unwrap(), b"kept");
        fs::rename(&path, folder.join("renamed")).unwrap();
        assert!(!has_name(&first, &path));
        let second = open_locked(&path).unwrap();
        assert!(matches!(open_locked(&folder.join("renamed")), Err(LockError::Held(_))));
        drop((first, second));
        assert!(open_locked(&path).is_ok());
    }
}
