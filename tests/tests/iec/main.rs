//! Programs that `plcc export` has written, compiled by compilers of other makes. They run beside the control, with the same random
//! inputs, and have the same variables after each scan.
//!
//! Environment variables name the folders of the compilers: `PLCC_MATIEC` one with matiec's `iec2c` and `lib/`, `PLCC_STRUCPP` one
//! with STruC++'s `dist/` and `src/runtime/`, `PLCC_IRONPLC` one with the programs `ironplcc` and `ironplcvm`. A test says which of them
//! it does without.
#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used, clippy::indexing_slicing)]

mod batch;
mod case;
mod driver;
mod feed;
mod ironplc;
mod matiec;
mod nct;
mod pmac;
mod pmi;
mod source;
mod strucpp;
