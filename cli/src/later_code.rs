//! Compiling the part of a program that seldom runs only when a scan first comes to it.
//!
//! PLCs of a PMAC have two versions: one that is specialised for the definitions of M-variables, and a general one,
//! which runs only while a definition has moved. Most programs never move one, and general versions are two thirds of
//! the code. So an engine that compiles just in time starts with the specialised ones.

use std::io::{self, Write};

use plcc_abi::{Code, CodeMemory, Dialect, Program, printable};
use plcc_codegen::{JitMemory, PassSet, Target};
use plcc_frontend::common::Lowered;
use plcc_ir::Module;
use plcc_ir::passes::optimize;
use plcc_runtime::NativeEngine;
use plcc_runtime::native::LaterCode;

use crate::compile::{CompileError, generate};

/// The most IR instructions that are left for later. Their code, of some ten bytes each, is far shorter than the longest
/// that can be made, so that a program that is too long is refused before it starts.
const MOST_LATER: usize = 500_000;

/// A program that is compiled just in time.
pub struct Jit {
    /// Tables for the executive.
    pub program: Program,
    /// Its code.
    pub engine: NativeEngine,
    /// The size in bytes of the code that was made at first.
    pub bytes_of_code: usize,
}

/// Optimises a program as the front end has lowered it, and compiles it for this very machine. The functions that
/// seldom run are left out, if they are not very long; the engine has them made when a scan first comes to one. That
/// takes as long as compiling usually does, so it is not for ticks that are paced by the clock.
///
/// # Errors
/// When the code can't be made or mapped.
pub fn jit_in_parts(lowered: Lowered, passes: impl Into<PassSet>) -> Result<Jit, CompileError> {
    let (passes, target) = (passes.into(), Target::host()?);
    let Lowered { program, mut module } = lowered;
    let rest = module.split_off_rare(MOST_LATER);
    let (code, memory) = make(&mut module, passes, program.dialect(), &target)?;
    let bytes_of_code = code.bytes.len();
    let mut engine = NativeEngine::with_memory(&code, &program, memory)?;
    if let Some(module) = rest {
        let rest = Rest { module, passes, dialect: program.dialect(), target };
        engine.make_later(Box::new(rest));
    }
    Ok(Jit { program, engine, bytes_of_code })
}

/// The part of a program that has not been compiled.
struct Rest {
    module: Module,
    passes: PassSet,
    dialect: Dialect,
    target: Target,
}

impl LaterCode for Rest {
    fn make(mut self: Box<Self>) -> Result<(Code, Box<dyn CodeMemory>), String> {
        let made = make(&mut self.module, self.passes, self.dialect, &self.target);
        made.map_err(|error| {
            // The control stops with an error that can't say more than that there is no code.
            let error = error.to_string();
            let _ = writeln!(io::stderr(), "error: {}", printable(&error));
            error
        })
    }
}

/// Optimises and compiles a part of a program.
fn make(
    module: &mut Module,
    passes: PassSet,
    dialect: Dialect,
    target: &Target,
) -> Result<(Code, Box<dyn CodeMemory>), CompileError> {
    optimize(module, passes);
    let code = generate(module, dialect, target)?;
    let memory = Box::new(JitMemory::new(&code)?);
    Ok((code, memory))
}
