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

/// The languages whose marks stand in a text, comments and quoted texts aside: `:000` or `:001`
/// for NCT; `OPEN PLC`, `->` or `#define` for PMAC; a directive of PMI.
pub fn looks_like(text: &str) -> Vec<Dialect> {
    let plain = without_comments(text);
    let marks = [
        (Dialect::Pmi, has_directive(&plain)),
        (Dialect::Nct, has_module(&plain)),
        (Dialect::Pmac, has_download(&plain)),
    ];
    marks.into_iter().filter(|&(_, there)| there).map(|(dialect, _)| dialect).collect()
}

/// The text in capitals, with blanks for the comments of all three languages and for what stands
/// in quotes.
fn without_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(['?', ';', '/', '"']) {
        let (before, tail) = rest.split_at(at);
        out.push_str(before);
        let behind = tail.get(1..).unwrap_or("");
        let len = if tail.starts_with("/*") {
            tail.get(2..).and_then(|t| t.find("*/")).map_or(tail.len(), |close| close + 4)
        } else if tail.starts_with('"') {
            // Quotes close on their line, or are none.
            let end = behind.find(['"', '\r', '\n']).unwrap_or(behind.len());
            if behind.get(end..).is_some_and(|t| t.starts_with('"')) { end + 2 } else { 1 }
        } else if tail.starts_with('/') && !behind.starts_with('/') {
            out.push('/');
            rest = behind;
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

/// The directives of PMI.
const DIRECTIVES: [&str; 15] = [
    "INPUT", "OUTPUT", "LOGICAL", "INTEGER", "LONG", "FAULT", "MESSAGE", "KEY", "MCODE", "GCODE",
    "TIMER", "FLIPFLOP", "AUXAXIS", "INCLUDE", "END",
];

fn has_directive(plain: &str) -> bool {
    plain.split(['\r', '\n']).any(|line| {
        let word = line.trim_start_matches(|c: char| c.is_whitespace() || c == '\u{feff}');
        let Some(word) = word.strip_prefix('$') else { return false };
        let end = word.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(word.len());
        word.get(..end).is_some_and(|word| DIRECTIVES.contains(&word))
    })
}

/// Whether a module of NCT begins somewhere. An address of PMAC (`Y:0001`) is none.
fn has_module(plain: &str) -> bool {
    plain.match_indices(':').any(|(at, _)| {
        let (before, behind) = plain.split_at(at);
        let mut digits = behind.chars().skip(1).filter(|c| !c.is_whitespace());
        let module = digits.next() == Some('0')
            && digits.next() == Some('0')
            && matches!(digits.next(), Some('0' | '1'));
        let before = before.trim_end();
        let address = before.ends_with(['X', 'Y', 'L', 'D', 'P', 'F'])
            || ["TWB", "TWS", "TWR"].iter().any(|word| before.ends_with(word));
        module && !address
    })
}

fn has_download(plain: &str) -> bool {
    let follows = |word: &str, next: &str| {
        plain.match_indices(word).any(|(at, _)| {
            let tail = plain.get(at + word.len()..).unwrap_or("");
            tail.trim_start().starts_with(next)
        })
    };
    plain.contains("->") || follows("OPEN", "PLC") || follows("#", "DEFINE")
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

    #[test]
    fn what_only_resembles_a_mark_is_none() {
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
