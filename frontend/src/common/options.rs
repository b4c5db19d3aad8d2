//! What the user chose for a compilation.

use std::path::PathBuf;

pub use plcc_abi::pmac::Controller;

use super::{LintLevels, Machine};

/// Whether a program may exceed the fixed limits of the original compilers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Limits {
    /// It may not: what the original compilers refused as too long or too deep is an error.
    #[default]
    Original,
    /// `--limits none`: it may. Limits of plcc's own remain, such as 256 levels of nesting and the number of instructions of IR
    /// ([`MAX_INSTRUCTIONS`](plcc_ir::chunk::MAX_INSTRUCTIONS)).
    None,
}

/// Everything that is fixed when a program is compiled.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// `--limits`: whether the limits of the original compilers hold.
    pub limits: Limits,
    /// `--define NAME=VALUE`: the macros that are defined before the text begins, in the order of
    /// the command line.
    pub defines: Vec<(String, String)>,
    /// `--controller`: the controller that the program is for.
    pub controller: Controller,
    /// `--machine`: what the machine file says.
    pub machine: Machine,
    /// `-I`: the folders in which included files are looked for, in this order.
    pub include_dirs: Vec<PathBuf>,
    /// `-A`, `-W`, `--deny` and `[lints]` of the machine file: which lints are shown, and how.
    pub lints: LintLevels,
    /// `--simulate`: whether the program will run with a simulated other side, so that errors of PMAC's motion
    /// programs are errors.
    pub simulate: bool,
}
