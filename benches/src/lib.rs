//! Programs to measure with, and what measuring them has in common.

pub mod compiled;
pub mod conditions;
pub mod equations;
pub mod pmac;
pub mod random;
