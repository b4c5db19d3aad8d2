//! Programs for benchmarks, and what the benchmarks have in common. Each program is generated from a
//! seed, in a control's language and in C that does the same, so that the two can be compared:
//! [`equations`] for PMI, [`conditions`] for NCT, [`pmac`] for PMAC. [`compiled`] compiles source text
//! to engines. [`hostile_inputs`] are sources that are made to cost the compiler as much as possible. The benchmarks are in `benches/benches/`.
//!
//! ```
//! use plcc_benches::equations::Equations;
//!
//! let program = Equations::new(2000, 1);
//! assert!(program.pmi().contains("$INPUT"));
//! assert!(program.c_program().contains("int main"));
//! ```
#![allow(clippy::indexing_slicing)]

pub mod compiled;
pub mod conditions;
pub mod equations;
pub mod hostile_inputs;
pub mod pmac;

/// The least of several times. Whatever else the machine does only adds to a time, so the least one
/// comes nearest to what the program needs.
pub fn least(times: Vec<f64>) -> f64 {
    times.into_iter().fold(f64::NAN, f64::min)
}

/// The seed of the inputs' patterns, which are the same in each language and in C.
pub const INPUT_SEED: u64 = 1;

/// Rows of bytes as the initialiser of a two-dimensional array in C, without the outer braces.
pub fn c_rows<const N: usize>(rows: &[[u8; N]]) -> String {
    let row = |row: &[u8; N]| format!("{{{}}}", row.map(|byte| byte.to_string()).join(","));
    rows.iter().map(row).collect::<Vec<_>>().join(",\n")
}
