//! Problems, as `plcc check` tells them.

use gen_lsp_types::{
    Code, CodeDescription, Diagnostic, DiagnosticRelatedInformation, DiagnosticSeverity, Message,
    Range, Uri,
};
use plcc_diag::lints::lint_of_code;
use plcc_diag::{FileId, Severity, find_code};

use crate::documents::Documents;
use crate::program::Program;

/// The most problems of a file that are told; an editor has no use for more.
const MAX_TOLD: usize = 1000;

/// The problems of a file. With `explains` each has a link to its page.
pub(crate) fn of_file(
    program: &Program,
    file: FileId,
    documents: &Documents,
    explains: bool,
) -> Vec<Diagnostic> {
    let own = program.diagnostics().iter().filter(|it| it.span.file == file).take(MAX_TOLD);
    own.map(|it| one(program, it, documents, explains)).collect()
}

fn one(
    program: &Program,
    it: &plcc_diag::Diagnostic,
    documents: &Documents,
    explains: bool,
) -> Diagnostic {
    let related: Vec<DiagnosticRelatedInformation> = it
        .labels()
        .iter()
        .filter_map(|label| {
            let location = program.location(label.span, documents)?;
            Some(DiagnosticRelatedInformation { location, message: label.text.to_string() })
        })
        .collect();
    let related_information = (!related.is_empty()).then_some(related);
    Diagnostic { related_information, ..plain(it, program.range(it.span), explains) }
}

/// A problem without the other places that it names.
pub(crate) fn plain(it: &plcc_diag::Diagnostic, range: Range, explains: bool) -> Diagnostic {
    let severity = match it.severity {
        Severity::Error => DiagnosticSeverity::Error,
        Severity::Warning => DiagnosticSeverity::Warning,
        Severity::Note => DiagnosticSeverity::Information,
    };
    let mut message = it.message.to_string();
    for more in it.notes().iter().chain(&it.help) {
        message.push('\n');
        message.push_str(more);
    }
    let href = explains.then(|| Uri::parse(&format!("plcc-explain:{}.md", it.code)).ok()).flatten();
    let lint = lint_of_code(it.code).map(|lint| lint.name);
    Diagnostic {
        range,
        severity: Some(severity),
        code: Some(Code::String(it.code.to_owned())),
        code_description: href.map(|href| CodeDescription { href }),
        source: Some(lint.map_or_else(|| "plcc".to_owned(), |lint| format!("plcc {lint}"))),
        message: Message::String(message),
        tags: None,
        related_information: None,
        data: None,
    }
}

/// The page of a code, as `plcc explain` prints it, in Markdown.
pub(crate) fn page(code: &str) -> Option<String> {
    let info = find_code(code)?;
    Some(format!("# {}: {}\n\n{}\n\n```\n{}\n```\n", info.code, info.title, info.meaning, info.fix))
}
