//! Tests of NCT programs: errors, and all engines held against each other.

mod errors;
mod generated;
