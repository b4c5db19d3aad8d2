//! The PMI language (Sieb & Meyer SERIES 8).
//!
//! Text to statements ([`reader`](self), `lex`), statements to a checked program (`spec`, `exec`,
//! `expr`), and that to an image layout, IR and a statement interpreter. Where the manual is
//! silent or contradicts itself, the rulings in the project's documentation decide.
//!
//! Architecture Invariant: trees are flat. Expressions are postfix rows in one arena, statements
//! are steps with jump targets; nothing recurses on program size.

mod arith;
mod ast;
mod check;
mod cursor;
mod declare;
mod exec;
mod executive;
mod expr;
mod lex;
mod names;
mod ports;
mod reader;
mod report;
mod spec;
mod token;

use plcc_diag::{Diagnostic, FileId, SourceMap};

use crate::common::{FileLoader, Options};

pub use executive::explain;

/// A program without errors.
#[derive(Clone, Debug)]
pub struct Program {
    checked: ast::Checked,
}

/// Reads and checks the program in `file`; included files are asked of `loader` and added to
/// `sources`. There is a program where no diagnostic is an error.
pub fn check(
    sources: &mut SourceMap,
    file: FileId,
    loader: &dyn FileLoader,
    options: &Options,
) -> (Option<Program>, Vec<Diagnostic>) {
    let (checked, diagnostics) = check::check(sources, file, loader, options);
    let good = !diagnostics.iter().any(Diagnostic::is_error);
    (good.then_some(Program { checked }), diagnostics)
}
