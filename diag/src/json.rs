//! Diagnostics as JSON, one object a line.

use std::borrow::Cow;

use serde::Serialize;

use crate::{Diagnostic, SourceMap, lints::lint_of_code};

/// A statement that includes a file.
#[derive(Serialize)]
struct Include<'a> {
    file: &'a str,
    line: u32,
}

/// The object that is printed. Its fields are the keys.
#[derive(Serialize)]
struct JsonDiagnostic<'a> {
    code: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    lint: Option<&'a str>,
    severity: &'a str,
    message: &'a str,
    file: &'a str,
    line: u32,
    column: u32,
    end_line: u32,
    end_column: u32,
    notes: Vec<Cow<'a, str>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    included_from: Vec<Include<'a>>,
}

/// Prints one diagnostic as one line of JSON, without the line end.
///
/// Lines and columns count from 1, columns in characters. `notes` holds the labels with their
/// places, then the notes, then the help, if there is one. `included_from` is there for a
/// diagnostic in an included file: it lists the statements that include it, from the innermost out.
pub fn line(map: &SourceMap, diagnostic: &Diagnostic) -> String {
    let span = diagnostic.span;
    let (line, column) = map.line_col(span.file, span.start);
    let (end_line, end_column) = map.line_col(span.file, span.end);
    let mut included_from = Vec::new();
    let mut file = span.file;
    while let Some(at) = map.included_from(file) {
        included_from
            .push(Include { file: map.path(at.file), line: map.line_col(at.file, at.start).0 });
        file = at.file;
    }
    let labels = diagnostic.labels().iter().map(|label| {
        let (line, column) = map.line_col(label.span.file, label.span.start);
        Cow::from(if label.span.file == span.file {
            format!("line {line}, column {column}: {}", label.text)
        } else {
            format!("{}, line {line}, column {column}: {}", map.path(label.span.file), label.text)
        })
    });
    let notes = diagnostic.notes().iter().chain(&diagnostic.help).map(|note| Cow::from(&**note));
    let object = JsonDiagnostic {
        code: diagnostic.code,
        lint: lint_of_code(diagnostic.code).map(|lint| lint.name),
        severity: diagnostic.severity.name(),
        message: &diagnostic.message,
        file: map.path(span.file),
        line,
        column,
        end_line,
        end_column,
        notes: labels.chain(notes).collect(),
        included_from,
    };
    serde_json::to_string(&object).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use crate::{Diagnostic, SourceMap, Span};

    #[test]
    fn a_line_has_the_keys_that_scripts_rely_on() {
        let mut map = SourceMap::new();
        let main = map.add("m.pmi", b"$INCLUDE X\n");
        let inner = map.add_included("x.pmi", b"\nA = B\n", Span::new(main, 0, 10));
        let diagnostic = Diagnostic::error("PMI-31", Span::new(inner, 5, 6), "nothing is named B")
            .help("declare B");
        assert_eq!(
            super::line(&map, &diagnostic),
            r#"{"code":"PMI-31","severity":"error","message":"nothing is named B","file":"x.pmi","line":2,"column":5,"end_line":2,"end_column":6,"notes":["declare B"],"included_from":[{"file":"m.pmi","line":1}]}"#
        );
    }

    #[test]
    fn labels_say_where_they_stand() {
        let mut map = SourceMap::new();
        let main = map.add("m.pmi", b"A\n B\n");
        let other = map.add("o.pmi", b"C\n");
        let diagnostic = Diagnostic::error("PMI-31", Span::new(main, 0, 1), "twice")
            .note("why")
            .label(Span::new(main, 3, 4), "here")
            .label(Span::new(other, 0, 1), "and here");
        let line = super::line(&map, &diagnostic);
        let notes =
            r#""notes":["line 2, column 2: here","o.pmi, line 1, column 1: and here","why"]"#;
        assert!(line.contains(notes), "{line}");
    }
}
