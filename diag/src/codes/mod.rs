//! One table of codes a language.

pub mod nct;
pub mod pmac;
pub mod pmi;
