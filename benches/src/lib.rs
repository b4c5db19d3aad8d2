//! Programs to measure with, and what measuring them has in common.

pub mod compiled;
pub mod conditions;
pub mod equations;
pub mod pmac;
pub mod random;

/// The least of several timings. Whatever else the machine does only adds to a time, so this one
/// comes nearest to the program's own.
pub fn least(times: Vec<f64>) -> f64 {
    times.into_iter().fold(f64::NAN, f64::min)
}
