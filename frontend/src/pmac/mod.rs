//! The PLC language of PMAC and Turbo PMAC (Delta Tau).
//!
//! Text goes through the download program's macros into one flat text that knows its way back to
//! the sources; that is read into buffers and on-line commands; the on-line commands are done and
//! give the state after load. Where the guide is silent, the rulings in the project's
//! documentation decide.
//!
//! Architecture Invariant: trees are flat. All expressions stand in postfix order in one row, and
//! statements are a row with jumps in it, so that nothing recurses on program size.

mod analyse;
mod ast;
pub mod expression;
mod language;
mod lower;
mod oracle;
mod origin;
mod read;
pub mod reference;
mod tables;
mod tasks;
#[cfg(test)]
mod tests;

use plcc_abi::Engine;
use plcc_abi::pmac::Assumption;
use plcc_diag::{Diagnostic, FileId, SourceMap};

use crate::common::{CrossReference, FileLoader, InternalError, Lowered, Options};

pub use language::Pmac;
pub use oracle::Interpreter;

use analyse::{assumptions, load, out_of_range};
use lower::explain;
use read::{download, preprocess};

/// A download that can run.
#[derive(Clone, Debug)]
pub struct Program {
    download: ast::Download,
    loaded: load::Loaded,
    /// The files, shared by all that is made of the program.
    sources: SourceMap,
    /// What its text defines with `#define`, for expressions.
    names: std::sync::Arc<[preprocess::DefinedName]>,
}

/// Reads and checks `files` as one download, in their order; included files are asked of `loader`
/// and added to `sources`.
///
/// There is a program where no diagnostic is an error, and also where the only errors are broken
/// structures (`PMAC-9`): the PLCs concerned are left empty in it (`run --keep-going`).
pub fn check(
    sources: &mut SourceMap,
    files: &[FileId],
    loader: &dyn FileLoader,
    options: &Options,
) -> (Option<Program>, Vec<Diagnostic>) {
    let (preprocessed, mut diagnostics) = preprocess::preprocess(sources, files, loader, options);
    let download::ReadDownload { download, diagnostics: found, suppressed_errors } =
        download::read(&preprocessed, options);
    if suppressed_errors > 0
        && let Some(missing) = diagnostics.iter_mut().find(|d| d.code == "PMAC-X2")
    {
        let what =
            if suppressed_errors == 1 { "1 error" } else { &format!("{suppressed_errors} errors") };
        missing.notes.push(format!("{what} over names that it may define are not shown"));
    }
    diagnostics.extend(found);
    diagnostics.extend(out_of_range::warnings(&download));
    if diagnostics.iter().any(|d| d.is_error() && d.code != "PMAC-9") {
        return (None, diagnostics);
    }
    let mut loaded = load::load(&download);
    assumptions::assume(&download, &mut loaded);
    let (sources, names) = (sources.clone(), preprocessed.names.into());
    (Some(Program { download, loaded, sources, names }), diagnostics)
}

impl Program {
    /// The program as IR, with the executive's tables.
    ///
    /// # Errors
    /// When the compiler finds a defect of its own.
    pub fn lower(&self) -> Result<Lowered, InternalError> {
        self.lower_for(&self.loaded.assumed)
    }

    /// The M-variables that PLCs name, by rising number, with the definitions that
    /// [`lower`](Self::lower) builds in: those after load, but for what the text itself moves.
    pub fn assumed(&self) -> &[Assumption] {
        &self.loaded.assumed
    }

    /// The same program with other definitions of M-variables built into its code; those that
    /// `assumed` leaves out are reached through the host. The executive's tables are the same, and
    /// so are the labels of all tasks and of all places at which they are suspended: a task that
    /// waits in one module goes on in any other.
    ///
    /// # Errors
    /// When the compiler finds a defect of its own.
    pub fn lower_for(&self, assumed: &[Assumption]) -> Result<Lowered, InternalError> {
        let module = lower::lower(&self.download, &self.loaded, &self.sources, assumed)?;
        let names = self.files().map(str::to_owned).collect();
        let tasks = module.tasks.clone();
        let program = tables::program(&self.download, &self.loaded, names, tasks);
        Ok(Lowered { program, module })
    }

    /// The statement interpreter, as an engine like the others.
    pub fn interpreter(&self) -> Box<dyn Engine> {
        Box::new(Interpreter::new(&self.download, &self.loaded))
    }

    /// What each statement is computed in, a line each under the name of its PLC: `integer`, or
    /// `floating point` and the variable or operation that forces it
    /// (`plcc check --explain-arithmetic`).
    pub fn explain_arithmetic(&self) -> String {
        explain::explain(&self.download, &self.loaded, &self.sources)
    }

    /// Where each variable is read, written and tested.
    pub fn cross_reference(&self) -> CrossReference {
        let tables = tables::program(&self.download, &self.loaded, vec![], vec![]).tables;
        analyse::cross_reference::cross_reference(&self.download, &self.sources, &tables)
    }

    /// The names of the files that the text includes.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        (0..self.sources.len() as u32).map(|id| self.sources.path(FileId(id)))
    }
}
