//! Why code generation fails: [`CodegenError`], and the [`InternalError`] in it.

use std::any::Any;
use std::fmt;

use plcc_ir::{FuncData, Inst, Module};
use thiserror::Error;

/// The longest code of a program, in bytes. Programs of 20 000 lines have some 2 MiB.
pub const MAX_CODE: usize = 32 << 20;

/// Why a program can't be compiled or made ready to run.
#[derive(Debug, Error)]
pub enum CodegenError {
    /// The target's name is not known, or code for it can't be made.
    #[error("code for target `{triple}` can't be made: {reason}")]
    Target {
        /// The target as asked for.
        triple: String,
        /// Why not.
        reason: String,
    },
    /// The IR breaks a rule of the verifier, or Cranelift refuses what was made of it: an error in
    /// plcc, never in the program.
    #[error(transparent)]
    Internal(Box<InternalError>),
    /// The system does not give memory from which code can be executed.
    #[error("no executable memory: {reason}")]
    Memory {
        /// Why not.
        reason: String,
    },
    /// The code is longer than [`MAX_CODE`](crate::MAX_CODE). Holds the first statement of the
    /// function with which it became too long.
    #[error("the program's code is over {} MiB long; split the program", crate::MAX_CODE >> 20)]
    TooLong(Option<plcc_ir::Statement>),
}

impl CodegenError {
    /// An internal error that belongs to no function.
    pub(crate) fn internal(reason: impl Into<String>) -> Self {
        Self::Internal(Box::new(InternalError {
            reason: reason.into(),
            ..InternalError::default()
        }))
    }
}

/// An error in plcc that code generation found, and where. The command line shows it and asks for a
/// report.
#[derive(Clone, Debug, Default, PartialEq, Eq, Error)]
pub struct InternalError {
    /// The function's name in the IR, where it is known.
    pub function: Option<String>,
    /// The instruction, where it is known: its number and what it is.
    pub instruction: Option<String>,
    /// The source's file and line (from 1) that the instruction was made for, where it is known.
    pub place: Option<(String, u32)>,
    /// What is wrong.
    pub reason: String,
}

impl InternalError {
    /// An error at an instruction of a function, or somewhere in it.
    pub(crate) fn new(
        module: &Module,
        func: &FuncData,
        inst: Option<Inst>,
        reason: impl Into<String>,
    ) -> Self {
        let known = inst.filter(|inst| inst.index() < func.inst_count());
        let place = known.and_then(|inst| {
            let statement = module.statements.get(func.loc(inst).0 as usize)?;
            let file = module.files.get(statement.file as usize)?;
            Some((file.name.clone(), statement.line))
        });
        Self {
            function: Some(func.name().into()),
            instruction: known.map(|inst| format!("{inst}, {:?}", func.inst(inst))),
            place,
            reason: reason.into(),
        }
    }
}

impl fmt::Display for InternalError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.reason)?;
        if let Some(function) = &self.function {
            write!(f, "; function `{function}`")?;
        }
        if let Some(instruction) = &self.instruction {
            write!(f, ", instruction {instruction}")?;
        }
        if let Some((file, line)) = &self.place {
            write!(f, " (at {file}:{line})")?;
        }
        Ok(())
    }
}

impl From<InternalError> for CodegenError {
    fn from(error: InternalError) -> Self {
        Self::Internal(Box::new(error))
    }
}

/// The message of a caught panic.
pub fn panic_text(payload: &(dyn Any + Send)) -> &str {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("a panic without a message")
}
