//! Links from the statements that include a file to the file.

use gen_lsp_types::DocumentLink;
use plcc_diag::Span;
use plcc_frontend::common::words::WordKind;

use crate::program::At;

/// The links of a document.
pub(crate) fn links(at: At<'_>) -> Vec<DocumentLink> {
    let program = at.program;
    let own = program.words.includes.iter().filter(|(span, _)| span.file == at.file);
    let link = |&(span, file): &(Span, plcc_diag::FileId)| {
        let words = program.words.of_file(at.file).iter();
        let mut name = words.filter(|it| it.kind == WordKind::Text).map(|it| it.span);
        let name = name.rfind(|it| span.start <= it.start && it.end <= span.end).unwrap_or(span);
        let text = program.sources.slice(name);
        let start = name.start + (text.len() - text.trim_start().len()) as u32;
        let target = at.documents.uri(program.path(file));
        DocumentLink {
            range: program.range(Span { start, ..name }),
            target,
            tooltip: None,
            data: None,
        }
    };
    own.map(link).collect()
}
