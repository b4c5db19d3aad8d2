//! A source file in every engine.

use std::path::Path;
use std::sync::Arc;
use std::{fs, io};

use plcc_abi::{Dialect, Engine, Program};
use plcc_codegen::{CodegenError, OptLevel, Target};
use plcc_diag::{Diagnostic, SourceMap, render};
use plcc_frontend::common::{FileLoader, Lowered, Options};
use plcc_frontend::{nct, pmac, pmi};
use plcc_ir::{Module, interp, passes};
use plcc_runtime::{Artifact, NativeEngine, artifact};

/// Files of the disk.
#[derive(Clone, Copy, Debug)]
pub struct Disk;

impl FileLoader for Disk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        fs::read(path)
    }

    fn list(&self, dir: &Path) -> Vec<String> {
        let here = if dir.as_os_str().is_empty() { Path::new(".") } else { dir };
        let entries = fs::read_dir(here).into_iter().flatten().flatten();
        entries.filter_map(|entry| entry.file_name().into_string().ok()).collect()
    }
}

/// The ways in which a program is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// The statement interpreter, which the others are held against.
    Statements,
    /// The IR interpreter.
    Ir,
    /// Compiled, not optimised.
    JitNone,
    /// Compiled and optimised.
    JitSpeed,
    /// Compiled for any processor of the kind, written as an artifact and read back.
    Artifact,
}

impl Way {
    /// All of them, the oracle first.
    pub const ALL: [Self; 5] =
        [Self::Statements, Self::Ir, Self::JitNone, Self::JitSpeed, Self::Artifact];
}

/// A program that has been checked and lowered.
pub struct Compiled {
    checked: Checked,
    program: Program,
    module: Arc<Module>,
    /// The same, optimised.
    best: Arc<Module>,
}

enum Checked {
    Pmi(Box<pmi::Program>),
    Nct(Box<nct::Program>),
    Pmac(Box<pmac::Program>),
}

/// Checks and lowers a file.
///
/// # Errors
/// The file can't be read, or has errors: they are drawn.
pub fn compile(path: &Path, dialect: Dialect, options: &Options) -> Result<Compiled, String> {
    let bytes = fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut sources = SourceMap::new();
    let file = sources.add(path.to_string_lossy(), &bytes);
    let found: (Option<(Checked, Lowered)>, Vec<Diagnostic>) = match dialect {
        Dialect::Pmi => {
            let (program, all) = pmi::check(&mut sources, file, &Disk, options);
            (program.map(|p| (p.lower(), p)).map(|(l, p)| (Checked::Pmi(Box::new(p)), l)), all)
        }
        Dialect::Nct => {
            let (program, all) = nct::check(&mut sources, file, &Disk, options);
            (program.map(|p| (p.lower(), p)).map(|(l, p)| (Checked::Nct(Box::new(p)), l)), all)
        }
        Dialect::Pmac => {
            let (program, all) = pmac::check(&mut sources, &[file], &Disk, options);
            (program.map(|p| (p.lower(), p)).map(|(l, p)| (Checked::Pmac(Box::new(p)), l)), all)
        }
    };
    let errors = found.1.iter().filter(|diagnostic| diagnostic.is_error());
    let errors: Vec<String> = errors.map(|error| render::draw(&sources, error, false)).collect();
    match found.0 {
        Some((checked, lowered)) if errors.is_empty() => {
            let Lowered { program, module } = lowered;
            if let Some(error) = plcc_ir::verify::verify(&module).first() {
                return Err(format!("the IR breaks a rule: {error}"));
            }
            let mut best = module.clone();
            passes::optimize(&mut best, OptLevel::Speed);
            Ok(Compiled { checked, program, module: Arc::new(module), best: Arc::new(best) })
        }
        _ => Err(errors.join("\n")),
    }
}

impl Compiled {
    /// An engine, and the program as it knows it.
    ///
    /// # Errors
    /// The code can't be made, written, read back or mapped.
    pub fn engine(&self, way: Way) -> Result<(Program, Box<dyn Engine>), String> {
        let native = |module: &Module, target: Result<Target, CodegenError>| -> Result<_, String> {
            let target = target.map_err(|error| error.to_string())?;
            plcc_codegen::compile(module, &target).map_err(|error| error.to_string())
        };
        let map = |program: Program, code| -> Result<(Program, Box<dyn Engine>), String> {
            let engine = NativeEngine::new(&code, &program).map_err(|error| error.to_string())?;
            Ok((program, Box::new(engine)))
        };
        match way {
            Way::Statements => {
                let engine = match &self.checked {
                    Checked::Pmi(program) => program.interpreter(),
                    Checked::Nct(program) => program.interpreter(),
                    Checked::Pmac(program) => program.interpreter(),
                };
                Ok((self.program.clone(), engine))
            }
            Way::Ir => {
                let engine = interp::Interpreter::new(Arc::clone(&self.module));
                Ok((self.program.clone(), Box::new(engine)))
            }
            Way::JitNone => {
                map(self.program.clone(), native(&self.module, Target::host(OptLevel::None))?)
            }
            Way::JitSpeed => {
                map(self.program.clone(), native(&self.best, Target::host(OptLevel::Speed))?)
            }
            Way::Artifact => {
                let code = native(&self.best, Target::host_baseline(OptLevel::Speed))?;
                let bytes = artifact::encode(&self.program, &code).map_err(|e| e.to_string())?;
                let read = Artifact::parse(&bytes).map_err(|error| error.to_string())?;
                map(read.program, read.code)
            }
        }
    }
}
