//! End-to-end tests.
#![allow(clippy::indexing_slicing)]

pub mod arithmetic;
pub mod compile;
pub mod drive;
pub mod gen_ir;
pub mod gen_nct;
pub mod gen_pmac;
pub mod gen_pmi;
pub mod mutate;
pub mod no_fault;
pub mod oracle;
pub mod shrink;
