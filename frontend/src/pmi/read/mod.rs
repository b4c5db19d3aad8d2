//! Makes statements of PMI's text, with the errors of their form: `split` cuts files into
//! statements, `lexer` those into tokens, and `declaration`, `ports`, `logic` and
//! `expression` read the tokens as the statements of `syntax`.
//!
//! A statement is read without any declaration: what a name stands for is found in `analyse`. Only
//! the directive above a declaration says how it is written.

pub(crate) mod cursor;
pub(crate) mod declaration;
pub(crate) mod diagnostic;
pub(crate) mod expression;
pub(crate) mod lexer;
mod logic;
mod ports;
pub(crate) mod section;
pub(crate) mod split;
pub(crate) mod syntax;
pub(crate) mod token;

use plcc_diag::{Diagnostic, FileId, SourceMap};

use crate::common::{FileLoader, Options};
use crate::pmi::read::{
    cursor::Cursor,
    declaration::DeclarationReader,
    lexer::lex,
    logic::LogicReader,
    section::Section,
    syntax::{Form, Statement, Text},
};

/// Reads the program in `file`, and the files that it includes.
pub(crate) fn read(
    sources: &mut SourceMap,
    file: FileId,
    loader: &dyn FileLoader,
    options: &Options,
    diagnostics: &mut Vec<Diagnostic>,
) -> Text {
    let limits = options.limits;
    let split = split::split(sources, file, loader, options, diagnostics);
    let (mut statements, mut tokens, mut parts) = (vec![], vec![], vec![]);
    let mut declarations = DeclarationReader::new(limits);
    for extent in split.statements {
        let text = sources.text(extent.file);
        let from = tokens.len();
        lex(text, extent.start, extent.end, limits, &mut tokens);
        let mut cursor = Cursor::new(text, tokens.get(from..).unwrap_or(&[]), extent);
        let (form, error) = if declarations.section == Some(Section::End) {
            let (logic, error) = LogicReader::new(&mut cursor, &mut parts, limits).read();
            (Form::Logic(logic), error)
        } else {
            let (declaration, error) = declarations.read(&mut cursor);
            (Form::Declaration(declaration), error)
        };
        let tokens = from as u32..tokens.len() as u32;
        statements.push(Statement { extent, tokens, form, error });
    }
    let has_end = declarations.section == Some(Section::End);
    Text { statements, tokens, parts, has_end, last: split.last }
}
