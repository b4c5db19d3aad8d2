//! The codes of each language, a table in a file of its own.

pub mod nct;
pub mod pmac;
pub mod pmi;
pub mod sim;
