//! Replacing files so that they are never half written.

use std::fs::{self, File, Permissions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Whether a file is to be on the disk, or the system may take its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Durable {
    /// It must be there after a power cut.
    Yes,
    /// It need not.
    No,
}

/// The file that is written before it takes another's place. Where that is a link, the place is
/// what it points to.
fn places(path: &Path) -> (PathBuf, PathBuf) {
    let place = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let mut name = place.as_os_str().to_owned();
    name.push(format!(".{}.tmp", std::process::id()));
    (place, name.into())
}

/// Puts a file in another's place: either the old one is there, or the new one, whole. Who may do
/// what with it stays; one that nobody may write is not replaced.
///
/// # Errors
/// When it can't be written; the old one then is there still.
pub fn replace(path: &Path, bytes: &[u8], durable: Durable) -> io::Result<()> {
    let (place, temporary) = places(path);
    let result = write_and_rename(&temporary, &place, bytes, durable);
    if result.is_err() {
        // It is of no use to anybody; that it can't be removed changes nothing.
        let _ = fs::remove_file(&temporary);
    }
    result
}

/// Whether [`replace`] will be able to write, as far as that is known before.
///
/// # Errors
/// The error that it would give.
pub fn can_replace(path: &Path) -> io::Result<()> {
    let (place, temporary) = places(path);
    if place.is_dir() {
        return Err(ErrorKind::IsADirectory.into());
    }
    permissions(&place)?;
    File::create(&temporary)?;
    fs::remove_file(&temporary)
}

/// Who may do what with a file, where there is one.
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
    // The rename is to be on the disk too. Not every system lets a folder be opened for that.
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
