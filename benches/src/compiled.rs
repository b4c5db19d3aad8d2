//! Compiles source text to engines, as the command line does, and measures the time of each step.

use std::time::{Duration, Instant};

use plcc_abi::{Engine, Program};
use plcc_codegen::{CodegenOptions, Optimization, Target};
use plcc_diag::SourceMap;
use plcc_frontend::common::{Limits, Lowered, MemoryLoader, Options};
use plcc_frontend::{nct, pmac, pmi};
use plcc_ir::Module;
use plcc_runtime::NativeEngine;

/// How long each step from text to native code took.
#[derive(Clone, Copy, Debug, Default)]
pub struct Times {
    /// Reading and checking.
    pub check: Duration,
    /// Lowering to IR.
    pub lower: Duration,
    /// The passes over the IR.
    pub optimize: Duration,
    /// Machine code and mapping.
    pub codegen: Duration,
}

impl Times {
    /// The sum of all steps.
    pub fn total(&self) -> Duration {
        self.check + self.lower + self.optimize + self.codegen
    }
}

/// A compiled program.
pub struct Compiled {
    /// Its tables.
    pub program: Program,
    /// Its IR after the passes.
    pub module: Module,
    /// How code generation treats it.
    pub codegen: CodegenOptions,
    /// Native code.
    pub native: NativeEngine,
    /// The statement interpreter.
    pub interpreter: Box<dyn Engine>,
    /// Bytes of native code.
    pub code_bytes: usize,
    /// The time of each step.
    pub times: Times,
}

/// Without the limits of the original compilers: generated programs are long.
fn unlimited() -> Options {
    Options { limits: Limits::None, ..Options::default() }
}

/// Compiles a PMI program for this machine.
///
/// # Errors
/// When the program has errors, which the text lists, or no code can be made for it.
pub fn pmi(source: &str, how: impl Into<Optimization>) -> Result<Compiled, String> {
    let mut times = Times::default();
    let start = Instant::now();
    let mut sources = SourceMap::new();
    let file = sources.add("bench.pmi", source.as_bytes());
    let loader = MemoryLoader::new();
    let (program, diagnostics) = pmi::check(&mut sources, file, &loader, &unlimited());
    times.check = start.elapsed();
    let Some(program) = program else {
        return Err(diagnostics
            .first()
            .map_or_else(String::new, |first| first.message.to_string()));
    };
    let start = Instant::now();
    let lowered = program.lower().map_err(|error| error.to_string())?;
    times.lower = start.elapsed();
    finish(lowered, program.interpreter(), times, how.into())
}

/// Compiles a PMAC download for this machine.
///
/// # Errors
/// When the program has errors, which the text lists, or no code can be made for it.
pub fn pmac(source: &str, how: impl Into<Optimization>) -> Result<Compiled, String> {
    let mut times = Times::default();
    let start = Instant::now();
    let mut sources = SourceMap::new();
    let file = sources.add("bench.pmc", source.as_bytes());
    let loader = MemoryLoader::new();
    let (program, all) = pmac::check(&mut sources, &[file], &loader, &unlimited());
    times.check = start.elapsed();
    if let Some(error) = all.iter().find(|d| d.is_error()) {
        return Err(error.message.to_string());
    }
    let program = program.ok_or("no program")?;
    let start = Instant::now();
    let lowered = program.lower().map_err(|error| error.to_string())?;
    times.lower = start.elapsed();
    finish(lowered, program.interpreter(), times, how.into())
}

/// Compiles an NCT program for this machine.
///
/// # Errors
/// When the program has errors, which the text lists, or no code can be made for it.
pub fn nct(source: &str, how: impl Into<Optimization>) -> Result<Compiled, String> {
    let mut times = Times::default();
    let start = Instant::now();
    let mut sources = SourceMap::new();
    let file = sources.add("bench.nct", source.as_bytes());
    let loader = MemoryLoader::new();
    let (program, all) = nct::check(&mut sources, file, &loader, &unlimited());
    times.check = start.elapsed();
    let Some(program) = program else {
        return Err(all.first().map_or_else(String::new, |first| first.message.to_string()));
    };
    let start = Instant::now();
    let lowered = program.lower().map_err(|error| error.to_string())?;
    times.lower = start.elapsed();
    finish(lowered, program.interpreter(), times, how.into())
}

fn finish(
    lowered: Lowered,
    interpreter: Box<dyn Engine>,
    mut times: Times,
    how: Optimization,
) -> Result<Compiled, String> {
    let start = Instant::now();
    let mut module = lowered.module;
    let codegen = how.run(&mut module).0;
    times.optimize = start.elapsed();
    let start = Instant::now();
    let target = Target::host().map_err(|error| error.to_string())?;
    let code =
        plcc_codegen::compile(&module, &target, codegen).map_err(|error| error.to_string())?;
    let native = NativeEngine::new(&code, &lowered.program).map_err(|error| error.to_string())?;
    times.codegen = start.elapsed();
    Ok(Compiled {
        program: lowered.program,
        module,
        codegen,
        native,
        interpreter,
        code_bytes: code.bytes.len(),
        times,
    })
}
