//! Compiles a source file once and gives every engine for it, so that tests can compare them.

use std::path::Path;
use std::sync::Arc;

use plcc::compile::{Checked, Optimized, artifact, check, code, jit};
use plcc::disk::Disk;
use plcc::later_code::jit_in_parts;
use plcc_abi::{Dialect, Engine, Program};
use plcc_codegen::{OptLevel, Optimization, Target};
use plcc_diag::{FileId, SourceMap, render};
use plcc_frontend::common::{FileLoader, Lowered, Options};
use plcc_ir::{Module, interp, verify};
use plcc_load::Artifact;
use plcc_random::Rng;
use plcc_runtime::NativeEngine;

/// An engine, and whether the code that it runs is optimised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EngineKind {
    /// The statement interpreter, with which the others are compared.
    Statements,
    /// The IR interpreter, on IR as lowered.
    Ir,
    /// The IR interpreter, on IR after the passes.
    IrSpeed,
    /// Native code, compiled just in time from IR as lowered.
    JitNone,
    /// Native code, compiled just in time with all passes; code that seldom runs only when a scan first comes to it.
    JitSpeed,
    /// Native code that is compiled for every processor of the architecture, written as an artifact
    /// and read back. It is made with a random set of passes, another one for each program.
    Artifact,
}

impl EngineKind {
    /// All of them, the statement interpreter first.
    pub const ALL: [Self; 6] =
        [Self::Statements, Self::Ir, Self::IrSpeed, Self::JitNone, Self::JitSpeed, Self::Artifact];
}

/// A program that has been checked and lowered.
pub struct Compiled {
    checked: Checked,
    /// As the front end lowers it.
    plain: Lowered,
    /// After all passes.
    best: Optimized,
    /// After some passes.
    some: Optimized,
}

/// A choice of passes and techniques that depends on the program only, so that a failure can be repeated, and is
/// different for most programs.
fn some_passes(module: &Module) -> Optimization {
    let size: usize = module.funcs().map(|(_, func)| func.inst_count()).sum();
    let mut rng = Rng::new(size as u64);
    Optimization::some(|| rng.chance(60))
}

/// Checks and lowers a file.
///
/// # Errors
/// The file can't be read, or has errors (they are drawn), or its IR breaks a rule.
pub fn compile(path: &Path, dialect: Dialect, options: &Options) -> Result<Compiled, String> {
    let mut sources = SourceMap::new();
    let file = add(&mut sources, path)?;
    compile_sources(&mut sources, &[file], dialect, options)
}

/// Adds a file from disk.
///
/// # Errors
/// It can't be read.
pub fn add(sources: &mut SourceMap, path: &Path) -> Result<FileId, String> {
    let bytes = Disk.read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(sources.add(path.to_string_lossy(), &bytes))
}

/// Checks and lowers sources. Only PMAC takes several, which are one download.
///
/// # Errors
/// They have errors (which are drawn), or their IR breaks a rule.
pub fn compile_sources(
    sources: &mut SourceMap,
    files: &[FileId],
    dialect: Dialect,
    options: &Options,
) -> Result<Compiled, String> {
    let (checked, found) = check(sources, files, dialect, &Disk, options);
    let errors = found.iter().filter(|diagnostic| diagnostic.is_error());
    let errors: Vec<String> = errors.map(|error| render::draw(sources, error, false)).collect();
    let Some(checked) = checked.filter(|_| errors.is_empty()) else {
        return Err(errors.join("\n"));
    };
    let plain = checked.lower().map_err(text)?;
    if let Some(error) = verify::verify(&plain.module).first() {
        return Err(format!("the IR breaks a rule: {error}"));
    }
    let best = checked.optimized(OptLevel::Speed).map_err(text)?;
    let some = checked.optimized(some_passes(&plain.module)).map_err(text)?;
    Ok(Compiled { checked, plain, best, some })
}

impl Compiled {
    /// The IR as lowered, and the same optimised.
    pub fn modules(&self) -> [&Module; 2] {
        [&self.plain.module, &self.best.module]
    }

    /// An engine, and the program as it knows it.
    ///
    /// # Errors
    /// The code can't be made, written, read back or mapped.
    pub fn engine(&self, way: EngineKind) -> Result<(Program, Box<dyn Engine>), String> {
        let interpret = |module: &Module| -> Box<dyn Engine> {
            Box::new(interp::Interpreter::new(Arc::new(module.clone())))
        };
        let engine: Box<dyn Engine> = match way {
            EngineKind::Statements => self.checked.interpreter(),
            EngineKind::Ir => interpret(&self.plain.module),
            EngineKind::IrSpeed => interpret(&self.best.module),
            EngineKind::JitNone => Box::new(jit(&self.plain.clone().into()).map_err(text)?.0),
            EngineKind::JitSpeed => {
                let made = jit_in_parts(|| Ok(self.plain.clone()), OptLevel::Speed);
                Box::new(made.map_err(text)?.engine)
            }
            EngineKind::Artifact => return self.loaded(),
        };
        Ok((self.plain.program.clone(), engine))
    }

    /// Writes the artifact, reads it as the loader does, and makes its engine.
    fn loaded(&self) -> Result<(Program, Box<dyn Engine>), String> {
        let target = Target::host_baseline().map_err(text)?;
        let code = code(&self.some, &target).map_err(text)?;
        let bytes = artifact(&self.some.program, &code).map_err(text)?;
        let Artifact { program, code, .. } = Artifact::parse(&bytes, None).map_err(text)?;
        let engine = NativeEngine::new(&code, &program).map_err(text)?;
        Ok((program, Box::new(engine)))
    }
}

fn text(error: impl std::fmt::Display) -> String {
    error.to_string()
}
