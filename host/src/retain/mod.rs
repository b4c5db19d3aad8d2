//! The retained file (`--retain FILE`), which holds the data that survives power-off.
//!
//! There are two copies, `FILE` and `FILE.bak`. Each write makes a new generation of both, `FILE`
//! first. A copy is never half written: its new bytes are written to `FILE.new` and forced to the
//! medium; then that file takes the old copy's name, and the folder is forced to the medium. So
//! whenever the power fails, one of the two copies at least is whole, and it holds the newest
//! generation whose writing was finished, or a newer one. Where an operation fails, everything is
//! written again to a new file: the operating system may have dropped what it could not write.
//!
//! `FILE.lock` is locked as long as a process uses the file (see `lock`). `FILE.old` holds what
//! another program had left, where this one could not take all of it.
//!
//! ```
//! use plcc_abi::Dialect;
//! use plcc_host::retain::RetainedFile;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let path = std::env::temp_dir().join(format!("plcc-retain-doc-{}", std::process::id()));
//! let mut file = RetainedFile::open(&path, Dialect::Pmi)?;
//! assert!(file.load()?.is_none(), "nothing was saved yet");
//! file.store(b"what the executive gave")?;
//! let saved = file.load()?.ok_or("it was saved")?;
//! assert_eq!((saved.generation, saved.payload.len()), (1, 23));
//! # std::fs::remove_file(&path)?;
//! # std::fs::remove_file(path.with_extension("bak"))?;
//! # Ok(())
//! # }
//! ```

mod format;
mod lock;
mod storage;

#[cfg(test)]
mod crash_states;
#[cfg(test)]
mod tests;

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use plcc_abi::Dialect;
use thiserror::Error;

pub use format::{SavedState, decode, encode};
use lock::{Lock, process_named_in};
use plcc_files::LockError;
use plcc_files::{resolve_links, why_not_read, why_not_written};
use storage::{Disk, Storage};

/// How often an operation is tried that a signal interrupts.
const MAX_INTERRUPTIONS: u32 = 100;

/// What is found in a retained file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Retained {
    /// The bytes that [`Executive::retained`](plcc_runtime::Executive::retained) gave.
    pub payload: Vec<u8>,
    /// How many states were saved up to this one; 0 in files of earlier versions of plcc.
    pub generation: u64,
    /// What is wrong with one of the two copies, a sentence each.
    pub warnings: Vec<String>,
}

/// Why a retained file can't be used.
#[derive(Debug, Error)]
pub enum RetainError {
    /// Neither it nor its copy is whole.
    #[error(
        "{path} can't be used as the retained file ({why}), nor can its copy {copy} ({copy_why}); if \
         --retain names the right file, put back a saved copy, or remove both to begin with nothing \
         retained"
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Why it can't be used.
        why: String,
        /// Its copy.
        copy: PathBuf,
        /// Why the copy can't be used.
        copy_why: String,
    },
    /// It is of another language, whose name is given.
    #[error("the retained file {0} belongs to a program in another language ({1})")]
    Foreign(PathBuf, &'static str),
    /// Another process uses it.
    #[error("the retained file {path} is in use by {}; name another file", named_process(*.process))]
    Locked {
        /// The file.
        path: PathBuf,
        /// The number of the process, where it is known.
        process: Option<u32>,
    },
    /// It can't be read.
    #[error("the retained file {path} can't be read: {}", why_not_read(.source))]
    Read {
        /// The file, or its copy.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// It can't be written.
    #[error("the retained file {path} can't be written: {}", why_not_written(.source))]
    Write {
        /// The file, or one of those beside it.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
}

fn named_process(number: Option<u32>) -> String {
    number.map_or_else(|| "another process".into(), |number| format!("process {number}"))
}

/// A file beside `path`, with more after its name.
fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    name.into()
}

/// The files that are written beside a retained file, each with what it is for.
pub fn files_beside(path: &Path) -> [(&'static str, PathBuf); 4] {
    let path = resolve_links(path);
    [
        ("--retain's copy", beside(&path, ".bak")),
        ("--retain's lock", beside(&path, ".lock")),
        ("--retain's new contents", beside(&path, ".new")),
        ("--retain's old contents", beside(&path, ".old")),
    ]
}

/// A retained file that this process alone uses.
#[derive(Debug)]
pub struct RetainedFile {
    lock: Lock,
    copies: Copies<Disk>,
}

impl RetainedFile {
    /// Locks the retained file of a control of the language `dialect`. It need not exist yet; its
    /// folder must. What `path` links to is used in its place.
    ///
    /// # Errors
    /// When another process uses it, or the folder can't be written.
    pub fn open(path: &Path, dialect: Dialect) -> Result<Self, RetainError> {
        let copies = Copies::new(resolve_links(path), dialect, Disk);
        let lock = Lock::take(&beside(&copies.path, ".lock"));
        let lock = lock.map_err(|error| locked(&copies.path, error))?;
        Ok(Self { lock, copies })
    }

    /// Reads what was saved last; `None` where there is neither the file nor its copy.
    ///
    /// # Errors
    /// When it can't be read, is of another language, or neither it nor its copy is whole.
    pub fn load(&mut self) -> Result<Option<Retained>, RetainError> {
        self.copies.load()
    }

    /// Writes the next generation of the file and of its copy, and waits until both are on the
    /// medium.
    ///
    /// # Errors
    /// When one can't be written; what was there is whole still, and `store` may be called again.
    pub fn store(&mut self, payload: &[u8]) -> Result<(), RetainError> {
        self.lock.renew().map_err(|error| locked(&self.copies.path, error))?;
        self.copies.store(payload)
    }

    /// Writes what the file, or its copy, holds now to `FILE.old` and gives its path.
    ///
    /// # Errors
    /// When it can't be read or written.
    pub fn keep_old(&mut self) -> Result<PathBuf, RetainError> {
        self.copies.keep_old()
    }
}

fn locked(path: &Path, error: LockError) -> RetainError {
    match error {
        LockError::Held(file) => {
            RetainError::Locked { path: path.to_owned(), process: process_named_in(file) }
        }
        LockError::Io(source) => RetainError::Write { path: path.to_owned(), source },
    }
}

/// The two copies of the retained data in a storage.
#[derive(Debug)]
struct Copies<S> {
    path: PathBuf,
    copy: PathBuf,
    dialect: Dialect,
    storage: S,
    /// The last generation that was read or that writing was begun of.
    generation: u64,
}

impl<S: Storage> Copies<S> {
    fn new(path: PathBuf, dialect: Dialect, storage: S) -> Self {
        let copy = beside(&path, ".bak");
        Self { path, copy, dialect, storage, generation: 0 }
    }

    /// The bytes of one of the files; `None` where it is missing.
    fn read(&mut self, path: &Path) -> Result<Option<Vec<u8>>, RetainError> {
        match uninterrupted(|| self.storage.read(path)) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(source) => Err(RetainError::Read { path: path.to_owned(), source }),
        }
    }

    fn load(&mut self) -> Result<Option<Retained>, RetainError> {
        let (path, copy) = (self.path.clone(), self.copy.clone());
        let decoded = |bytes: Option<Vec<u8>>| match bytes {
            Some(bytes) => decode(&bytes),
            None => Err("it is missing".into()),
        };
        let first = self.read(&path)?;
        // The copy is there for the case that the file can't be used, so it must not prevent its use.
        let second = self.read(&copy);
        if first.is_none() && matches!(second, Ok(None)) {
            return Ok(None);
        }
        let first = decoded(first);
        let second = second.map_err(|error| error.to_string()).and_then(decoded);
        let (shown, copy_shown) = (path.display(), copy.display());
        let mut warnings = vec![];
        let known = [&first, &second].into_iter().flatten().map(|state| state.generation).max();
        let state: SavedState = match (first, second) {
            (Ok(state), Ok(other)) => {
                if other.generation > state.generation {
                    warnings.push(format!(
                        "the retained file {shown} is older than its copy {copy_shown} \
                         (generations {} and {}); the file is used, as if it had been put back on \
                         purpose",
                        state.generation, other.generation
                    ));
                }
                state
            }
            (Ok(state), Err(why)) => {
                warnings.push(format!(
                    "the copy {copy_shown} of the retained file can't be used: {why}; the file \
                     itself is whole and is used"
                ));
                state
            }
            (Err(why), Ok(state)) => {
                warnings.push(format!(
                    "the copy of the retained file {shown} is used, since the file itself can't \
                     be: {why}"
                ));
                state
            }
            (Err(why), Err(copy_why)) => {
                return Err(RetainError::Damaged { path, why, copy, copy_why });
            }
        };
        if state.dialect != self.dialect {
            return Err(RetainError::Foreign(path, state.dialect.name()));
        }
        self.generation = self.generation.max(known.unwrap_or(0));
        Ok(Some(Retained { payload: state.payload, generation: state.generation, warnings }))
    }

    fn store(&mut self, payload: &[u8]) -> Result<(), RetainError> {
        self.generation = self.generation.saturating_add(1);
        let bytes = encode(self.generation, self.dialect, payload);
        for path in [self.path.clone(), self.copy.clone()] {
            self.replace(&path, &bytes).map_err(|source| RetainError::Write { path, source })?;
        }
        Ok(())
    }

    fn keep_old(&mut self) -> Result<PathBuf, RetainError> {
        let old = beside(&self.path, ".old");
        for path in [self.path.clone(), self.copy.clone()] {
            if let Some(bytes) = self.read(&path)?
                && decode(&bytes).is_ok()
            {
                return match self.replace(&old, &bytes) {
                    Ok(()) => Ok(old),
                    Err(source) => Err(RetainError::Write { path: old, source }),
                };
            }
        }
        let source = io::Error::from(ErrorKind::NotFound);
        Err(RetainError::Read { path: self.path.clone(), source })
    }

    /// Replaces a file as a whole, and waits until that is on the medium.
    fn replace(&mut self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        let storage = &mut self.storage;
        let new = beside(&self.path, ".new");
        // What a process that was killed, or an attempt that failed, has left behind. It is not
        // written over: after a failed `sync` the system may hold bytes of it that it never writes.
        match uninterrupted(|| storage.remove(&new)) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let mut file = uninterrupted(|| storage.create(&new, path))?;
        let written = write_all(storage, &mut file, bytes)
            .and_then(|()| uninterrupted(|| storage.sync(&mut file)));
        drop(file);
        let renamed = written.and_then(|()| uninterrupted(|| storage.rename(&new, path)));
        if let Err(error) = renamed {
            // A file that can't be removed now is removed before the next attempt.
            let _ = storage.remove(&new);
            return Err(error);
        }
        uninterrupted(|| storage.sync_folder_of(path))
    }
}

/// Writes all bytes, however many are taken at a time.
fn write_all<S: Storage>(storage: &mut S, file: &mut S::File, mut bytes: &[u8]) -> io::Result<()> {
    while !bytes.is_empty() {
        let written = uninterrupted(|| storage.write(file, bytes))?;
        bytes = match bytes.get(written..) {
            Some(rest) if written > 0 => rest,
            _ => return Err(ErrorKind::WriteZero.into()),
        };
    }
    Ok(())
}

/// Does an operation, and again where a signal has interrupted it.
fn uninterrupted<T>(mut operation: impl FnMut() -> io::Result<T>) -> io::Result<T> {
    for _ in 0..MAX_INTERRUPTIONS {
        match operation() {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            result => return result,
        }
    }
    operation()
}

/// Checks that a retained file can be written, as far as that can be known before.
///
/// # Errors
/// When it is a folder or a device, or is write-protected.
pub(crate) fn can_be_written(path: &Path) -> io::Result<()> {
    match std::fs::metadata(path) {
        Ok(about) if about.is_dir() => Err(ErrorKind::IsADirectory.into()),
        Ok(about) if !about.is_file() => {
            Err(io::Error::new(ErrorKind::InvalidInput, "it is not a regular file"))
        }
        _ => plcc_files::can_replace(path),
    }
}
