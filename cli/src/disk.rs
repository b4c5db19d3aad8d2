//! Files from the disk.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use plcc_frontend::common::FileLoader;

/// The longest source that is read, in bytes. No control ever held a program of this size, and a
/// device such as `/dev/zero` has no end.
const MAX_SOURCE: u64 = 256 << 20;

/// Reads files from the disk for front ends, which do no input or output themselves.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk;

impl FileLoader for Disk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let file = File::open(existing_path(path))?;
        if file.metadata()?.is_dir() {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder"));
        }
        read_all(file)
    }

    fn list(&self, dir: &Path) -> Vec<String> {
        entries(&existing_path(dir)).map(|path| name(&path)).collect()
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
