//! How the statement or function before the cursor is written.

use gen_lsp_types::{Documentation, SignatureHelp, SignatureInformation};
use plcc_frontend::common::words::WordKind;
use plcc_frontend::language;

use crate::program::At;

/// The form of the last word of the language in front of the cursor, on the same line.
pub(crate) fn help(at: At<'_>) -> Option<SignatureHelp> {
    let program = at.program;
    let line = program.sources.line(at.file, at.offset);
    let words = program.words.of_file(at.file).iter().rev();
    let mut before = words
        .filter(|word| word.span.end <= at.offset)
        .take_while(|word| program.sources.line(at.file, word.span.start) == line);
    let keyword =
        before.find(|word| matches!(word.kind, WordKind::Keyword | WordKind::Directive))?;
    let text =
        language(program.dialect).explain(at.text(keyword), Some(program.options.controller))?;
    // The page of a keyword is its names, its form, its meaning and the manual's section.
    let mut lines = text.lines();
    let (_, form, meaning) = (lines.next()?, lines.next()?.trim(), lines.next()?.trim());
    let signature = SignatureInformation {
        label: form.to_owned(),
        documentation: Some(Documentation::String(meaning.to_owned())),
        parameters: None,
        active_parameter: None,
    };
    Some(SignatureHelp {
        signatures: vec![signature],
        active_signature: Some(0),
        active_parameter: None,
    })
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::{at, with_cursor};

    #[test]
    fn a_statement_shows_its_form() {
        let of = with_cursor(Dialect::Pmac, "OPEN PLC1 CLEAR\nWHILE (P1=1|\nENDWHILE\nCLOSE");
        let label = help(at(&of))
            .map(|it| it.signatures.into_iter().map(|it| it.label).collect::<String>());
        assert!(label.as_deref().is_some_and(|it| it.starts_with("WHILE (")), "{label:?}");
        assert!(help(at(&with_cursor(Dialect::Pmi, "$END\nA = B|\n"))).is_none());
    }
}
