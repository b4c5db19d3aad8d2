//! Programs that `plcc export` has written, compiled by a compiler of another make: matiec's `iec2c` and a C compiler. They run
//! beside the control, with the same random inputs, and have the same variables after each scan.
//!
//! The environment variable `PLCC_MATIEC` names matiec's folder, with `iec2c` and `lib/` in it; `scripts/full iec` builds one.
//! Without it these tests say that they are skipped.
#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used, clippy::indexing_slicing)]

mod matiec;
mod nct;
mod pmac;
mod pmi;
mod run;
