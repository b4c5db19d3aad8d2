//! The codes of each language and of test scripts, a table in a file of its own.

pub mod nct;
pub mod plctest;
pub mod pmac;
pub mod pmi;
pub mod sim;
