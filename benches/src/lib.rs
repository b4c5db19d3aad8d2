//! Programs for benchmarks, and what the benchmarks have in common. [`kernels`] are generated from a
//! seed, in a control's language and in C that does the same, so that the two can be compared;
//! [`pmac`] generates a PMAC program whose definitions a benchmark changes. [`compiled`] compiles
//! source text to engines. [`hostile_inputs`] are sources that are made to cost the compiler as much
//! as possible. [`motion`] has downloads whose motors are simulated. [`lateness`] measures how late ticks begin. The benchmarks are in `benches/benches/`.
//!
//! ```
//! use plcc_benches::kernels::{Language, c, families};
//!
//! let kernel = families::relay_logic(Language::Pmi, 2000, 1);
//! assert!(kernel.source().contains("$INPUT"));
//! assert!(c::program(&kernel).contains("int main"));
//! ```
#![allow(clippy::indexing_slicing)]

pub mod compiled;
pub mod hostile_inputs;
pub mod kernels;
pub mod lateness;
pub mod motion;
pub mod paced;
pub mod pmac;
