//! PMI, NCT and PMAC: source text to IR.
//!
//! One folder a language, each with the same façade: `check` turns sources into a checked program
//! and its diagnostics, the checked program lowers itself to IR and hands out its statement
//! interpreter. [`common`] holds what the languages share.
//!
//! Architecture Invariant: nothing here does IO. Files are asked of a [`common::FileLoader`].

pub mod common;
pub mod detect;
pub mod language;
pub mod nct;
pub mod pmac;
pub mod pmi;

pub use language::{CheckedProgram, LANGUAGES, Language, Recompilable, Topic, language};
