//! Tests of NCT programs: their errors, and that all engines agree.
#![allow(clippy::indexing_slicing)]

mod errors;
mod generated;
mod idioms;
