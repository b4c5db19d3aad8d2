//! The PLC language of PMAC and Turbo PMAC (Delta Tau).
//!
//! [`check`] makes a [`Program`] of source files in stages:
//!
//! 1. `read/preprocess.rs` replaces macros, includes and templates. The result is one text, in
//!    which every byte has its place in the sources.
//! 2. `read/download.rs` reads that text into the on-line commands and the buffers of `ast.rs`.
//! 3. `analyse/` checks what needs the whole download, such as definitions, and executes the
//!    on-line commands, which makes the state after load (`load.rs`).
//!
//! `lower/` translates the program to IR, `oracle/` interprets its statements. What is decided
//! where the guide (*PMAC Quick Reference Guide*) is silent is in `docs/pmac.md`.
//!
//! Architecture Invariant: no syntax tree is nested. All expressions are in postfix order in one
//! array, and statements are an array with jumps in it, so that nothing recurses on program size.

mod access;
mod analyse;
mod ast;
mod contacts;
mod explain_arithmetic;
mod export;
pub mod expression;
mod fingerprint;
mod host_statements;
mod language;
mod lower;
mod names_in_source;
mod oracle;
mod origin;
mod outputs;
mod plc_lists;
mod presentation;
mod read;
pub mod reference;
mod tables;
mod tasks;
#[cfg(test)]
mod tests;
mod uses;
mod words;

use plcc_abi::Engine;
use plcc_abi::pmac::{Assumption, Layout};
use plcc_diag::{Diagnostic, FileId, SourceMap};

use crate::common::{CrossReference, FileLoader, LowerError, Lowered, Options, Words};

pub use language::Pmac;
pub use oracle::Interpreter;

use analyse::{
    assumptions, define_with_equals, enabled, lints, load, local_variables, out_of_range,
    power_pmac,
};
use read::download::DownloadReader;
use read::preprocess::Preprocessed;
use read::{download, preprocess};

/// What begins a comment that goes on to the end of its line.
const COMMENT_MARKS: [&str; 2] = [";", "//"];

/// A checked download, with the state after load.
#[derive(Clone, Debug)]
pub struct Program {
    download: ast::Download,
    loaded: load::Loaded,
    /// The files of the download, the included ones among them.
    sources: SourceMap,
    /// The names that `#define` defines, which expressions may use.
    names: std::sync::Arc<[preprocess::DefinedName]>,
}

/// Reads and checks `files` as one download, in their order. Included files are read through
/// `loader` and added to `sources`.
///
/// Returns the diagnostics, and the program if none of them is an error. IF and WHILE that do not
/// match their ends (`PMAC-9`) do not count here: the PLCs that have them are empty in the program,
/// and `run --keep-going` runs the others.
pub fn check(
    sources: &mut SourceMap,
    files: &[FileId],
    loader: &dyn FileLoader,
    options: &Options,
) -> (Option<Program>, Vec<Diagnostic>) {
    let (preprocessed, diagnostics) = preprocess::preprocess(sources, files, loader, options);
    let read = download::read(&preprocessed, options);
    finish(&preprocessed, read, diagnostics, sources, options)
}

/// Does the same, and finds the words of the sources.
pub(crate) fn check_with_words(
    sources: &mut SourceMap,
    files: &[FileId],
    loader: &dyn FileLoader,
    options: &Options,
) -> (Option<Program>, Vec<Diagnostic>, Words) {
    let (preprocessed, diagnostics) = preprocess::preprocess(sources, files, loader, options);
    let read = download::read(&preprocessed, options);
    let words =
        words::words(sources, &preprocessed.names, &read.download, Layout::new(options.controller));
    let (program, diagnostics) = finish(&preprocessed, read, diagnostics, sources, options);
    (program, diagnostics, words)
}

/// The program that was read, if no diagnostic is an error, and the diagnostics with the lints.
fn finish(
    preprocessed: &Preprocessed,
    mut read: DownloadReader<'_>,
    mut diagnostics: Vec<Diagnostic>,
    sources: &SourceMap,
    options: &Options,
) -> (Option<Program>, Vec<Diagnostic>) {
    local_variables::report_undefined(&mut read);
    enabled::warn_of_i5(&mut read);
    let DownloadReader { mut download, diagnostics: found, suppressed_errors, .. } = read;
    local_variables::mark_integers(&mut download, &read.reader.constants_with_point);
    if suppressed_errors > 0
        && let Some(missing) = diagnostics.iter_mut().find(|d| d.code == "PMAC-X2")
    {
        let what =
            if suppressed_errors == 1 { "1 error" } else { &format!("{suppressed_errors} errors") };
        missing.add_note(format!("not shown: {what} at names that this file may define"));
    }
    diagnostics.extend(found);
    diagnostics.extend(out_of_range::warnings(&download));
    power_pmac::one_error_a_file(sources, &mut diagnostics);
    define_with_equals::one_error_a_definition(sources, &mut diagnostics);
    let is_fatal = |d: &Diagnostic| d.is_error() && d.code != "PMAC-9";
    if diagnostics.iter().any(is_fatal) {
        options.lints.apply(sources, &mut diagnostics, &COMMENT_MARKS, None);
        return (None, diagnostics);
    }
    let mut loaded = load::load(&download);
    assumptions::assume(&download, &mut loaded);
    if !diagnostics.iter().any(Diagnostic::is_error) {
        let unread = |d: &Diagnostic| d.code == "PMAC-N1" || d.code == "PMAC-W19";
        let has_motion = diagnostics.iter().any(unread);
        diagnostics.extend(lints::find(&download, &loaded, has_motion));
    }
    options.lints.apply(sources, &mut diagnostics, &COMMENT_MARKS, None);
    if diagnostics.iter().any(is_fatal) {
        return (None, diagnostics);
    }
    let (sources, names) = (sources.clone(), preprocessed.names.clone().into());
    (Some(Program { download, loaded, sources, names }), diagnostics)
}

impl Program {
    /// The program as IR, with the executive's tables.
    ///
    /// # Errors
    /// The program is too long, or the compiler has a defect.
    pub fn lower(&self) -> Result<Lowered, LowerError> {
        let module = lower::lower(&self.download, &self.loaded, &self.sources)?;
        let names = self.files().map(str::to_owned).collect();
        let tasks = module.tasks.clone();
        let program = tables::program(&self.download, &self.loaded, names, tasks, &self.sources);
        Ok(Lowered { program, module, return_stack: None })
    }

    /// The M-variables that PLCs name, by rising number, with the definitions that the code of
    /// [`lower`](Self::lower) assumes: those after load. Variables whose definitions the program
    /// changes itself are listed without one.
    pub fn assumptions(&self) -> &[Assumption] {
        &self.loaded.assumed
    }

    /// The statement interpreter, as an engine like the others.
    pub fn interpreter(&self) -> Box<dyn Engine> {
        Box::new(Interpreter::new(&self.download, &self.loaded, &self.sources))
    }

    /// How each statement is computed, for `plcc check --explain-arithmetic`: under the name of each PLC a line for
    /// each statement, with `integer`, or with `floating point` and the operation that makes it necessary. It compiles the
    /// program as far as that is decided.
    ///
    /// # Errors
    /// If the program can't be compiled.
    pub fn explain_arithmetic(&self) -> Result<String, LowerError> {
        let module = self.lower()?.module;
        Ok(explain_arithmetic::explain(&self.download, &self.loaded, &self.sources, module))
    }

    /// Where each variable is read, written and tested.
    pub fn cross_reference(&self) -> CrossReference {
        let tables =
            tables::program(&self.download, &self.loaded, vec![], vec![], &self.sources).tables;
        analyse::cross_reference::cross_reference(&self.download, &self.sources, &tables)
    }

    /// The paths of all files of the download, the included ones among them.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        (0..self.sources.len() as u32).map(|id| self.sources.path(FileId(id)))
    }
}
