//! Files from the disk.

use std::fs;
use std::io;
use std::path::Path;

use plcc_frontend::common::FileLoader;

/// The longest source that is read, in bytes.
const MAX_SOURCE: u64 = 256 << 20;

/// Reads what front ends include.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk;

impl FileLoader for Disk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let meta = fs::metadata(path)?;
        if meta.is_dir() {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder"));
        }
        if meta.len() > MAX_SOURCE {
            let message = format!("it has more than {} MiB", MAX_SOURCE >> 20);
            return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
        }
        fs::read(path)
    }

    fn list(&self, dir: &Path) -> Vec<String> {
        let dir = if dir.as_os_str().is_empty() { Path::new(".") } else { dir };
        fs::read_dir(dir)
            .into_iter()
            .flatten()
            .flatten()
            .filter_map(|entry| entry.file_name().into_string().ok())
            .collect()
    }
}
