//! Replaces files so that they are never half written, and says in plain words why a file can't be
//! read or written.

use std::fs::{self, File, Permissions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

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
        _ => error.to_string(),
    }
}

/// Whether the contents of a file must be on the disk when it has been written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Durable {
    /// They are, so that they survive a power cut from then on.
    Yes,
    /// The operating system writes them when it likes.
    No,
}

/// The file that is to be replaced (where `path` is a link, the file that it points to), and the
/// temporary file beside it that is written first.
fn target_and_temporary(path: &Path) -> (PathBuf, PathBuf) {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let mut name = target.as_os_str().to_owned();
    name.push(format!(".{}.tmp", std::process::id()));
    (target, name.into())
}

/// Replaces a file as a whole, or creates it. Whatever happens meanwhile, it holds either its old
/// contents or the new ones. It keeps its permissions.
///
/// # Errors
/// When it can't be written or is write-protected; it then has its old contents.
pub fn replace(path: &Path, bytes: &[u8], durable: Durable) -> io::Result<()> {
    let (target, temporary) = target_and_temporary(path);
    let result = write_and_rename(&temporary, &target, bytes, durable);
    if result.is_err() {
        // A temporary file that can't be removed does no harm.
        let _ = fs::remove_file(&temporary);
    }
    result
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
    File::create(&temporary)?;
    fs::remove_file(&temporary)
}

/// The permissions of a file; `None` where there is none.
///
/// # Errors
/// When the file is write-protected.
fn permissions(place: &Path) -> io::Result<Option<Permissions>> {
    match fs::metadata(place).map(|about| about.permissions()) {
        Ok(permissions) if permissions.readonly() => Err(ErrorKind::PermissionDenied.into()),
        Ok(permissions) => Ok(Some(permissions)),
        Err(_) => Ok(None),
    }
}

fn write_and_rename(
    temporary: &Path,
    place: &Path,
    bytes: &[u8],
    durable: Durable,
) -> io::Result<()> {
    let permissions = permissions(place)?;
    let mut file = File::create(temporary)?;
    if let Some(permissions) = permissions {
        file.set_permissions(permissions)?;
    }
    file.write_all(bytes)?;
    if durable == Durable::Yes {
        file.sync_all()?;
    }
    drop(file);
    fs::rename(temporary, place)?;
    let folder = place.parent().filter(|folder| !folder.as_os_str().is_empty());
    // The folder is written to the disk too, since the new name stands there. Not every system lets a
    // folder be opened for that.
    if durable == Durable::Yes
        && let Ok(folder) = File::open(folder.unwrap_or(Path::new(".")))
    {
        folder.sync_all()?;
    }
    Ok(())
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

    #[test]
    fn what_cannot_be_written_is_known_before() {
        let folder = std::env::temp_dir().join(format!("plcc-files-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        assert!(can_replace(&folder).is_err());
        assert!(can_replace(&folder.join("no/such/folder")).is_err());
        assert!(can_replace(&folder.join("file")).is_ok());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_and_its_target_is_replaced() {
        let folder = std::env::temp_dir().join(format!("plcc-links-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let (target, link) = (folder.join("target"), folder.join("link"));
        fs::write(&target, "old").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        replace(&link, b"new", Durable::No).unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read(&target).unwrap(), b"new");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn permissions_stay_and_a_protected_file_too() {
        use std::os::unix::fs::PermissionsExt;
        let folder = std::env::temp_dir().join(format!("plcc-modes-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let file = folder.join("file");
        fs::write(&file, "old").unwrap();
        let mode = |mode| fs::set_permissions(&file, Permissions::from_mode(mode)).unwrap();
        mode(0o600);
        replace(&file, b"new", Durable::No).unwrap();
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
        mode(0o444);
        let refused = [can_replace(&file), replace(&file, b"newer", Durable::No)];
        for result in refused {
            assert_eq!(result.unwrap_err().kind(), ErrorKind::PermissionDenied);
        }
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(&folder).unwrap();
    }
}
