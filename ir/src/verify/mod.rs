//! The verifier: checks whether a module keeps the rules that passes and code generation may take
//! for granted.
//!
//! Front ends and passes keep these rules by construction; the verifier finds mistakes in them. In
//! debug builds it runs after every pass. `structure` checks rules 1 to 5, `operation` rules 6 to
//! 8 and 10 to 13, `dominance` rule 9, `resume` rule 14. Each broken rule is a [`VerifyError`] with
//! its place, and all of them are reported.
//!
//! # Rules
//! The module:
//! 1. Regions lie inside the process image and do not overlap. The local bits lie after it.
//! 2. A task's entry is a label of the module. Each label is at exactly one block of one
//!    function, and there are as many labels as [`Module::label_count`] says. In a [`part`] of
//!    a program a label may also be nowhere.
//! 3. A statement names a source file of the module, if the module holds its source files.
//!
//! Each function:
//! 4. Entry blocks exist and have no parameters.
//! 5. Every block has a terminator. Every instruction that a block lists exists and is listed
//!    once.
//! 6. A jump passes as many values as its block has parameters, and of the same types. The blocks
//!    of a switch have no parameters.
//! 7. Operands exist and have the types that [`inst`](crate::inst) asks for. The result has the
//!    type that follows from them. Truth values are operands of `not`, `and`, `or`, `xor`,
//!    `icmp eq`, `icmp ne`, `select`, conversions, loads and stores only.
//! 8. Integer constants are in the form of [`Type::wrap`](crate::Type::wrap).
//! 9. The definition of a value dominates its uses: whichever way control takes from an entry to a
//!    use, it passes the definition first.
//! 10. A load or store stays inside its region for every index. The index is an `i32`, and the
//!     array has at least one element. Truth values are in regions of bits only, and nothing else
//!     is stored in such a region, but for groups of eight in the local bits, as an `i64`. The local
//!     bits are accessed without an index and are not volatile.
//! 11. A call of a host function has the arguments of its signature.
//! 12. The condition of a branch is an `i1`. The number of a switch, that of an indirect label, and
//!     those of a trap site and an index are `i32`s. Every label that a terminator names is a label
//!     of the module. (A trap site need not exist, also where its number is a constant, since passes
//!     may find out which number it is.)
//! 13. An instruction belongs to a statement of the module, or to none.
//!
//! The tasks:
//! 14. A task's resume points are labels of the module. The label of every suspension is a resume
//!     point of at least one task. It is a resume point of each task from whose entry or resume
//!     points control can reach the suspension. (Where a jump to a label by number leads is not
//!     known, so what is reached only through one is not checked.)
//!
//! Blocks that control cannot reach keep all rules but 9. Any block may be cold, also an entry: that
//! is about speed only.
//!
//! # Termination
//! [`every_scan_ends`] proves that every scan of a module ends, by the absence of loops. PMI's
//! programs have none, and neither have PMAC's, in which each round of a WHILE suspends the scan.
//! NCT's programs can jump back, so nothing is proven of them.
//!
//! # Order of stores
//! Whether a pass keeps the order of stores cannot be seen in one module, so no rule here is about
//! it. What passes must keep is written at the head of [`passes`](crate::passes).

#[allow(
    clippy::indexing_slicing,
    reason = "tables have a place for every block; rules about structure were checked before"
)]
mod dominance;
mod error;
mod operation;
mod resume;
mod structure;
#[allow(
    clippy::indexing_slicing,
    reason = "tables have a place for every block; rules about structure were checked before"
)]
mod termination;

pub use error::VerifyError;
pub use termination::every_scan_ends;

use crate::{FuncData, Module};
use error::Errors;

/// Checks a module and returns everything that is wrong with it.
pub fn verify(module: &Module) -> Vec<VerifyError> {
    let mut errors = self::module(module);
    for (_, func) in module.funcs() {
        errors.extend(function(module, func));
    }
    errors
}

/// What is wrong with a module apart from its functions: rules 1 to 3 and 14.
pub fn module(module: &Module) -> Vec<VerifyError> {
    whole_or_part(module, true)
}

/// The same for a [part](Module::split_off_rare) of a program, whose labels may be in functions of the other part.
pub fn part(module: &Module) -> Vec<VerifyError> {
    whole_or_part(module, false)
}

fn whole_or_part(module: &Module, is_whole: bool) -> Vec<VerifyError> {
    let mut errors = Errors::default();
    structure::check_module(module, is_whole, &mut errors);
    resume::check_module(module, &mut errors);
    errors.list
}

/// Checks one function of a module and returns everything that is wrong with it.
pub fn function(module: &Module, func: &FuncData) -> Vec<VerifyError> {
    let mut errors = Errors { function: Some(func.name().to_owned()), ..Errors::default() };
    if structure::check_function(func, &mut errors) {
        operation::check_function(module, func, &mut errors);
        dominance::check_function(func, &mut errors);
    }
    errors.list
}

#[cfg(test)]
mod tests;
