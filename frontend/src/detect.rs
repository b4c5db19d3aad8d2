//! Which language a source is in.
//!
//! A file's ending decides if one language alone has it. Otherwise the text decides: it is in the
//! language whose marks it holds, the words and signs that are in no other language's programs
//! ([`Language::has_marks`]).

use std::path::Path;

use plcc_abi::Dialect;

use crate::language::{LANGUAGES, Language};

/// Which languages have a file's ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// One language alone has it.
    Of(Dialect),
    /// Several languages have it (`.plc`).
    Shared,
    /// No language has it.
    Unknown,
}

/// Which languages have the ending of `path`. Capital and small letters are the same.
pub fn ending(path: &Path) -> Ending {
    let Some(ending) = path.extension() else { return Ending::Unknown };
    let ending = ending.to_string_lossy().to_ascii_lowercase();
    let having: Vec<Dialect> = LANGUAGES
        .iter()
        .filter(|language| language.file_extensions().contains(&ending.as_str()))
        .map(|language| language.dialect())
        .collect();
    match having.as_slice() {
        [] => Ending::Unknown,
        [one] => Ending::Of(*one),
        _ => Ending::Shared,
    }
}

/// Every ending of every language, each once and with its point: `.pmi`, `.nct`, `.plc`…
pub fn file_extensions() -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for ending in LANGUAGES.iter().flat_map(|language| language.file_extensions()) {
        let ending = format!(".{ending}");
        if !all.contains(&ending) {
            all.push(ending);
        }
    }
    all
}

/// The language of a file, by the ending of `path`, otherwise by its `text`.
///
/// # Errors
/// The languages whose marks the text holds, if that is none or several.
pub fn detect(path: &Path, text: &str) -> Result<Dialect, Vec<Dialect>> {
    if let Ending::Of(dialect) = ending(path) {
        return Ok(dialect);
    }
    let like = looks_like(text);
    match like.as_slice() {
        [one] => Ok(*one),
        _ => Err(like),
    }
}

/// The languages whose marks are in a text outside comments and quotes.
pub fn looks_like(text: &str) -> Vec<Dialect> {
    let plain = without_comments(text);
    let having = |language: &&&dyn Language| language.has_marks(&plain);
    LANGUAGES.iter().filter(having).map(|language| language.dialect()).collect()
}

/// The text in capitals, with blanks for the comments of all languages and for what is in
/// quotes.
fn without_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(['?', ';', '/', '"']) {
        let (before, tail) = rest.split_at(at);
        out.push_str(before);
        let after = tail.get(1..).unwrap_or("");
        let len = if tail.starts_with("/*") {
            tail.get(2..).and_then(|t| t.find("*/")).map_or(tail.len(), |close| close + 4)
        } else if tail.starts_with('"') {
            // A quote that is not closed on its line quotes nothing.
            let end = after.find(['"', '\r', '\n']).unwrap_or(after.len());
            if after.get(end..).is_some_and(|t| t.starts_with('"')) { end + 2 } else { 1 }
        } else if tail.starts_with('/') && !after.starts_with('/') {
            out.push('/');
            rest = after;
            continue;
        } else {
            tail.find(['\r', '\n']).unwrap_or(tail.len())
        };
        out.push(' ');
        rest = tail.get(len..).unwrap_or("");
    }
    out.push_str(rest);
    out.make_ascii_uppercase();
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(path: &str, text: &str) -> Result<Dialect, Vec<Dialect>> {
        detect(Path::new(path), text)
    }

    #[test]
    fn the_file_name_extension_decides_in_any_case() {
        assert_eq!(of("A.PMI", ":000"), Ok(Dialect::Pmi));
        assert_eq!(of("a.Nct", "$END"), Ok(Dialect::Nct));
        assert_eq!(of("a.pmac", ""), Ok(Dialect::Pmac));
        assert_eq!(of("a.PMC", ""), Ok(Dialect::Pmac));
    }

    #[test]
    fn without_a_known_extension_the_text_decides() {
        assert_eq!(of("a.plc", "/* $END -> */ : 0 0 0 R"), Ok(Dialect::Nct));
        assert_eq!(of("a.plc", "; :000\nopen  plc 3 clear"), Ok(Dialect::Pmac));
        assert_eq!(of("a", "M1->Y:$FFC2,8"), Ok(Dialect::Pmac));
        assert_eq!(of("a.txt", "? -> #define\n  $INPUT\nA PORT1.0\n"), Ok(Dialect::Pmi));
        assert_eq!(of("a.plc", "; OPEN PLC 1\n"), Err(vec![]));
        assert_eq!(of("a.plc", ":000\nOPEN PLC 1\n"), Err(vec![Dialect::Nct, Dialect::Pmac]));
    }

    #[test]
    fn words_that_only_resemble_a_mark_decide_nothing() {
        use Dialect::{Nct, Pmac, Pmi};
        for (text, found) in [
            ("U001:0 0\n1J1", vec![Nct]),
            ("OPEN\nPLCC0", vec![Pmac]),
            ("M1->Y:0001,8", vec![Pmac]),
            (" # define A B", vec![Pmac]),
            ("P1=0 // :000\n", vec![]),
            ("F=\"-> :000\"\n$end", vec![Pmi]),
            ("$ENDING\n", vec![]),
            ("\"", vec![]),
            ("/*", vec![]),
        ] {
            assert_eq!(looks_like(text), found, "{text}");
        }
    }
}
