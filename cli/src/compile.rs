//! From source text to engines.

use plcc_abi::{Code, Dialect, Engine, GivenName, OperatorPanel, Program};
use plcc_codegen::emit::{ObjectOptions, debug_object};
use plcc_codegen::{CodegenError, CodegenOptions, JitMemory, Optimization, Target};
use plcc_diag::{Diagnostic, FileId, MessageText, SourceMap, Span};
use plcc_frontend::common::{
    BrokenInvariant, CrossReference, FileLoader, LowerError, Lowered, Options,
};
use plcc_frontend::presentation::operator_panel;
use plcc_frontend::{CheckedProgram, language};
use plcc_ir::passes::PassTimes;
use plcc_ir::{Module, Statement};
use plcc_load::{self, Artifact, ArtifactError, Attached};
use plcc_runtime::NativeEngine;
use plcc_runtime::native::NativeError;
use thiserror::Error;

use crate::{fallback, names};

/// A program without errors, or one whose broken parts may be left out.
#[derive(Debug)]
pub struct Checked {
    program: Box<dyn CheckedProgram>,
    /// What people call its variables.
    names: Vec<GivenName>,
}

/// Reads and checks a program: one file, or several where the language loads several as one
/// program. Included files are added to `sources`.
///
/// There is a program where there is no error, and where the language can run the rest of a program
/// whose broken parts are left out: the caller decides whether it does (`--keep-going`).
pub fn check(
    sources: &mut SourceMap,
    files: &[FileId],
    dialect: Dialect,
    loader: &dyn FileLoader,
    options: &Options,
) -> (Option<Checked>, Vec<Diagnostic>) {
    let (program, diagnostics) = language(dialect).check(sources, files, loader, options);
    let named = |program: Box<dyn CheckedProgram>| Checked {
        names: names::given(program.as_ref(), &options.machine),
        program,
    };
    (program.map(named), diagnostics)
}

impl Checked {
    /// The program itself.
    pub fn program(&self) -> &dyn CheckedProgram {
        self.program.as_ref()
    }

    /// What people call the variables and say of them.
    pub fn names(&self) -> &[GivenName] {
        &self.names
    }

    /// What an operator sees of the control's panels.
    pub fn operator_panel(&self) -> OperatorPanel {
        operator_panel(self.program())
    }

    /// The program itself.
    pub fn into_program(self) -> Box<dyn CheckedProgram> {
        self.program
    }

    /// The statement interpreter.
    pub fn interpreter(&self) -> Box<dyn Engine> {
        self.program.interpreter()
    }

    /// Tables for the executive, and IR as the front end makes it.
    ///
    /// # Errors
    /// When the program is too long, or the front end notices a mistake of its own.
    pub fn lower(&self) -> Result<Lowered, CompileError> {
        let lowered = self.program.lower();
        let mut lowered =
            lowered.map_err(|error| CompileError::of_lowering(self.program.dialect(), error))?;
        lowered.program.names.clone_from(&self.names);
        Ok(lowered)
    }

    /// What each statement is computed in, integers or floating point; for languages where the
    /// compiler chooses.
    ///
    /// # Errors
    /// As those of [`lower`](Self::lower).
    pub fn explain_arithmetic(&self) -> Option<Result<String, CompileError>> {
        let explained = self.program.explain_arithmetic()?;
        Some(explained.map_err(|error| CompileError::of_lowering(self.program.dialect(), error)))
    }

    /// Where each variable is read, written and tested.
    pub fn cross_reference(&self) -> CrossReference {
        self.program.cross_reference()
    }

    /// The same as [`lower`](Self::lower) after the passes of a level, or of a choice.
    ///
    /// # Errors
    /// When the program is too long, or the front end notices a mistake of its own.
    pub fn optimized(&self, how: impl Into<Optimization>) -> Result<Optimized, CompileError> {
        Ok(self.optimized_timed(how)?.0)
    }

    /// The same as [`optimized`](Self::optimized), with the time that each pass took.
    ///
    /// # Errors
    /// As there.
    pub fn optimized_timed(
        &self,
        how: impl Into<Optimization>,
    ) -> Result<(Optimized, PassTimes), CompileError> {
        Ok(Optimized::of(self.lower()?, how))
    }

    /// Optimises the program and has `make` make something of it. If that refuses what the passes made of a function, it
    /// gets the function as the front end wrote it, and a warning asks for a report.
    ///
    /// # Errors
    /// When the program is too long, or `make` fails for another reason.
    pub fn compiled<T>(
        &self,
        how: impl Into<Optimization>,
        make: impl Fn(&Optimized) -> Result<T, CompileError>,
    ) -> Result<(Optimized, T), CompileError> {
        fallback::compiled(|| self.lower(), how.into(), make)
    }
}

/// A program whose IR has been optimised, or left as it was, with what code generation has to know of that.
#[derive(Clone, Debug)]
pub struct Optimized {
    /// For the executive: layout, tasks, tables.
    pub program: Program,
    /// The code.
    pub module: Module,
    /// How machine code is made of it.
    pub codegen: CodegenOptions,
}

impl Optimized {
    /// Runs the passes over a program. Returns the time that each pass took too.
    pub fn of(lowered: Lowered, how: impl Into<Optimization>) -> (Self, PassTimes) {
        let Lowered { program, mut module, return_stack: _ } = lowered;
        let (codegen, times) = how.into().run(&mut module);
        (Self { program, module, codegen }, times)
    }
}

impl From<Lowered> for Optimized {
    /// The program as the front end wrote it.
    fn from(lowered: Lowered) -> Self {
        Self::of(lowered, Optimization::NONE).0
    }
}

/// Why a checked program is not compiled.
#[derive(Debug, Error)]
pub enum CompileError {
    /// No IR could be made.
    #[error(transparent)]
    Lower(#[from] BrokenInvariant),
    /// The program is longer than the compiler takes. The diagnostic says where it becomes so.
    #[error("{}", .0.message)]
    TooLong(Box<Diagnostic>),
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

impl CompileError {
    /// Why a program of a language was not lowered.
    pub(crate) fn of_lowering(dialect: Dialect, error: LowerError) -> Self {
        match error {
            LowerError::Internal(error) => error.into(),
            LowerError::TooLong(statement) => {
                let code = language(dialect).length_codes().instructions;
                let what = "the program is too long: with this statement it has more than \
                            524 288 instructions of IR, or the statement more than 131 072";
                Self::TooLong(Box::new(too_long(code, statement, what)))
            }
        }
    }

    /// Whether the compiler is to blame. Else the program is beyond what can be addressed, or the
    /// system does not give what is needed.
    pub fn is_internal(&self) -> bool {
        match self {
            Self::Codegen(
                CodegenError::Target { .. }
                | CodegenError::Memory { .. }
                | CodegenError::TooLong(_),
            ) => false,
            Self::TooLong(_) => false,
            Self::Native(NativeError::Map(_) | NativeError::Machine(_)) => false,
            Self::Artifact(ArtifactError::TooLarge { .. }) => false,
            Self::Lower(_) | Self::Codegen(_) | Self::Native(_) | Self::Artifact(_) => true,
        }
    }
}

/// The diagnostic for a program that is too long, at the statement with which it becomes so.
fn too_long(code: &'static str, statement: Statement, what: impl Into<MessageText>) -> Diagnostic {
    let Statement { file, start, end, .. } = statement;
    Diagnostic::error(code, Span { file: FileId(file), start, end }, what).help("split the program")
}

/// Code for a target. Code that is too long becomes a diagnostic.
///
/// # Errors
/// When it can't be made.
pub fn code(optimized: &Optimized, target: &Target) -> Result<Code, CompileError> {
    code_with(optimized, target, optimized.codegen)
}

/// The same for a [part](Module::split_off_rare) of a program.
pub(crate) fn code_of_part(optimized: &Optimized, target: &Target) -> Result<Code, CompileError> {
    code_with(optimized, target, optimized.codegen.of_part())
}

fn code_with(
    optimized: &Optimized,
    target: &Target,
    options: CodegenOptions,
) -> Result<Code, CompileError> {
    let dialect = optimized.program.dialect();
    plcc_codegen::compile(&optimized.module, target, options).map_err(|error| match error {
        CodegenError::TooLong(Some(statement)) => {
            let code = language(dialect).length_codes().machine_code;
            let what = "the program is too long: with the code of this statement and those after \
                        it, its machine code has more than 32 MiB";
            CompileError::TooLong(Box::new(too_long(code, statement, what)))
        }
        other => other.into(),
    })
}

/// Code for this very machine, in memory of cranelift-jit, and its size in bytes.
///
/// # Errors
/// When the code can't be made or mapped.
pub fn jit(optimized: &Optimized) -> Result<(NativeEngine, usize), CompileError> {
    let code = code(optimized, &Target::host()?)?;
    let memory = Box::new(JitMemory::new(&code)?);
    Ok((NativeEngine::with_memory(&code, &optimized.program, memory)?, code.bytes.len()))
}

/// Does what [`jit`] does, and shows the code to gdb, with what debuggers need by these options.
///
/// # Errors
/// When the code can't be made or mapped.
pub fn jit_for_gdb(
    optimized: &Optimized,
    options: &ObjectOptions,
) -> Result<NativeEngine, CompileError> {
    let target = Target::host()?;
    let code = code(optimized, &target)?;
    let debug = debug_object(&optimized.program, &code, &target, options)?;
    let memory = Box::new(JitMemory::new(&code)?);
    let mut engine = NativeEngine::with_memory(&code, &optimized.program, memory)?;
    engine.show_to_gdb(&debug).map_err(NativeError::Misfit)?;
    Ok(engine)
}

/// An artifact's bytes, without a debug part.
///
/// # Errors
/// When the code can't be made or the loader would not take it.
pub fn artifact(program: &Program, code: &Code) -> Result<Vec<u8>, CompileError> {
    Ok(plcc_load::encode(program, code)?)
}

/// The same with the debug part, by which `--gdb` shows the code to gdb. `target` is that of the code.
///
/// # Errors
/// When the loader would not take the artifact, or debuggers know no such machine.
pub fn artifact_with_debug(
    program: &Program,
    code: &Code,
    target: &Target,
    options: &ObjectOptions,
) -> Result<Vec<u8>, CompileError> {
    artifact_with(program, code, Some((target, options)), Attached::default())
}

/// An artifact with a debug part, where a target and options of it are given, and with what else is `attached`: sources, as
/// [`RecordedSources::to_bytes`](plcc_record::RecordedSources::to_bytes) writes them, and the operator's screen.
///
/// # Errors
/// As [`artifact_with_debug`].
pub fn artifact_with(
    program: &Program,
    code: &Code,
    debug: Option<(&Target, &ObjectOptions)>,
    attached: Attached<'_>,
) -> Result<Vec<u8>, CompileError> {
    let debug = debug.map(|(target, options)| debug_object(program, code, target, options));
    let debug = debug.transpose()?.unwrap_or_default();
    Ok(plcc_load::encode_with(program, code, Attached { debug: &debug, ..attached })?)
}

/// Compiles ahead of time for machines like this one and loads the result, in memory; with the
/// size of its code in bytes.
///
/// # Errors
/// When any step fails.
pub fn aot(optimized: &Optimized) -> Result<(NativeEngine, usize), CompileError> {
    let code = code(optimized, &Target::host_baseline()?)?;
    let loaded = Artifact::parse(&artifact(&optimized.program, &code)?, None)?;
    Ok((NativeEngine::new(&loaded.code, &loaded.program)?, loaded.code.bytes.len()))
}

/// Does what [`aot`] does, and shows the code to gdb.
///
/// # Errors
/// When any step fails.
pub fn aot_for_gdb(
    optimized: &Optimized,
    options: &ObjectOptions,
) -> Result<NativeEngine, CompileError> {
    let target = Target::host_baseline()?;
    let code = code(optimized, &target)?;
    let bytes = artifact_with_debug(&optimized.program, &code, &target, options)?;
    let loaded = Artifact::parse(&bytes, None)?;
    let mut engine = NativeEngine::new(&loaded.code, &loaded.program)?;
    engine.show_to_gdb(&loaded.debug).map_err(NativeError::Misfit)?;
    Ok(engine)
}
