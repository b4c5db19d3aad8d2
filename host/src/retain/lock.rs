//! A lock that keeps two processes from using one retained file at the same time.
//!
//! The lock is on a file of its own, `FILE.lock`, since the retained file itself is replaced at each
//! write. The lock file holds the number of the process, for people. It is removed at the end; one
//! that a killed process has left behind is taken over by the next one.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use plcc_files::{LockError, has_name, open_locked};

/// A lock that this process has.
#[derive(Debug)]
pub(super) struct Lock {
    path: PathBuf,
    file: File,
}

impl Lock {
    /// Takes the lock whose file is `path`.
    ///
    /// # Errors
    /// When another process has it, or the lock file can't be written.
    pub(super) fn take(path: &Path) -> Result<Self, LockError> {
        let mut file = open_locked(path)?;
        // The number is for people only; on a full disk it is missing.
        let _ = write_process_id(&mut file);
        Ok(Self { path: path.to_owned(), file })
    }

    /// Sees that this process has the lock still: where the folder has vanished and come back (a
    /// file system that was unmounted), the lock is taken again.
    ///
    /// # Errors
    /// When another process has it meanwhile, or the lock file can't be written.
    pub(super) fn renew(&mut self) -> Result<(), LockError> {
        if !has_name(&self.file, &self.path) {
            *self = Self::take(&self.path)?;
        }
        Ok(())
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        if has_name(&self.file, &self.path) {
            // A lock file that can't be removed does no harm.
            let _ = fs::remove_file(&self.path);
        }
    }
}

fn write_process_id(file: &mut File) -> io::Result<()> {
    file.set_len(0)?;
    file.seek(SeekFrom::Start(0))?;
    writeln!(file, "{}", std::process::id())
}

/// The number of the process that a lock file names.
pub(super) fn process_named_in(lock_file: File) -> Option<u32> {
    let mut text = String::new();
    lock_file.take(32).read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_lock_has_one_owner_and_leaves_nothing_behind() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = temporary.path();
        let path = folder.join("kept.lock");
        fs::write(&path, "a killed process has left this behind").unwrap();
        let mut lock = Lock::take(&path).unwrap();
        let Err(LockError::Held(file)) = Lock::take(&path) else { panic!("it is taken twice") };
        assert_eq!(process_named_in(file), Some(std::process::id()));
        fs::remove_dir_all(folder).unwrap();
        assert!(lock.renew().is_err(), "there is no folder");
        fs::create_dir_all(folder).unwrap();
        lock.renew().unwrap();
        assert!(Lock::take(&path).is_err());
        drop(lock);
        assert_eq!(fs::read_dir(folder).unwrap().count(), 0);
    }
}
