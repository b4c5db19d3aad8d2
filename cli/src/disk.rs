//! Files from the disk.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use plcc_files::read_regular;
use plcc_frontend::common::FileLoader;

/// The longest source that is read, in bytes. No control ever held a program of this size.
pub(crate) const MAX_SOURCE: u64 = 256 << 20;

/// Reads regular files from the disk for front ends, which do no input or output themselves.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk;

impl FileLoader for Disk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        read_regular(&existing_path(path), MAX_SOURCE)
    }

    fn list(&self, dir: &Path) -> Vec<String> {
        entries(&existing_path(dir)).map(|path| name(&path)).collect()
    }
}

/// Reads the files below some folders alone, so that a source from elsewhere can't have other files
/// of the computer shown in its diagnostics. Links that lead out of the folders are not followed,
/// since they may have come with the source.
#[derive(Clone, Debug)]
pub(crate) struct Below {
    /// The folders, without links.
    folders: Vec<PathBuf>,
}

impl Below {
    /// The files below these folders and below the current one, unless that is the root of the file
    /// system.
    pub(crate) fn new<'a>(folders: impl Iterator<Item = &'a PathBuf>) -> Self {
        let current = fs::canonicalize(".").ok().filter(|folder| folder.parent().is_some());
        let folders = folders.filter_map(|folder| fs::canonicalize(existing_path(folder)).ok());
        Self { folders: folders.chain(current).collect() }
    }

    fn holds(&self, path: &Path) -> bool {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        let place = fs::canonicalize(existing_path(path));
        place.is_ok_and(|place| self.folders.iter().any(|folder| place.starts_with(folder)))
    }
}

impl FileLoader for Below {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        if self.holds(path) { Disk.read(path) } else { Err(ErrorKind::PermissionDenied.into()) }
    }

    fn list(&self, dir: &Path) -> Vec<String> {
        if self.holds(dir) { Disk.list(dir) } else { vec![] }
    }
}

/// A file's name as text, with U+FFFD for what is none.
fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn entries(dir: &Path) -> impl Iterator<Item = PathBuf> {
    let dir = if dir.as_os_str().is_empty() { Path::new(".") } else { dir };
    fs::read_dir(dir).into_iter().flatten().flatten().map(|entry| entry.path())
}

/// The path of the file that a source's name stands for. Names of sources are text, in which U+FFFD
/// stands for what is not UTF-8; such a name stands for the file whose name looks like it as text.
pub(crate) fn existing_path(path: &Path) -> PathBuf {
    if path.to_str().is_some_and(|text| !text.contains('\u{fffd}')) || path.exists() {
        return path.to_owned();
    }
    let mut found = PathBuf::new();
    for part in path.components() {
        let next = found.join(part);
        let text = name(Path::new(&part));
        let meant = (!next.exists()).then(|| entries(&found).find(|entry| name(entry) == text));
        found = meant.flatten().unwrap_or(next);
    }
    found
}
