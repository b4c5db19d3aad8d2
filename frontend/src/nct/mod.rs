//! NCT's PLC language (NCT 3 to 5).
//!
//! `read` makes statements of the text, `analyse` a checked program of the statements. The
//! layout of the process image, the IR (`lower`) and the statement interpreter (`oracle`) are made
//! from the checked program.
//! Where the manual is silent or contradicts itself, the rulings in the project's `docs/nct.md`
//! decide.

mod access;
mod analyse;
mod ast;
mod contacts;
mod control_flow;
mod export;
mod expression;
mod language;
mod layout;
mod lower;
mod names_in_source;
mod oracle;
mod presentation;
mod reachable;
mod read;
mod reference;
mod status_flags;
mod tables;
mod words;

use std::sync::Arc;

use plcc_abi::Engine;
use plcc_diag::{Diagnostic, FileId, SourceMap};

use crate::common::{CrossReference, FileLoader, Limits, LowerError, Lowered, Options, Words};

pub use language::Nct;
pub use oracle::Interpreter;
pub use reference::names;

/// What begins a comment that goes on to the end of its line (NCT 4.1).
const COMMENT_MARKS: [&str; 1] = [";"];

/// A program without errors.
#[derive(Clone, Debug)]
pub struct Program {
    checked: Arc<ast::Program>,
    layout: Arc<layout::Layout>,
    settings: plcc_abi::nct::NctSettings,
    /// The limits that the program was checked with; they hold for [`expression`](Self::expression)
    /// too.
    limits: Limits,
}

/// Reads and checks the program in `file`. The result is a program if no diagnostic is an error.
/// Nothing is asked of the loader, since NCT's programs include no files.
pub fn check(
    sources: &mut SourceMap,
    file: FileId,
    _loader: &dyn FileLoader,
    options: &Options,
) -> (Option<Program>, Vec<Diagnostic>) {
    let read = read_statements(sources, file, options);
    finish(read, sources, file, options)
}

/// Finds the words of the source, and then does the same.
pub(crate) fn words_and_rest(
    sources: &SourceMap,
    file: FileId,
    options: &Options,
) -> (Words, impl FnOnce(&SourceMap) -> (Option<Program>, Vec<Diagnostic>) + use<>) {
    let read = read_statements(sources, file, options);
    let words = words::words(sources, file, &read.parsed.stmts);
    let options = options.clone();
    (words, move |sources: &SourceMap| finish(read, sources, file, &options))
}

/// The statements of a program, with the ends of their conditions.
struct Read {
    parsed: read::parser::Parsed,
    /// As in the program.
    labels: Vec<Option<u32>>,
    found: Vec<Diagnostic>,
}

fn read_statements(sources: &SourceMap, file: FileId, options: &Options) -> Read {
    let text = sources.text(file);
    let (mut parsed, mut found) = read::parser::parse(file, text, options.limits);
    let labels = analyse::structure::check(file, text, &mut parsed.stmts, &mut found);
    Read { parsed, labels, found }
}

/// The program that was read, if no diagnostic is an error, and the diagnostics with the lints.
fn finish(
    read: Read,
    sources: &SourceMap,
    file: FileId,
    options: &Options,
) -> (Option<Program>, Vec<Diagnostic>) {
    let Read { parsed, labels, mut found } = read;
    let text = sources.text(file);
    found.sort_by_key(|d| d.span.start);
    if found.iter().any(Diagnostic::is_error) {
        analyse::other_languages::explain(text, &mut found);
        options.lints.apply(sources, &mut found, &COMMENT_MARKS, None);
        return (None, found);
    }
    let read::parser::Parsed { stmts, condition_parts, texts, slots, tests: _ } = parsed;
    let lines = stmts.iter().map(|s| sources.line(file, s.span.start)).collect();
    let name = sources.path(file).to_owned();
    let text = text.to_owned();
    let checked = ast::Program { name, text, lines, stmts, condition_parts, labels, texts, slots };
    found.extend(analyse::lints::find(&checked));
    found.sort_by_key(|d| d.span.start);
    options.lints.apply(sources, &mut found, &COMMENT_MARKS, None);
    if found.iter().any(Diagnostic::is_error) {
        return (None, found);
    }
    let layout = layout::Layout::new(&checked);
    let settings = options.machine.nct.clone();
    let (checked, layout, limits) = (Arc::new(checked), Arc::new(layout), options.limits);
    (Some(Program { checked, layout, settings, limits }), found)
}

impl Program {
    /// The program as IR, with the executive's tables.
    ///
    /// # Errors
    /// When the program is too long, or the compiler finds its own data inconsistent.
    pub fn lower(&self) -> Result<Lowered, LowerError> {
        Ok(self.with_tables(lower::lower(&self.checked, &self.layout)?))
    }

    /// The same, but a new function begins after `limit` instructions or blocks. This is for tests
    /// of small functions.
    ///
    /// # Errors
    /// When the program is too long, or the compiler finds its own data inconsistent.
    pub fn lower_with_limit(&self, limit: usize) -> Result<Lowered, LowerError> {
        Ok(self.with_tables(lower::lower_with(&self.checked, &self.layout, limit)?))
    }

    fn with_tables(&self, code: lower::Code) -> Lowered {
        let lower::Code { module, return_stack } = code;
        let settings = self.settings.clone();
        let tasks = module.tasks.clone();
        let program = tables::program(&self.checked, &self.layout, settings, tasks);
        Lowered { program, module, return_stack }
    }

    /// Where each variable is read, written and tested.
    pub fn cross_reference(&self) -> CrossReference {
        analyse::cross_reference::cross_reference(&self.checked)
    }

    /// The statement interpreter, as an engine like the others.
    pub fn interpreter(&self) -> Box<dyn Engine> {
        Box::new(self.counting_interpreter())
    }

    /// The statement interpreter. It counts how often each statement runs.
    pub fn counting_interpreter(&self) -> Interpreter {
        Interpreter::new(Arc::clone(&self.checked), Arc::clone(&self.layout))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::MemoryLoader;

    #[test]
    fn what_lowering_misses_is_an_internal_error_with_its_line() {
        let text = ":001 J1 :000\nI000 U000 Z\nC010 J0\n:010 R\n";
        let mut sources = SourceMap::new();
        let file = sources.add("a.nct", text.as_bytes());
        let sound = check(&mut sources, file, &MemoryLoader::new(), &Options::default()).0.unwrap();
        assert!(sound.lower().is_ok());
        let message = |change: fn(&mut ast::Program, &mut layout::Layout)| {
            let mut broken = sound.clone();
            change(Arc::make_mut(&mut broken.checked), Arc::make_mut(&mut broken.layout));
            broken.lower().unwrap_err().to_string()
        };

        let found = message(|_, layout| layout.regions.clear());
        assert_eq!(found, "region `context` is missing");
        let found = message(|_, layout| layout.inputs.clear());
        assert_eq!(found, "the location of I00 is missing (at a.nct:2)");
        let found = message(|program, _| program.condition_parts.clear());
        assert_eq!(found, "a part of a condition is missing (at a.nct:2)");
        let found = message(|program, _| program.labels.truncate(10));
        assert_eq!(found, "label :010 is missing (at a.nct:3)");
    }
}
