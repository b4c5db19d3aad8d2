//! Compiling the part of a program that seldom runs only when a scan first comes to it.
//!
//! PLCs of a PMAC have two versions: one that is specialised for the definitions of M-variables, and a general one,
//! which runs only while a definition has moved. Most programs never move one, and general versions are two thirds of
//! the code. So an engine that compiles just in time starts with the specialised ones.

use std::io::{self, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};

use plcc_abi::{Code, CodeMemory, Program, printable};
use plcc_codegen::{JitMemory, Optimization, Target};
use plcc_frontend::common::Lowered;
use plcc_runtime::NativeEngine;
use plcc_runtime::native::LaterCode;

use crate::compile::{CompileError, Optimized, code, code_of_part, jit};
use crate::fallback;

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

/// Lowers a program, optimises it, and compiles it for this very machine. The functions that
/// seldom run are left out, if they are not very long; the engine has them made when a scan first comes to one. That
/// takes as long as compiling usually does, so it is not for ticks that are paced by the clock.
///
/// # Errors
/// When the code can't be made or mapped.
pub fn jit_in_parts(
    lower: impl Fn() -> Result<Lowered, CompileError>,
    how: impl Into<Optimization>,
) -> Result<Jit, CompileError> {
    let how = how.into();
    if !fallback::is_allowed() {
        return in_parts(lower()?, how);
    }
    match catch_unwind(AssertUnwindSafe(|| in_parts(lower()?, how))) {
        Ok(Ok(made)) => Ok(made),
        Ok(Err(error)) if !error.is_internal() => Err(error),
        // All is compiled at once where the compiler has made a mistake.
        _ => {
            let (optimized, (engine, bytes_of_code)) = fallback::compiled(lower, how, jit)?;
            Ok(Jit { program: optimized.program, engine, bytes_of_code })
        }
    }
}

/// Compiles those functions of a program that run as a rule.
fn in_parts(mut lowered: Lowered, how: Optimization) -> Result<Jit, CompileError> {
    let target = Target::host()?;
    let rest = lowered.module.split_off_rare(MOST_LATER);
    let optimized = Optimized::of(lowered, how).0;
    let code = match rest {
        None => code(&optimized, &target)?,
        Some(_) => code_of_part(&optimized, &target)?,
    };
    let program = optimized.program;
    let memory = Box::new(JitMemory::new(&code)?);
    let bytes_of_code = code.bytes.len();
    let mut engine = NativeEngine::with_memory(&code, &program, memory)?;
    if let Some(module) = rest {
        let lowered = Lowered { program: program.clone(), module, return_stack: None };
        engine.make_later(Box::new(LaterFunctions { lowered, how, target }));
    }
    Ok(Jit { program, engine, bytes_of_code })
}

/// The part of a program that has not been compiled.
struct LaterFunctions {
    lowered: Lowered,
    how: Optimization,
    target: Target,
}

impl LaterCode for LaterFunctions {
    fn make(self: Box<Self>) -> Result<(Code, Box<dyn CodeMemory>), String> {
        let Self { lowered, how, target } = *self;
        let make = |optimized: &Optimized| -> Result<(Code, Box<dyn CodeMemory>), CompileError> {
            let code = code_of_part(optimized, &target)?;
            let memory = Box::new(JitMemory::new(&code)?);
            Ok((code, memory))
        };
        let made = fallback::compiled(|| Ok(lowered.clone()), how, make);
        made.map(|(_, made)| made).map_err(|error| {
            // The control stops with an error that can't say more than that there is no code.
            let error = error.to_string();
            let _ = writeln!(io::stderr(), "error: {}", printable(&error));
            error
        })
    }
}
