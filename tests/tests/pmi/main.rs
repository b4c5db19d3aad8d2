//! Tests of PMI programs: errors, documented examples, and all engines held against each other.
#![allow(clippy::indexing_slicing)]

mod engines;
mod errors;
mod generated;
mod harness;
mod lathe;
mod pins;
