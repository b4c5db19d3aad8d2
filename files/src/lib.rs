//! Reads and writes files so that nothing outside can hang the program: only regular files are read,
//! and no more of them than a limit; files are replaced as a whole, never half written; a FIFO is
//! opened without waiting for the other side; background writers keep others from waiting for a file. Also says in plain words why a file can't be read or
//! written.
//!
//! ```
//! use std::path::Path;
//! use plcc_files::{read_regular, why_not_read};
//!
//! let error = read_regular(Path::new("/dev/zero"), 1 << 20).unwrap_err();
//! assert!(why_not_read(&error).starts_with("it is a device"));
//! ```

mod background_writer;
mod file_lock;

use std::fs::{self, File, FileType, Metadata, OpenOptions, Permissions};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

pub use background_writer::{BackgroundWriter, Next, Retry, UNTIL_WOKEN, Unfinished};
pub use file_lock::{LockError, has_name, open_locked};

/// The longest table of values over time that is read (`--stimulus`), in bytes.
pub const MAX_STIMULUS: u64 = 256 << 20;
/// The longest file of settings that is read (a machine file, a configuration), in bytes.
pub const MAX_SETTINGS: u64 = 16 << 20;

/// Why a file can't be read, as the end of a sentence about it.
pub fn why_not_read(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file or folder".into(),
        ErrorKind::PermissionDenied => "it may not be read".into(),
        ErrorKind::IsADirectory => "it is a folder".into(),
        _ => error.to_string(),
    }
}

/// Why a file can't be written, as the end of a sentence about it.
pub fn why_not_written(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "its folder does not exist".into(),
        ErrorKind::PermissionDenied => "permission is denied".into(),
        ErrorKind::IsADirectory => "it is a folder".into(),
        ErrorKind::StorageFull => "the disk is full".into(),
        ErrorKind::ReadOnlyFilesystem => "its file system can only be read".into(),
        ErrorKind::FileTooLarge => "it would be larger than files may be here".into(),
        _ => error.to_string(),
    }
}

/// All bytes of a regular file. Anything else is refused without being opened, since a device may
/// have no end, reading a FIFO waits for its other side, and opening some devices alone does
/// something (`/dev/watchdog`).
///
/// # Errors
/// When it can't be read, is not a regular file, or has more than `limit` bytes.
pub fn read_regular(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    read_at_most(open_regular(path)?, limit)
}

/// All that a stream holds: an open file, or standard input.
///
/// # Errors
/// When it can't be read, or holds more than `limit` bytes.
pub fn read_at_most(stream: impl Read, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // One byte more than allowed tells a stream that is too long, also one that never ends.
    stream.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        let message = format!("it has more than {} MiB", limit >> 20);
        return Err(io::Error::new(ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

/// Opens a regular file for reading.
///
/// # Errors
/// When it can't be opened or is not a regular file.
pub fn open_regular(path: &Path) -> io::Result<File> {
    regular(&fs::metadata(path)?)?;
    let mut options = OpenOptions::new();
    let file = without_waiting(options.read(true)).open(path)?;
    // The name may mean another file now.
    regular(&file.metadata()?)?;
    Ok(file)
}

/// Refuses what is not a regular file.
fn regular(about: &Metadata) -> io::Result<()> {
    let kind = about.file_type();
    if kind.is_file() {
        return Ok(());
    }
    if kind.is_dir() {
        return Err(io::Error::new(ErrorKind::IsADirectory, "it is a folder"));
    }
    let message = format!("it is {}; only regular files are read", special(kind));
    Err(io::Error::new(ErrorKind::InvalidInput, message))
}

/// What a file is that is neither a regular file nor a folder.
#[cfg(unix)]
fn special(kind: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    match kind {
        _ if kind.is_fifo() => "a pipe (FIFO)",
        _ if kind.is_socket() => "a socket",
        _ => "a device",
    }
}

/// What a file is that is neither a regular file nor a folder; other systems have fewer kinds.
#[cfg(not(unix))]
fn special(_: FileType) -> &'static str {
    "a device"
}

/// Has a file opened without waiting for the other side of a FIFO, and without making a terminal
/// the one of this process.
#[cfg(target_os = "linux")]
fn without_waiting(options: &mut OpenOptions) -> &mut OpenOptions {
    use rustix::fs::OFlags;
    use std::os::unix::fs::OpenOptionsExt;
    options.custom_flags((OFlags::NONBLOCK | OFlags::NOCTTY).bits() as i32)
}

/// On other systems files are opened in the usual way.
#[cfg(not(target_os = "linux"))]
fn without_waiting(options: &mut OpenOptions) -> &mut OpenOptions {
    options
}

/// Opens a file for writing: a regular file, which is created where there is none, a device, or a FIFO
/// that somebody reads. Writing begins at the end (`append`), or the file is emptied.
///
/// # Errors
/// When it can't be opened, or is a FIFO that nobody reads (opening it would wait for a reader).
pub fn open_output(path: &Path, append: bool) -> io::Result<File> {
    let mut options = OpenOptions::new();
    let options = options.write(true).create(true).append(append).truncate(!append);
    match without_waiting(options).open(path) {
        Ok(file) => {
            make_blocking(&file)?;
            Ok(file)
        }
        // A FIFO that nobody has open for reading can't be opened without waiting.
        Err(error) if is_fifo(path) => {
            let message = format!("it is a pipe (FIFO) that nobody reads ({error})");
            Err(io::Error::new(ErrorKind::InvalidInput, message))
        }
        Err(error) => Err(error),
    }
}

/// Whether a path leads to a pipe (FIFO).
#[cfg(unix)]
pub fn is_fifo(path: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    fs::metadata(path).is_ok_and(|about| about.file_type().is_fifo())
}

/// Other systems have no pipes with a path.
#[cfg(not(unix))]
pub fn is_fifo(_: &Path) -> bool {
    false
}

/// Has writes to an open file wait until they are done, which [`without_waiting`] prevents for FIFOs
/// and terminals.
#[cfg(target_os = "linux")]
fn make_blocking(file: &File) -> io::Result<()> {
    use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
    let flags = fcntl_getfl(file)?;
    Ok(fcntl_setfl(file, flags - OFlags::NONBLOCK)?)
}

#[cfg(not(target_os = "linux"))]
fn make_blocking(_: &File) -> io::Result<()> {
    Ok(())
}

/// The file that a path means in the end: links are followed, also to a file that does not exist
/// yet, and the path does not depend on the current folder.
pub fn resolve_links(path: &Path) -> PathBuf {
    let mut path = path.to_owned();
    // As many links as Linux follows.
    for _ in 0..40 {
        if let Ok(whole) = fs::canonicalize(&path) {
            return whole;
        }
        let Ok(target) = fs::read_link(&path) else { break };
        path = path.parent().unwrap_or(Path::new("")).join(target);
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    match (fs::canonicalize(folder.unwrap_or(Path::new("."))), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path,
    }
}

/// Which file a path means, so that two paths of one file are known as such: symbolic links and, where the file exists, hard
/// links are seen through.
#[derive(Clone, Debug)]
pub struct FileIdentity {
    path: PathBuf,
    inode: Option<(u64, u64)>,
}

impl FileIdentity {
    /// The file of a path, which need not exist yet.
    #[must_use]
    pub fn of(path: &Path) -> Self {
        let path = resolve_links(path);
        let inode = fs::metadata(&path).ok().as_ref().and_then(inode_of);
        Self { path, inode }
    }

    /// Whether both are the same file.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        self.path == other.path || self.inode.is_some() && self.inode == other.inode
    }
}

/// The device and the number of a file on it, by which hard links are recognised.
#[cfg(unix)]
fn inode_of(about: &Metadata) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    Some((about.dev(), about.ino()))
}

#[cfg(not(unix))]
fn inode_of(_: &Metadata) -> Option<(u64, u64)> {
    None
}

/// How many attempts are made to replace a file while another process replaces it too.
const REPLACE_ATTEMPTS: u32 = 200;
/// The pause between two of these attempts.
const REPLACE_PAUSE: Duration = Duration::from_millis(5);

/// The temporary file that [`replace`] and [`can_replace`] write for this path.
pub fn temporary_of(path: &Path) -> PathBuf {
    target_and_temporary(path).1
}

/// The file that is to be replaced (where `path` is a link, the file that it points to), and the
/// temporary file beside it that is written first. Its name is always the same, so that killed
/// processes do not leave more and more of them.
fn target_and_temporary(path: &Path) -> (PathBuf, PathBuf) {
    let target = resolve_links(path);
    let mut name = target.as_os_str().to_owned();
    name.push(".tmp");
    (target, name.into())
}

/// Replaces a file as a whole, or creates it. At every moment it holds either its old contents or the
/// new ones, also when this process is killed; only a power failure may leave it with neither, since
/// nothing is synchronised with the disk. It keeps its permissions.
///
/// # Errors
/// When it can't be written or is write-protected; it then has its old contents.
pub fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let (target, temporary) = target_and_temporary(path);
    let permissions = permissions(&target)?;
    let mut file = open_temporary(&temporary)?;
    let result = permissions
        .map_or(Ok(()), |permissions| file.set_permissions(permissions))
        .and_then(|()| file.write_all(bytes))
        .and_then(|()| fs::rename(&temporary, &target));
    if result.is_err() {
        // A temporary file that can't be removed does no harm.
        let _ = fs::remove_file(&temporary);
    }
    result
}

/// Opens the temporary file, empty, for this process alone.
fn open_temporary(path: &Path) -> io::Result<File> {
    for _ in 0..REPLACE_ATTEMPTS {
        match open_locked(path) {
            Ok(file) => {
                if let Err(error) = file.set_len(0) {
                    let _ = fs::remove_file(path);
                    return Err(error);
                }
                return Ok(file);
            }
            Err(LockError::Held(_)) => thread::sleep(REPLACE_PAUSE),
            Err(LockError::Io(error)) => return Err(error),
        }
    }
    Err(io::Error::new(ErrorKind::ResourceBusy, "another process writes it"))
}

/// Checks, as far as that can be known before, that [`replace`] will be able to write a file.
///
/// # Errors
/// The error that `replace` would give.
pub fn can_replace(path: &Path) -> io::Result<()> {
    let (target, temporary) = target_and_temporary(path);
    if target.is_dir() {
        return Err(ErrorKind::IsADirectory.into());
    }
    permissions(&target)?;
    // Closed only after it is removed, so that no other process has it meanwhile.
    let _file = open_temporary(&temporary)?;
    fs::remove_file(&temporary)
}

/// The permissions of a file; `None` where there is none.
///
/// # Errors
/// When the file is write-protected.
pub fn permissions(path: &Path) -> io::Result<Option<Permissions>> {
    match fs::metadata(path).map(|about| about.permissions()) {
        Ok(permissions) if permissions.readonly() => Err(ErrorKind::PermissionDenied.into()),
        Ok(permissions) => Ok(Some(permissions)),
        Err(_) => Ok(None),
    }
}

/// Waits until the names in the folder of a file are on the medium. Where the system does not let a
/// folder be opened or synchronised, that is left to it.
///
/// # Errors
/// When the names could not be written.
pub fn sync_folder_of(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let synced = File::open(folder.unwrap_or(Path::new("."))).and_then(|folder| folder.sync_all());
    match synced {
        Err(error)
            if matches!(
                error.kind(),
                ErrorKind::PermissionDenied | ErrorKind::InvalidInput | ErrorKind::Unsupported
            ) =>
        {
            Ok(())
        }
        result => result,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_are_plain_words() {
        let missing = io::Error::from(ErrorKind::NotFound);
        assert_eq!(why_not_read(&missing), "there is no such file or folder");
        assert_eq!(why_not_written(&missing), "its folder does not exist");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn devices_and_pipes_are_refused_at_once() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = temporary.path();
        let fifo = folder.join("fifo");
        let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
        let at = rustix::fs::CWD;
        rustix::fs::mknodat(at, &fifo, rustix::fs::FileType::Fifo, mode, 0).unwrap();
        for (path, word) in [
            (Path::new("/dev/zero"), "a device"),
            (Path::new("/dev/null"), "a device"),
            (&fifo, "a pipe"),
            (folder, "a folder"),
        ] {
            let error = read_regular(path, 1 << 20).unwrap_err();
            assert!(why_not_read(&error).contains(word), "{}: {error}", path.display());
        }
        let error = open_output(&fifo, false).unwrap_err();
        assert!(why_not_written(&error).contains("nobody reads"), "{error}");
        let reader = OpenOptions::new().read(true).write(true).open(&fifo).unwrap();
        open_output(&fifo, true).unwrap().write_all(b"read").unwrap();
        drop(reader);
        let file = folder.join("file");
        fs::write(&file, [0; 100]).unwrap();
        assert_eq!(read_regular(&file, 100).unwrap().len(), 100);
        assert_eq!(read_regular(&file, 99).unwrap_err().kind(), ErrorKind::FileTooLarge);
    }

    #[test]
    fn what_cannot_be_written_is_known_before() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = temporary.path();
        assert!(can_replace(folder).is_err());
        assert!(can_replace(&folder.join("no/such/folder")).is_err());
        assert!(can_replace(&folder.join("file")).is_ok());
        assert_eq!(fs::read_dir(folder).unwrap().count(), 0);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_and_its_target_is_replaced() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = temporary.path();
        let (target, link) = (folder.join("target"), folder.join("link"));
        fs::write(&target, "old").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        replace(&link, b"new").unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read(&target).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder).unwrap().count(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn permissions_stay_and_a_protected_file_too() {
        use std::os::unix::fs::PermissionsExt;
        let temporary = tempfile::tempdir().unwrap();
        let folder = temporary.path();
        let file = folder.join("file");
        fs::write(&file, "old").unwrap();
        let mode = |mode| fs::set_permissions(&file, Permissions::from_mode(mode)).unwrap();
        mode(0o600);
        replace(&file, b"new").unwrap();
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
        mode(0o444);
        let refused = [can_replace(&file), replace(&file, b"newer")];
        for result in refused {
            assert_eq!(result.unwrap_err().kind(), ErrorKind::PermissionDenied);
        }
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder).unwrap().count(), 1);
    }
}
