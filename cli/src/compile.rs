//! From source text to engines. The one place that tells the languages apart.

use plcc_abi::pmac::Relied;
use plcc_abi::{Code, Dialect, Engine, Program, Tables};
use plcc_codegen::{CodegenError, OptLevel, Target};
use plcc_diag::{Diagnostic, FileId, SourceMap};
use plcc_frontend::common::{FileLoader, Lowered, Options};
use plcc_frontend::{nct, pmac, pmi};
use plcc_runtime::NativeEngine;
use plcc_runtime::artifact::{self, Artifact, ArtifactError};
use plcc_runtime::native::NativeError;
use plcc_runtime::pmac::{Recompiler, Recompiling, Settings};
use thiserror::Error;

/// A program without errors, or one whose broken parts may be left out.
#[derive(Clone, Debug)]
pub enum Checked {
    /// PMI's.
    Pmi(pmi::Program),
    /// NCT's.
    Nct(nct::Program),
    /// PMAC's.
    Pmac(pmac::Program),
}

/// Reads and checks a program: one file, or for PMAC several as one download. Included files are
/// added to `sources`.
///
/// There is a program where there is no error, and for PMAC also where all errors are broken
/// structures: the caller decides whether it runs without those PLCs (`--keep-going`).
pub fn check(
    sources: &mut SourceMap,
    files: &[FileId],
    dialect: Dialect,
    loader: &dyn FileLoader,
    options: &Options,
) -> (Option<Checked>, Vec<Diagnostic>) {
    fn wrap<P>(
        (program, diagnostics): (Option<P>, Vec<Diagnostic>),
        checked: fn(P) -> Checked,
    ) -> (Option<Checked>, Vec<Diagnostic>) {
        (program.map(checked), diagnostics)
    }
    let first = files.first().copied().unwrap_or(FileId(0));
    match dialect {
        Dialect::Pmi => wrap(pmi::check(sources, first, loader, options), Checked::Pmi),
        Dialect::Nct => wrap(nct::check(sources, first, loader, options), Checked::Nct),
        Dialect::Pmac => wrap(pmac::check(sources, files, loader, options), Checked::Pmac),
    }
}

impl Checked {
    /// The statement interpreter.
    pub fn interpreter(&self) -> Box<dyn Engine> {
        match self {
            Self::Pmi(program) => program.interpreter(),
            Self::Nct(program) => program.interpreter(),
            Self::Pmac(program) => program.interpreter(),
        }
    }

    /// Tables for the executive, and IR as the front end makes it.
    pub fn lower(&self) -> Lowered {
        match self {
            Self::Pmi(program) => program.lower(),
            Self::Nct(program) => program.lower(),
            Self::Pmac(program) => program.lower(),
        }
    }

    /// What each statement is computed in, integers or floating point; for the language where that
    /// is a question.
    pub fn explain_arithmetic(&self) -> Option<String> {
        match self {
            Self::Pmac(program) => Some(program.explain_arithmetic()),
            Self::Pmi(_) | Self::Nct(_) => None,
        }
    }

    /// The same as [`lower`](Self::lower) after the passes.
    pub fn optimized(&self, opt: OptLevel) -> Lowered {
        let mut lowered = self.lower();
        plcc_ir::passes::optimize(&mut lowered.module, opt);
        lowered
    }
}

/// What listings say of the variables that a program names, a line each; for the language whose
/// numbers say nothing by themselves.
pub fn notes(program: &Program) -> Vec<String> {
    match &program.tables {
        Tables::Pmac(tables) => pmac::reference::listing_comments::notes(tables),
        Tables::Pmi(_) | Tables::Nct(_) => Vec::new(),
    }
}

/// Why a checked program is not compiled: a defect of plcc, or a program beyond all measure.
#[derive(Debug, Error)]
pub enum CompileError {
    /// No machine code could be made.
    #[error(transparent)]
    Codegen(#[from] CodegenError),
    /// The code can't be run here.
    #[error(transparent)]
    Native(#[from] NativeError),
    /// The artifact can't be made.
    #[error(transparent)]
    Artifact(#[from] ArtifactError),
}

/// Code for this very machine, mapped, and its size in bytes.
///
/// # Errors
/// When the code can't be made or mapped.
pub fn jit(lowered: &Lowered) -> Result<(NativeEngine, usize), CompileError> {
    let code = plcc_codegen::compile(&lowered.module, &Target::host()?)?;
    Ok((NativeEngine::new(&code, &lowered.program)?, code.bytes.len()))
}

/// Native code of a PMAC download for other definitions of its M-variables.
struct Anew {
    program: pmac::Program,
    opt: OptLevel,
}

impl Recompiler for Anew {
    fn recompile(&mut self, relied: &[Relied]) -> Result<NativeEngine, String> {
        let mut lowered = self.program.lower_for(relied);
        plcc_ir::passes::optimize(&mut lowered.module, self.opt);
        let compiled = jit(&lowered);
        compiled.map(|(engine, _)| engine).map_err(|error| error.to_string())
    }
}

/// What compiles a PMAC download for other definitions of its M-variables.
pub fn recompiler(program: &pmac::Program, opt: OptLevel) -> Box<dyn Recompiler> {
    Box::new(Anew { program: program.clone(), opt })
}

/// Native code as it is, or for a PMAC download code that is made anew when the program has moved
/// definitions of M-variables. `tables` and `native` are those of `checked` as it was lowered.
pub fn anew(
    checked: &Checked,
    tables: &Program,
    native: NativeEngine,
    opt: OptLevel,
    settings: Settings,
) -> Box<dyn Engine> {
    match (checked, &tables.tables) {
        (Checked::Pmac(program), Tables::Pmac(tables)) => {
            let compiler = recompiler(program, opt);
            let relied = program.relied();
            Box::new(Recompiling::new(native, relied, tables.turbo, compiler, settings))
        }
        _ => Box::new(native),
    }
}

/// Code for a target.
///
/// # Errors
/// When it can't be made.
pub fn code(lowered: &Lowered, target: &Target) -> Result<Code, CompileError> {
    Ok(plcc_codegen::compile(&lowered.module, target)?)
}

/// An artifact's bytes.
///
/// # Errors
/// When the code can't be made or the loader would not take it.
pub fn artifact(program: &Program, code: &Code) -> Result<Vec<u8>, CompileError> {
    Ok(artifact::encode(program, code)?)
}

/// Compiles ahead of time for machines like this one and loads the result, in memory; with the
/// size of its code in bytes.
///
/// # Errors
/// When any step fails.
pub fn aot(lowered: &Lowered) -> Result<(NativeEngine, usize), CompileError> {
    let code = code(lowered, &Target::host_baseline()?)?;
    let loaded = Artifact::parse(&artifact(&lowered.program, &code)?)?;
    Ok((NativeEngine::new(&loaded.code, &loaded.program)?, loaded.code.bytes.len()))
}
