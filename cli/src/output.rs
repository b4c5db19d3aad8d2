//! Files that a command writes.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use plcc_diag::{FileId, SourceMap};
use plcc_runtime::session::write_whole;

use crate::failure::Failure;

/// Writes text or bytes to standard output.
pub(crate) fn print(bytes: &[u8]) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    out.write_all(bytes)?;
    out.flush()?;
    Ok(())
}

/// Writes a whole file, or standard output for `-`. The file is either the old or the new one
/// afterwards, whatever happens meanwhile, and never one of the sources.
pub(crate) fn write(path: &Path, bytes: &[u8], sources: &SourceMap) -> Result<(), Failure> {
    if path.as_os_str() == "-" {
        return print(bytes);
    }
    if path.is_dir() {
        return Err(Failure::file(path, "it is a folder; -o names a file"));
    }
    if let Ok(real) = fs::canonicalize(path) {
        let own = (0..sources.len() as u32).map(|id| sources.path(FileId(id)));
        if own.into_iter().any(|own| fs::canonicalize(own).is_ok_and(|own| own == real)) {
            return Err(Failure::file(path, "it is a source; it is not overwritten"));
        }
    }
    write_whole(path, bytes)
        .map_err(|error| Failure::Usage(format!("it can't be written: {error}")))
}
