//! Tests of PMAC programs: arithmetic, corpus, documentation, and all engines held against each other.
#![allow(clippy::indexing_slicing)]

mod arithmetic;
mod corpus;
mod docs;
mod engines;
mod explain;
mod recompile;
