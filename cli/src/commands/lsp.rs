//! `plcc lsp`: the Language Server Protocol on standard input and output.

use plcc_codegen::{Optimization, Target};
use plcc_frontend::CheckedProgram;
use plcc_lsp::Compiler;

use crate::compile::{Optimized, code};
use crate::failure::{DONE, Failure};

pub(crate) fn lsp() -> Result<u8, Failure> {
    plcc_lsp::serve_stdio(&MachineCode).map_err(|error| {
        Failure::usage(format!(
            "standard input is not a stream of messages of the Language Server Protocol, which an editor \
             writes: {error}"
        ))
    })?;
    Ok(DONE)
}

/// Compiles a program to compare it with another one.
struct MachineCode;

impl Compiler for MachineCode {
    fn code(&self, program: &dyn CheckedProgram) -> Option<Vec<u8>> {
        let (optimized, _) = Optimized::of(program.lower().ok()?, Optimization::ALL);
        Some(code(&optimized, &Target::host().ok()?).ok()?.bytes.clone())
    }
}
