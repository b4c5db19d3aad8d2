//! Programs for Power PMAC, whose language is another one: such a file gets one error that says so,
//! in place of an error for nearly each of its lines.

use plcc_diag::{Diagnostic, FileId, SourceMap};

use crate::pmac::read::other_languages::HABITS;

/// How many errors of a download are looked at.
const LOOKED_AT: usize = 200;

/// How many bytes of a line are looked at.
const LINE: usize = 300;

/// Replaces all diagnostics of each file that is a program for Power PMAC by one error.
pub(crate) fn one_error_a_file(sources: &SourceMap, diagnostics: &mut Vec<Diagnostic>) {
    let errors = diagnostics.iter().filter(|d| d.is_error()).take(LOOKED_AT);
    let mut files: Vec<FileId> = Vec::new();
    let mut found: Vec<Diagnostic> = Vec::new();
    for error in errors {
        let file = error.span.file;
        let (line, _) = sources.line_col(file, error.span.start);
        let text = sources.line_text(file, line);
        if files.contains(&file) || !is_power_pmac(text.get(..LINE).unwrap_or(text)) {
            continue;
        }
        files.push(file);
        let message = "this is a program for Power PMAC, whose language is another one";
        let note = "variables with names, data structures such as Motor[1].JogSpeed, braces and `==` \
                    belong to Power PMAC";
        found.push(
            Diagnostic::error(error.code, error.span, message)
                .note(note)
                .help("compile programs for PMAC or Turbo PMAC (--controller turbo)"),
        );
    }
    if !files.is_empty() {
        diagnostics.retain(|d| !files.contains(&d.span.file));
        diagnostics.extend(found);
    }
}

/// Whether a line has a data structure of Power PMAC, or one of its declarations.
fn is_power_pmac(line: &str) -> bool {
    let code = line.split("//").next().unwrap_or("").to_ascii_lowercase();
    let mut words = code.split_whitespace();
    let declares = words.next().is_some_and(|first| HABITS.has("power pmac declaration", first))
        && words.next().is_some_and(|name| name.starts_with(|c: char| c.is_ascii_alphabetic()));
    declares || code.match_indices('.').any(|(at, _)| ends_with_structure(&code, at))
}

/// Whether the name of a data structure is in front of the point at an offset, with or without
/// an index, and the name of one of its parts after it.
fn ends_with_structure(code: &str, point: usize) -> bool {
    let before = code.get(..point).unwrap_or("");
    let after = code.get(point + 1..).unwrap_or("");
    let name = match before.strip_suffix(']') {
        Some(index) => index.rfind('[').and_then(|at| index.get(..at)).unwrap_or(""),
        None => before,
    };
    let start = name.trim_end_matches(|c: char| c.is_ascii_alphanumeric()).len();
    let name = name.get(start..).unwrap_or("");
    HABITS.has("power pmac structure", name) && after.starts_with(|c: char| c.is_ascii_alphabetic())
}

#[cfg(test)]
mod tests {
    use super::is_power_pmac;

    #[test]
    fn data_structures_and_declarations_are_recognised() {
        for line in [
            "Motor[1].JogSpeed=32",
            "  IF (Motor[L1].InPos == 1)",
            "Sys.WpKey=$AAAAAAAA",
            "Gate3[0].Chan[1].OutFlagB=1",
            "global Count = 0",
            "ptr Lamp->u.io:$A00000.8.1",
        ] {
            assert!(is_power_pmac(line), "{line}");
        }
        for line in ["P1=1.5", "motor=1", "P1..5=0", "SEND\"Sys.1\"", "local", "// Sys.WpKey", ""] {
            assert!(!is_power_pmac(line), "{line}");
        }
    }
}
