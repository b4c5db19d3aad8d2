//! Tests that treat the three languages alike: whole runs, the loader, malformed input.
#![allow(clippy::indexing_slicing)]

mod checkpoint;
mod conformance;
mod engine_change;
mod fuzz_replay;
mod loader;
mod no_fault;
mod session;
