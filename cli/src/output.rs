//! Writes the results of commands, to files or to standard output.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use plcc_diag::{FileId, SourceMap};
use plcc_files::why_not_written;
use plcc_host::session::write_whole;

use crate::disk::existing_path;
use crate::failure::Failure;

/// Writes text or bytes to standard output. That its reader has closed it (`plcc … | head`) is not an
/// error.
pub(crate) fn print(bytes: &[u8]) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    unless_closed(out.write_all(bytes).and_then(|()| out.flush()))
}

/// The failure of writing to standard output, unless its reader has closed it.
pub(crate) fn unless_closed(result: io::Result<()>) -> Result<(), Failure> {
    match result {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            let why = why_not_written(&error);
            Err(Failure::usage(format!("standard output can't be written: {why}")))
        }
        _ => Ok(()),
    }
}

/// Whether a path means standard output.
pub(crate) fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Writes a file as a whole, or standard output for `-`. Whatever happens meanwhile, the file holds
/// either its old contents or the new ones.
///
/// # Errors
/// When it can't be written, or is one of the `sources` or of the other files that were read.
pub(crate) fn write(
    path: &Path,
    bytes: &[u8],
    sources: &SourceMap,
    also_read: &[PathBuf],
) -> Result<(), Failure> {
    if is_stdout(path) {
        return print(bytes);
    }
    if path.is_dir() {
        return Err(Failure::file(path, "it is a folder; -o has to name a file"));
    }
    if let Ok(place) = fs::canonicalize(path) {
        let own =
            (0..sources.len() as u32).map(|id| existing_path(Path::new(sources.path(FileId(id)))));
        let mut own = own.chain(also_read.iter().cloned());
        if own.any(|own| fs::canonicalize(own).is_ok_and(|own| own == place)) {
            return Err(Failure::file(
                path,
                "it was read for this program and is not overwritten; -o has to name another file",
            ));
        }
    }
    // What a link points to is replaced, not the link.
    let place = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    write_whole(&place, bytes).map_err(|error| Failure::usage(format!("-o: {error}")))
}
