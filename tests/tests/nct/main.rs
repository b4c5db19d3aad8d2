//! Tests of NCT programs: errors, and all engines held against each other.
#![allow(clippy::indexing_slicing)]

mod errors;
mod generated;
