//! Programs that are written in small letters throughout, where PMI's names and keywords are in capitals.

use plcc_diag::{Diagnostic, FileId};

use crate::common::whole_program_is_small;

/// Of a file whose program is written in small letters throughout, keeps the first error about them alone, with a note.
/// `text` is the file's text.
pub(crate) fn tell_small_letters_once(file: FileId, text: &str, diagnostics: &mut Vec<Diagnostic>) {
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
    let is_small = |diagnostic: &Diagnostic| {
        let at = text.get(diagnostic.span.range()).unwrap_or("");
        diagnostic.code == "PMI-5"
            && diagnostic.span.file == file
            && at.starts_with(|c: char| c.is_ascii_lowercase())
    };
    let others = diagnostics.iter().filter(|diagnostic| is_small(diagnostic)).count();
    let Some(others) = others.checked_sub(1).filter(|_| small > 9 * capital) else { return };
    let mut is_told = false;
    diagnostics.retain_mut(|diagnostic| {
        if !is_small(diagnostic) {
            return true;
        }
        if !std::mem::replace(&mut is_told, true) {
            diagnostic.add_note(whole_program_is_small(others));
            return true;
        }
        false
    });
}
