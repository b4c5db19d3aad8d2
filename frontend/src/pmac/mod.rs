//! The PMAC language.

pub mod tables;
