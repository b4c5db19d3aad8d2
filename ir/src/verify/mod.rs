//! Looks whether a module keeps the rules; everything else may rely on them.
//!
//! # Rules
//! The module:
//! 1. Regions lie inside the image and do not overlap.
//! 2. A task's entry is a label; a label stands at one block of one function, and there are as
//!    many as the module says.
//! 3. Statements name a source file that is there.
//! 14. A task's resume points are labels. A suspension names a resume point of every task that is
//!     known to come to it, and of some task where that is not known: a goto by number may lead
//!     anywhere, so nothing is known of what comes behind it.
//!
//! Each function:
//! 4. Entry blocks exist and have no parameters.
//! 5. Every block has a terminator. Instructions exist, and each stands in one place at most.
//! 6. A block is given as many values as it has parameters, of their types; those that a switch
//!    names have none.
//! 7. Operands exist and have the types that the operation asks for, and results the type that
//!    follows from them. Truth values are taken by `not and or xor eq ne select`, conversions and
//!    accesses alone.
//! 8. Integer constants are in the form of [`Type::wrap`](crate::Type::wrap).
//! 9. A value is defined before it is used, whichever way control comes.
//! 10. An access stays inside its region for every index; its index is an i32, and there is at
//!     least one element. Truth values stand in regions of bits only, and nothing else is stored
//!     there.
//! 11. A call of the host has the arguments of its signature.
//! 12. A branch's condition is an i1, a switch's number and an indirect label an i32. Labels that
//!     are named stand somewhere.
//! 13. An instruction belongs to a statement of the module, or to none.
//!
//! Blocks that nothing reaches keep all of it but rule 9.
//!
//! # What ends
//! [`ends_provably`] is about programs without loops: PMI scans, and PMAC's, whose WHILE
//! suspends. No value is looked at, so it holds for every input.
//!
//! # What is promised to the outside
//! There is no rule for volatile accesses, since nothing about one alone can be wrong; passes
//! neither move, merge nor drop them, nor a store that stands before one, before a trap, or
//! before a suspension.

mod dominance;
mod ends;
mod operation;
mod resume;
mod structure;

use std::fmt;

pub use ends::ends_provably;

use crate::{Block, FuncData, Inst, Module};

/// A rule that is broken, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct VerifyError {
    /// The function's name.
    pub function: Option<String>,
    /// The block.
    pub block: Option<Block>,
    /// The instruction.
    pub inst: Option<Inst>,
    /// What is wrong.
    pub message: String,
}

impl fmt::Display for VerifyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(function) = &self.function {
            write!(f, "{function}, ")?;
        }
        if let Some(block) = self.block {
            write!(f, "{block}, ")?;
        }
        if let Some(inst) = self.inst {
            write!(f, "{inst}: ")?;
        }
        f.write_str(&self.message)
    }
}

/// What is wrong with a module, all of it.
pub fn verify(module: &Module) -> Vec<VerifyError> {
    let mut errors = Errors::default();
    structure::module(module, &mut errors);
    resume::module(module, &mut errors);
    for (_, func) in module.funcs() {
        errors.list.extend(function(module, func));
    }
    errors.list
}

/// What is wrong with one function of a module, all of it.
pub fn function(module: &Module, func: &FuncData) -> Vec<VerifyError> {
    let mut errors = Errors { function: Some(func.name().to_owned()), ..Errors::default() };
    if structure::function(func, &mut errors) {
        operation::function(module, func, &mut errors);
        dominance::function(func, &mut errors);
    }
    errors.list
}

/// What was found, and where the search is.
#[derive(Default)]
struct Errors {
    function: Option<String>,
    block: Option<Block>,
    inst: Option<Inst>,
    list: Vec<VerifyError>,
}

impl Errors {
    fn push(&mut self, message: impl Into<String>) {
        self.list.push(VerifyError {
            function: self.function.clone(),
            block: self.block,
            inst: self.inst,
            message: message.into(),
        });
    }
}

#[cfg(test)]
mod tests;
