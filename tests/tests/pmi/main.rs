//! Tests of PMI programs: their errors, the examples of the manual, and that all engines agree.
#![allow(clippy::indexing_slicing)]

mod engines;
mod errors;
mod generated;
mod harness;
mod idioms;
mod lathe;
mod pins;
