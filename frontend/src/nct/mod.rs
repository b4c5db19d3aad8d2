//! NCT's PLC language (NCT 3 to 5): text to a checked program, and from there to IR and to the
//! statement interpreter.

mod ast;
mod cursor;
mod fail;
mod group;
mod number;
mod operand;
mod parse;
mod structure;
mod text;

pub use ast::Program;

use plcc_diag::{Diagnostic, FileId, SourceMap};

use crate::common::{FileLoader, Options};

/// Reads and checks a program. There is one unless a diagnostic is an error.
pub fn check(
    sources: &mut SourceMap,
    file: FileId,
    _loader: &dyn FileLoader,
    options: &Options,
) -> (Option<Program>, Vec<Diagnostic>) {
    let text = sources.text(file);
    let (mut parsed, mut found) = parse::parse(file, text, options.limits);
    let labels = structure::check(file, text, &mut parsed.stmts, &mut found);
    found.sort_by_key(|d| d.span.start);
    if found.iter().any(Diagnostic::is_error) {
        return (None, found);
    }
    let parse::Parsed { stmts, conds, texts, slots } = parsed;
    let lines = stmts.iter().map(|s| sources.line_col(file, s.span.start).0).collect();
    let name = sources.path(file).to_owned();
    let program =
        Program { file, name, text: text.to_owned(), lines, stmts, conds, labels, texts, slots };
    (Some(program), found)
}
