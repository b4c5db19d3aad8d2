//! End-to-end tests.

pub mod gen_pmac;
pub mod gen_pmi;
pub mod rng;
pub mod shrink;
