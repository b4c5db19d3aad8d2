//! Tests of what holds for all three languages: conformance, whole runs, checkpoints, the loader,
//! damaged input.
#![allow(clippy::indexing_slicing)]

mod arm64;
mod bound;
mod checkpoint;
mod conformance;
mod cut_ticks;
mod documented_objects;
mod engine_change;
mod fuzz_replay;
mod ir_rules;
mod lints;
mod loader;
mod no_fault;
mod replay;
mod safe_outputs;
mod session;
mod stops;
mod watchdog;
