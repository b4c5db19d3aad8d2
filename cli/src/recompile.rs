//! Compiling a PMAC program again while it runs.
//!
//! Code for PMAC assumes that the definitions of M-variables stay as they are. When the program has
//! changed some, its code still gives the right results, but slowly; the runtime then asks a
//! [`PmacRecompiler`] for code that assumes the definitions as they are now.

use plcc_abi::pmac::Assumption;
use plcc_abi::{Dialect, Engine, Program, Tables};
use plcc_codegen::Optimization;
use plcc_codegen::emit::ObjectOptions;
use plcc_frontend::Recompilable;
use plcc_runtime::NativeEngine;
use plcc_runtime::pmac::{Recompiler, Recompiling, Settings};

use crate::compile::{Checked, CompileError, jit, jit_for_gdb};
use crate::fallback;
use crate::later_code::jit_in_parts;

/// Compiles a PMAC program again for other definitions of its M-variables.
pub struct PmacRecompiler {
    program: Box<dyn Recompilable>,
    how: Optimization,
    gdb: Option<ObjectOptions>,
    in_parts: bool,
}

impl PmacRecompiler {
    /// A compiler for one program, for a level or a choice of passes.
    pub fn new(program: Box<dyn Recompilable>, how: impl Into<Optimization>) -> Self {
        Self { program, how: how.into(), gdb: None, in_parts: true }
    }

    /// Whether code that seldom runs is made only when a scan first comes to it, which then takes long; all code is
    /// made at once where it is shown to gdb.
    pub fn in_parts(self, in_parts: bool) -> Self {
        Self { in_parts, ..self }
    }

    /// Has the code that is made shown to gdb, with what debuggers need by these options.
    pub fn with_gdb(self, options: Option<ObjectOptions>) -> Self {
        Self { gdb: options, ..self }
    }
}

impl Recompiler for PmacRecompiler {
    fn recompile(&mut self, assumptions: &[Assumption]) -> Result<NativeEngine, String> {
        let lower = || {
            let lowered = self.program.lower_for(assumptions);
            lowered.map_err(|error| CompileError::of_lowering(Dialect::Pmac, error))
        };
        let made = if self.in_parts && self.gdb.is_none() {
            jit_in_parts(lower, self.how).map(|made| made.engine)
        } else {
            let made = fallback::compiled(lower, self.how, |lowered| match &self.gdb {
                None => Ok(jit(lowered)?.0),
                Some(options) => jit_for_gdb(lowered, options),
            });
            made.map(|(_, engine)| engine)
        };
        made.map_err(|error| error.to_string())
    }
}

/// An engine that recompiles the program when it has invalidated what its code assumes; for
/// programs whose code assumes nothing, `native` as it is. `tables` and `native` are those of
/// `checked` as it was lowered; `gdb` has the code shown to gdb.
pub fn recompiling(
    checked: &Checked,
    tables: &Program,
    native: NativeEngine,
    how: Optimization,
    settings: Settings,
    gdb: Option<ObjectOptions>,
) -> Box<dyn Engine> {
    match (checked.recompilable(), &tables.tables) {
        (Some(program), Tables::Pmac(tables)) => {
            let assumptions = program.assumptions().to_vec();
            let compiler = PmacRecompiler::new(program, how).with_gdb(gdb);
            let compiler = Box::new(compiler.in_parts(!settings.in_thread));
            let controller = tables.controller;
            Box::new(Recompiling::new(native, &assumptions, controller, compiler, settings))
        }
        _ => Box::new(native),
    }
}
