//! The operations on files that a retained file is written with, one for each system call, so that
//! tests can put a storage in the place of the disk that fails, or loses power, at any of them.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

/// The largest retained file that is read, in bytes. The largest that any control writes has less
/// than a hundredth of that.
const MAX_RETAINED: u64 = 64 << 20;

/// What a retained file is written to.
pub(super) trait Storage {
    /// A file that is being written.
    type File;

    /// All bytes of a file.
    fn read(&mut self, path: &Path) -> io::Result<Vec<u8>>;

    /// Creates an empty file, which must not exist yet. It gets the permissions of the file
    /// `replaced`, if that exists, and is refused if that one is write-protected.
    fn create(&mut self, path: &Path, replaced: &Path) -> io::Result<Self::File>;

    /// Appends some of the bytes, and says how many.
    fn write(&mut self, file: &mut Self::File, bytes: &[u8]) -> io::Result<usize>;

    /// Waits until all that was written to a file is on the medium.
    fn sync(&mut self, file: &mut Self::File) -> io::Result<()>;

    /// Gives a file another name; a file that has that name already is replaced.
    fn rename(&mut self, from: &Path, to: &Path) -> io::Result<()>;

    /// Waits until the names in the folder of a file are on the medium.
    fn sync_folder_of(&mut self, path: &Path) -> io::Result<()>;

    /// Removes a file.
    fn remove(&mut self, path: &Path) -> io::Result<()>;
}

/// The files of the operating system.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disk;

impl Storage for Disk {
    type File = File;

    fn read(&mut self, path: &Path) -> io::Result<Vec<u8>> {
        plcc_files::read_regular(path, MAX_RETAINED)
    }

    fn create(&mut self, path: &Path, replaced: &Path) -> io::Result<File> {
        let permissions = plcc_files::permissions(replaced)?;
        let file = File::create_new(path)?;
        if let Some(permissions) = permissions {
            file.set_permissions(permissions)?;
        }
        Ok(file)
    }

    fn write(&mut self, file: &mut File, bytes: &[u8]) -> io::Result<usize> {
        file.write(bytes)
    }

    fn sync(&mut self, file: &mut File) -> io::Result<()> {
        file.sync_all()
    }

    fn rename(&mut self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    fn sync_folder_of(&mut self, path: &Path) -> io::Result<()> {
        plcc_files::sync_folder_of(path)
    }

    fn remove(&mut self, path: &Path) -> io::Result<()> {
        fs::remove_file(path)
    }
}
