//! Which dialect a source is in.

use std::path::Path;

use plcc_abi::Dialect;

/// What a file's ending says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// One dialect's own.
    Of(Dialect),
    /// `.plc`, which NCT and PMAC share.
    Shared,
    /// None that is known.
    Other,
}

/// The dialect by a file's ending, in any case.
pub fn ending(path: &Path) -> Ending {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    match ending.as_deref() {
        Some("pmi") => Ending::Of(Dialect::Pmi),
        Some("nct") => Ending::Of(Dialect::Nct),
        Some("pmc" | "pmac") => Ending::Of(Dialect::Pmac),
        Some("plc") => Ending::Shared,
        _ => Ending::Other,
    }
}

/// The dialect of a file, by its ending, else by its text; `Err` with those that the text looks
/// like when that is none or several.
pub fn dialect(path: &Path, text: &str) -> Result<Dialect, Vec<Dialect>> {
    if let Ending::Of(dialect) = ending(path) {
        return Ok(dialect);
    }
    let like = looks_like(text);
    match like.as_slice() {
        [one] => Ok(*one),
        _ => Err(like),
    }
}

/// The dialects whose marks stand in a text, comments aside.
pub fn looks_like(text: &str) -> Vec<Dialect> {
    let marks = [
        (Dialect::Pmi, is_pmi(text)),
        (Dialect::Nct, is_nct(text)),
        (Dialect::Pmac, is_pmac(text)),
    ];
    marks.into_iter().filter(|&(_, is)| is).map(|(dialect, _)| dialect).collect()
}

/// A section directive at the start of a line; `?` begins comments.
fn is_pmi(text: &str) -> bool {
    const SECTIONS: [&str; 14] = [
        "INPUT", "OUTPUT", "LOGICAL", "INTEGER", "LONG", "FAULT", "MESSAGE", "KEY", "MCODE",
        "GCODE", "TIMER", "FLIPFLOP", "AUXAXIS", "END",
    ];
    text.split(['\r', '\n']).any(|line| {
        let word = line.trim_start().strip_prefix('$').unwrap_or("");
        let end = word.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(word.len());
        word.get(..end).is_some_and(|word| SECTIONS.iter().any(|s| s.eq_ignore_ascii_case(word)))
    })
}

/// The text without comments that begin with one of `line` or stand in `/* */`.
fn uncommented(text: &str, line: &[&str]) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let skip = if rest.starts_with("/*") {
            rest.get(2..).and_then(|tail| tail.find("*/")).map_or(rest.len(), |at| at + 4)
        } else if line.iter().any(|mark| rest.starts_with(mark)) {
            rest.find(['\r', '\n']).unwrap_or(rest.len())
        } else {
            out.push(c);
            c.len_utf8()
        };
        rest = rest.get(skip..).unwrap_or("");
    }
    out
}

/// A label `:000` or `:001`; white space means nothing.
fn is_nct(text: &str) -> bool {
    let mut dense = uncommented(text, &[";"]);
    dense.retain(|c| !c.is_whitespace());
    dense.contains(":000") || dense.contains(":001")
}

/// `OPEN PLC`, a definition's arrow, or a macro.
fn is_pmac(text: &str) -> bool {
    let upper = uncommented(text, &[";", "//", "?"]).to_ascii_uppercase();
    let opens = upper.match_indices("OPEN").any(|(at, word)| {
        upper.get(at + word.len()..).is_some_and(|tail| tail.trim_start().starts_with("PLC"))
    });
    opens || upper.contains("->") || upper.contains("#DEFINE")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(path: &str, text: &str) -> Result<Dialect, Vec<Dialect>> {
        dialect(Path::new(path), text)
    }

    #[test]
    fn endings_decide_in_any_case() {
        assert_eq!(of("A.PMI", ":000"), Ok(Dialect::Pmi));
        assert_eq!(of("a.Nct", "$END"), Ok(Dialect::Nct));
        assert_eq!(of("a.pmac", ""), Ok(Dialect::Pmac));
        assert_eq!(of("a.PMC", ""), Ok(Dialect::Pmac));
    }

    #[test]
    fn else_the_text_does() {
        assert_eq!(of("a.plc", "/* $END -> */ : 0 0 0 R"), Ok(Dialect::Nct));
        assert_eq!(of("a.plc", "; :000\nopen  plc 3 clear"), Ok(Dialect::Pmac));
        assert_eq!(of("a", "M1->Y:$FFC2,8"), Ok(Dialect::Pmac));
        assert_eq!(of("a.txt", "? -> #define\n  $INPUT\nA PORT1.0\n"), Ok(Dialect::Pmi));
        assert_eq!(of("a.plc", "; OPEN PLC 1\n"), Err(vec![]));
        assert_eq!(of("a.plc", ":000\nOPEN PLC 1\n"), Err(vec![Dialect::Nct, Dialect::Pmac]));
    }
}
