//! Files from the disk.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use plcc_frontend::common::FileLoader;

/// The longest source that is read, in bytes: no control ever held a program of this size, and a
/// device may have no end at all.
const MAX_SOURCE: u64 = 256 << 20;

/// Reads what front ends include.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk;

impl FileLoader for Disk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let file = File::open(real(path))?;
        if file.metadata()?.is_dir() {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder"));
        }
        read_all(file)
    }

    fn list(&self, dir: &Path) -> Vec<String> {
        entries(&real(dir)).map(|path| name(&path)).collect()
    }
}

/// All bytes of a source.
///
/// # Errors
/// When they can't be read, or there are more of them than any source has.
pub(crate) fn read_all(source: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    source.take(MAX_SOURCE + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_SOURCE {
        let message = format!("it has more than {} MiB", MAX_SOURCE >> 20);
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

/// A file's name as text, with U+FFFD for what is none.
fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn entries(dir: &Path) -> impl Iterator<Item = PathBuf> {
    let dir = if dir.as_os_str().is_empty() { Path::new(".") } else { dir };
    fs::read_dir(dir).into_iter().flatten().flatten().map(|entry| entry.path())
}

/// The path that a path means. Sources are known by their names as text, so where those have a
/// U+FFFD, files are found by what their names look like as text.
pub(crate) fn real(path: &Path) -> PathBuf {
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
