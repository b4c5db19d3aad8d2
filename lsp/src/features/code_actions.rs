//! Quick fixes: what was probably meant, and comments that silence a lint.

use std::collections::HashMap;

use gen_lsp_types::{
    CodeAction, CodeActionKind, CodeActionResponse, Position, Range, TextEdit, WorkspaceEdit,
};
use plcc_diag::lints::lint_of_code;
use plcc_diag::{Diagnostic, Span};
use plcc_frontend::language;

use crate::program::At;

/// The fixes of the problems in a part of a document, and of those whose mend is there.
pub(crate) fn code_actions(at: At<'_>, part: Span) -> Vec<CodeActionResponse> {
    let is_there =
        |span: Span| span.file == at.file && span.start <= part.end && part.start <= span.end;
    let own =
        at.program.diagnostics().iter().filter(|it| {
            is_there(it.span) || it.replacement().is_some_and(|mend| is_there(mend.span))
        });
    own.flat_map(|it| [replacement(at, it), allowance(at, it)]).flatten().collect()
}

/// An edit of the document.
fn action(
    at: At<'_>,
    title: String,
    edit: TextEdit,
    preferred: bool,
) -> Option<CodeActionResponse> {
    let uri = at.documents.uri(at.program.path(at.file))?;
    let changes = HashMap::from([(uri, vec![edit])]);
    let edit = WorkspaceEdit { changes: Some(changes), ..WorkspaceEdit::default() };
    Some(CodeActionResponse::CodeAction(CodeAction {
        title,
        kind: Some(CodeActionKind::QuickFix),
        is_preferred: Some(preferred),
        edit: Some(edit),
        ..CodeAction::default()
    }))
}

/// Writes what was probably meant.
fn replacement(at: At<'_>, of: &Diagnostic) -> Option<CodeActionResponse> {
    let found = of.replacement().filter(|it| it.span.file == at.file)?;
    let text = found.text.trim();
    let title = match found.span.start == found.span.end {
        true => format!("Insert {text}"),
        false => format!("Write {text}"),
    };
    let new_text = found.text.replace('\n', line_end(at));
    let edit = TextEdit { range: at.program.range(found.span), new_text };
    action(at, title, edit, true)
}

/// How lines of the document end.
fn line_end(at: At<'_>) -> &'static str {
    if at.program.sources.text(at.file).contains("\r\n") { "\r\n" } else { "\n" }
}

/// Writes the comment that silences a lint in front of the statement.
fn allowance(at: At<'_>, of: &Diagnostic) -> Option<CodeActionResponse> {
    let lint = lint_of_code(of.code)?.name;
    let sign = language(at.program.dialect).comment_signs().first()?;
    let line = at.program.sources.line(at.file, of.span.start);
    let text = at.program.sources.line_text(at.file, line);
    let indent: String = text.chars().take_while(|c| c.is_whitespace()).collect();
    let place = Position { line: line - 1, character: 0 };
    let edit = TextEdit {
        range: Range { start: place, end: place },
        new_text: format!("{indent}{sign} plcc: allow {lint}{}", line_end(at)),
    };
    action(at, format!("Allow {lint} here"), edit, false)
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::{at, with_cursor};

    /// The fixes at the place of `|`, or all of them without one.
    fn fixes(dialect: Dialect, text: &str) -> Vec<(String, String)> {
        let of = with_cursor(dialect, text);
        let (start, end) = if text.contains('|') { (of.2, of.2) } else { (0, u32::MAX) };
        let part = Span { file: plcc_diag::FileId(0), start, end };
        let found = code_actions(at(&of), part).into_iter().filter_map(|it| match it {
            CodeActionResponse::CodeAction(it) => {
                let edit = it.edit?.changes?.into_values().next()?.into_iter().next()?;
                Some((it.title, edit.new_text))
            }
            CodeActionResponse::Command(_) => None,
        });
        found.collect()
    }

    #[test]
    fn what_was_meant_can_be_written() {
        let fix = |a: &str, b: &str| (a.to_owned(), b.to_owned());
        let text = "$INPUT\nDOOR = 1/0\n$END\nA = DOR\nGOTO EN\nEND: B = A\n";
        assert_eq!(fixes(Dialect::Pmi, text), [fix("Write DOOR", "DOOR"), fix("Write END", "END")]);
        assert_eq!(fixes(Dialect::Nct, ":001 C015 J1\n:025 R\n"), [fix("Write C025", "C025")]);
        let text = "#define PUMP M1\nM1->X:0,0\nOPEN PLC1 CLEAR\nPUNP=1\nCLOSE\n";
        assert_eq!(fixes(Dialect::Pmac, text), [fix("Write PUMP", "PUMP")]);
    }

    #[test]
    fn what_a_lint_or_an_error_knows_to_write_can_be_written() {
        let first =
            |dialect, text: &str| fixes(dialect, text).into_iter().next().unwrap_or_default();
        let fix = |title: &str, text: &str| (title.to_owned(), text.to_owned());
        let near = "$INPUT\nPUMPON=1/0\n$OUTPUT\nLAMP=1/1\n$END\nLAMP=PUMPO\n";
        assert_eq!(first(Dialect::Pmi, near), fix("Write PUMPON", "PUMPON"));
        let small = "$OUTPUT\nLAMP=1/1\n$END\nlamp=T\n";
        assert_eq!(first(Dialect::Pmi, small), fix("Write LAMP", "LAMP"));
        let runs_on = ":000 J0\r\n:001 C015 C025 J1\r\n:015 I001 U012 Z\r\n:025 I002 U013 Z R\r\n";
        assert_eq!(first(Dialect::Nct, runs_on), fix("Insert R", "R\r\n"));
        assert_eq!(first(Dialect::Nct, ":001 C15 J1\n:015 R\n"), fix("Write C015", "C015"));
        assert_eq!(first(Dialect::Nct, ":001 CO15 J1\n:015 R\n"), fix("Write 0", "0"));
        let twice = "M1->X:0,0\nOPEN PLC1 CLEAR\nM1==5\nCLOSE\n";
        assert_eq!(first(Dialect::Pmac, twice), fix("Write =", "="));
        let equals = "#define PUMP=M1\nM1->X:0,0\nOPEN PLC1 CLEAR\nPUMP=1\nCLOSE\n";
        assert_eq!(first(Dialect::Pmac, equals), fix("Write M1", " M1"));
    }

    /// The problem is of `C`, which has no number; the letter beside it is what the user looks at.
    #[test]
    fn a_fix_is_offered_at_its_problem_and_where_it_is_written() {
        let fix = [("Write 0".to_owned(), "0".to_owned())];
        for text in [":001 |CO15 J1\n", ":001 C|O15 J1\n", ":001 CO|15 J1\n"] {
            assert_eq!(fixes(Dialect::Nct, &format!("{text}:015 R\n")), fix, "{text}");
        }
        assert_eq!(fixes(Dialect::Nct, ":001 CO15 J|1\n:015 R\n"), []);
    }

    #[test]
    fn a_lint_can_be_silenced() {
        let found = fixes(Dialect::Pmi, "$OUTPUT\n  LAMP = 1/0\n$END\nA = T\n");
        let allow = found.iter().find(|(title, _)| title.starts_with("Allow"));
        let expected = (
            "Allow unassigned-output here".to_owned(),
            "  ? plcc: allow unassigned-output\n".to_owned(),
        );
        assert_eq!(allow, Some(&expected));
    }
}
