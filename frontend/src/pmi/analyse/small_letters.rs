//! Programs that are written in small letters throughout, where PMI's names and keywords are in capitals.

use plcc_diag::{Diagnostic, FileId};

use crate::common;

/// Of a file whose program is written in small letters throughout, keeps the first error about them alone, with a note.
/// `text` is the file's text.
pub(crate) fn tell_small_letters_once(file: FileId, text: &str, diagnostics: &mut Vec<Diagnostic>) {
    if diagnostics.is_empty() {
        return;
    }
    let code = text.lines().map(|line| line.split('?').next().unwrap_or(""));
    let code = code.flat_map(|line| line.split('"').step_by(2)).flat_map(str::bytes);
    let is_small = |diagnostic: &Diagnostic| {
        let at = text.get(diagnostic.span.range()).unwrap_or("");
        diagnostic.code == "PMI-5"
            && diagnostic.span.file == file
            && at.starts_with(|c: char| c.is_ascii_lowercase())
    };
    common::tell_small_letters_once(code, diagnostics, is_small, |_| false);
}
