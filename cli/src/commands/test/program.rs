//! The program of a test script: compiled once, run by as many controls as there are tests.

use std::path::{Path, PathBuf};

use plcc_abi::{Code, Engine, Program};
use plcc_codegen::{JitMemory, Target};
use plcc_diag::{Diagnostic, SourceMap};
use plcc_frontend::CheckedProgram;
use plcc_host::args::RunArgs;
use plcc_host::session;
use plcc_load::Artifact;
use plcc_plctest::Station;
use plcc_runtime::{Executive, NativeEngine};

use crate::args::{EngineArg, PassArgs, TestArgs};
use crate::compile::{self, Checked, CompileError};
use crate::failure::Failure;
use crate::input::{Input, SourceSettings};
use crate::report::Report;

/// What engines are made from.
enum Made {
    Interpreter,
    Jit(Box<Code>),
    Aot(Box<Artifact>),
}

/// A program that tests run.
pub(super) struct TestProgram {
    pub(super) checked: Box<dyn CheckedProgram>,
    pub(super) sources: SourceMap,
    pub(super) tables: Program,
    pub(super) settings: SourceSettings,
    /// How many of the sources were named; the others are included.
    pub(super) named_files: usize,
    /// The options of a run.
    pub(super) run: RunArgs,
    made: Made,
}

/// What became of a program.
pub(super) enum Loaded {
    /// It can be run.
    Program(Box<TestProgram>),
    /// It has errors: its sources and what was found in them.
    Errors(SourceMap, Vec<Diagnostic>),
}

impl TestProgram {
    /// Reads and compiles a program. `machine` is the machine file that the script names; `simulate` says whether the other side
    /// answers.
    ///
    /// # Errors
    /// When a file can't be read or used.
    pub(super) fn load(
        files: &[PathBuf],
        machine: Option<&Path>,
        simulate: bool,
        args: &TestArgs,
        report: &Report,
    ) -> Result<Loaded, Failure> {
        let mut source = args.source.clone();
        source.machine = source.machine.or_else(|| machine.map(Path::to_owned));
        let settings = SourceSettings::for_files(&source, files, report)?;
        let program = Input::read(files, &source)?.check(&settings)?;
        let has_errors = program.diagnostics.iter().any(Diagnostic::is_error);
        let Some(checked) = program.checked.filter(|_| !has_errors) else {
            return Ok(Loaded::Errors(program.sources, program.diagnostics));
        };
        let (tables, made) = match make(&checked, args) {
            Ok(made) => made,
            Err(CompileError::TooLong(diagnostic)) => {
                return Ok(Loaded::Errors(program.sources, vec![*diagnostic]));
            }
            Err(error) => return Err(error.into()),
        };
        let (checked, sources) = (checked.into_program(), program.sources);
        let named_files = program.named_files;
        let machine_path = settings.machine.clone();
        let control = args.control.clone();
        let run = RunArgs { control, machine_path, simulate, ..RunArgs::default() };
        // Records of its tests have it too.
        let run = session::with_simulation(&tables, &run, settings.machine_file());
        let run = run.map_err(|error| Failure::usage(error.to_string()))?;
        let program = Self { checked, sources, tables, settings, named_files, run, made };
        // What is wrong with the table of the simulator is told before anything runs.
        program.made().map_err(Failure::usage)?;
        Ok(Loaded::Program(Box::new(program)))
    }

    /// A control of the program, at its first power-up.
    ///
    /// # Errors
    /// When the options are not for it.
    pub(super) fn made(&self) -> Result<Box<dyn Executive + Send>, String> {
        session::simulated_executive(&self.tables, &self.run, self.settings.machine_file())
            .map_err(|error| error.to_string())
    }

    /// An engine, for one thread.
    ///
    /// # Errors
    /// When its code can't be mapped.
    pub(super) fn engine(&self) -> Result<Box<dyn Engine>, String> {
        let text = |error: &dyn std::fmt::Display| error.to_string();
        Ok(match &self.made {
            Made::Interpreter => self.checked.interpreter(),
            Made::Jit(code) => {
                let memory = Box::new(JitMemory::new(code).map_err(|error| text(&error))?);
                let engine = NativeEngine::with_memory(code, &self.tables, memory);
                Box::new(engine.map_err(|error| text(&error))?)
            }
            Made::Aot(artifact) => {
                let engine = NativeEngine::new(&artifact.code, &artifact.program);
                Box::new(engine.map_err(|error| text(&error))?)
            }
        })
    }
}

/// Compiles a program for the engine that the options name.
fn make(checked: &Checked, args: &TestArgs) -> Result<(Program, Made), CompileError> {
    let opt = PassArgs::default().at(args.opt);
    Ok(match args.engine.unwrap_or_default() {
        EngineArg::Interp => (checked.lower()?.program, Made::Interpreter),
        EngineArg::Jit => {
            let target = Target::host()?;
            let (lowered, code) =
                checked.compiled(opt, |lowered| compile::code(lowered, &target))?;
            (lowered.program, Made::Jit(Box::new(code)))
        }
        EngineArg::Aot => {
            let target = Target::host_baseline()?;
            let (lowered, artifact) = checked.compiled(opt, |lowered| {
                let code = compile::code(lowered, &target)?;
                Ok(Artifact::parse(&compile::artifact(&lowered.program, &code)?, None)?)
            })?;
            (lowered.program, Made::Aot(Box::new(artifact)))
        }
    })
}

impl Station for TestProgram {
    fn executive(&self) -> Result<Box<dyn Executive>, String> {
        let executive: Box<dyn Executive> = self.made()?;
        Ok(executive)
    }
}
