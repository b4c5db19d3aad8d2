//! What the end-to-end tests have in common: [`compile`] makes every engine of a source file,
//! [`drive`] runs a control with a stimulus tick by tick, the modules `gen_…` and [`arithmetic`]
//! make random programs, [`shrink`] reduces a failing program to the lines that matter, [`loader`]
//! runs `plcrt` as a process, [`programs`] builds the workspace's programs,
//! [`promises`] checks what the compiler promises for any input, and [`tools`] finds the tools of other makes. The tests are in `tests/tests/`;
//! `tests/README.md` says what each folder there holds.
//!
//! ```
//! use std::path::Path;
//! use plcc_abi::Dialect;
//! use plcc_frontend::common::Options;
//! use plcc_tests::compile::{EngineKind, compile};
//!
//! let lathe = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/pmi/lathe.pmi");
//! let compiled = compile(&lathe, Dialect::Pmi, &Options::default()).unwrap();
//! for way in EngineKind::ALL {
//!     let (program, _engine) = compiled.engine(way).unwrap();
//!     assert_eq!(program.tasks.len(), 1);
//! }
//! ```
#![allow(clippy::indexing_slicing)]

pub mod arithmetic;
pub mod compile;
pub mod drive;
pub mod gen_motion;
pub mod gen_motion_sequences;
pub mod gen_nct;
pub mod gen_pmac;
pub mod gen_pmi;
pub mod gen_program;
pub mod idioms;
pub mod loader;
pub mod mutate;
pub mod no_fault;
pub mod programs;
pub mod promises;
pub mod shrink;
pub mod tools;

#[cfg(test)]
mod tests {
    use super::tools::is_required;

    #[test]
    fn required_tools_are_named_in_a_list() {
        assert!(!is_required("gdb", ""));
        assert!(is_required("gdb", "all") && is_required("gdb", "strace, gdb"));
        assert!(!is_required("gdb", "strace mdbook"));
    }

    #[test]
    #[should_panic(expected = "`gbd`, which is none of the tools")]
    fn a_misspelt_tool_is_a_mistake() {
        is_required("gdb", "strace gbd");
    }
}
