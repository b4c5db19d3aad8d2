//! Where included files come from.

use std::{
    collections::BTreeMap,
    io,
    path::{Component, Path, PathBuf},
};

/// Reads files for a front end, which does no IO itself.
pub trait FileLoader {
    /// The bytes of the file at `path`.
    ///
    /// # Errors
    /// Whatever keeps the file from being read; a folder is an error too.
    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;

    /// The names of all entries of the folder `dir`, in any order; none if it cannot be read. An
    /// empty path is the current folder. The names are needed to find a file that is written in
    /// other capital or small letters.
    fn list(&self, dir: &Path) -> Vec<String>;
}

/// Files held in memory, for tests and for sources that include nothing.
#[derive(Clone, Debug, Default)]
pub struct MemoryLoader {
    files: BTreeMap<PathBuf, Vec<u8>>,
}

impl MemoryLoader {
    /// No files.
    pub fn new() -> Self {
        Self::default()
    }

    /// The same with one more file.
    #[must_use]
    pub fn with(mut self, path: impl Into<PathBuf>, bytes: impl Into<Vec<u8>>) -> Self {
        self.files.insert(normalised(&path.into()), bytes.into());
        self
    }
}

/// The path without `.`, and without `..` after the name of a folder.
fn normalised(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if out.file_name().is_some() => {
                out.pop();
            }
            other => out.push(other),
        }
    }
    out
}

impl FileLoader for MemoryLoader {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        self.files.get(&normalised(path)).cloned().ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    fn list(&self, dir: &Path) -> Vec<String> {
        let dir = normalised(dir);
        let mut names: Vec<String> = self
            .files
            .keys()
            .filter_map(|path| path.strip_prefix(&dir).ok()?.components().next())
            .map(|part| part.as_os_str().to_string_lossy().into_owned())
            .collect();
        names.dedup();
        names
    }
}
