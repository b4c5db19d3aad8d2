//! Comments after something in its line, by which people said what a variable is.

use plcc_diag::{SourceMap, Span};

/// Splits a line of source in front of its comment, and gives the text of the comment: without its sign, and empty where there
/// is none. `signs` are what begins one; those in quotes begin none.
pub(crate) fn split_comment<'t>(line: &'t str, signs: &[&str]) -> (&'t str, &'t str) {
    let mut quoted = false;
    for (at, byte) in line.bytes().enumerate() {
        if byte == b'"' {
            quoted = !quoted;
        } else if !quoted
            && signs.iter().any(|sign| sign.as_bytes().first() == Some(&byte))
            && let Some(tail) = line.get(at..)
            && let Some(comment) = signs.iter().find_map(|sign| tail.strip_prefix(sign))
        {
            let comment = comment.trim();
            let comment = comment.strip_suffix("*/").unwrap_or(comment);
            let comment = comment.trim_matches(is_rule);
            // What is said to the compiler says nothing of a variable.
            let comment = if comment.starts_with("plcc:") { "" } else { comment };
            return (line.get(..at).unwrap_or(line), comment);
        }
    }
    (line, "")
}

/// Whether a character is one with which people draw lines and boxes around comments.
fn is_rule(c: char) -> bool {
    c.is_whitespace() || matches!(c, '*' | '-' | '=' | ';' | '/' | '?' | '#')
}

/// The comment after a place in its line; `None` where there is none.
pub(crate) fn trailing_comment(sources: &SourceMap, place: Span, signs: &[&str]) -> Option<String> {
    let rest = sources.text(place.file).get(place.end as usize..)?;
    let line = rest.split(['\n', '\r']).next()?;
    let (_, comment) = split_comment(line, signs);
    (!comment.is_empty()).then(|| comment.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_begins_outside_of_quotes() {
        for (line, parts) in [
            ("LS1 = 0/3 ? door closed", ("LS1 = 0/3 ", "door closed")),
            ("A = \"why?\" ? because", ("A = \"why?\" ", "because")),
            ("A = 1", ("A = 1", "")),
            ("? ******* INPUTS *******", ("", "INPUTS")),
            ("A = B ? plcc: allow near-name", ("A = B ", "")),
        ] {
            assert_eq!(split_comment(line, &["?"]), parts);
        }
        assert_eq!(split_comment("M1->X:0 /* lamp */", &["//", "/*"]), ("M1->X:0 ", "lamp"));
    }
}
