//! What the user chose for a compilation.

use std::path::PathBuf;

pub use plcc_abi::pmac::Controller;

use super::Machine;

/// Whether the fixed limits of the original compilers are errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Limits {
    /// As the original compilers had them.
    #[default]
    Original,
    /// `--limits none`: lifted, but for the nesting of 256 that holds everywhere.
    None,
}

/// Everything that is fixed when a program is compiled.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// `--limits`.
    pub limits: Limits,
    /// `--define NAME=VALUE`, in their order.
    pub defines: Vec<(String, String)>,
    /// `--controller`.
    pub controller: Controller,
    /// `--machine`.
    pub machine: Machine,
    /// `-I`, in their order.
    pub include_dirs: Vec<PathBuf>,
}
