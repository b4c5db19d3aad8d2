//! Programs that are written in small letters throughout, where PMI's names and keywords are in capitals.

use plcc_diag::{Diagnostic, FileId};

/// Adds a note to the first error of a file whose program is written in small letters throughout. `text` is the
/// file's text.
pub(crate) fn note_small_letters(file: FileId, text: &str, diagnostics: &mut [Diagnostic]) {
    if diagnostics.is_empty() {
        return;
    }
    let code = text.lines().map(|line| line.split('?').next().unwrap_or(""));
    let letters = code.flat_map(|line| line.split('"').step_by(2)).flat_map(str::bytes);
    let (mut small, mut capital) = (0_usize, 0_usize);
    for letter in letters {
        small += usize::from(letter.is_ascii_lowercase());
        capital += usize::from(letter.is_ascii_uppercase());
    }
    let is_small = |diagnostic: &&mut Diagnostic| {
        let at = text.get(diagnostic.span.range()).unwrap_or("");
        diagnostic.code == "PMI-5"
            && diagnostic.span.file == file
            && at.starts_with(|c: char| c.is_ascii_lowercase())
    };
    if small > 9 * capital
        && let Some(first) = diagnostics.iter_mut().find(is_small)
    {
        first.add_note(
            "the whole program is in small letters; `tr a-z A-Z < FILE` writes it in capitals"
                .to_owned(),
        );
    }
}
