//! The executive of PMI: the scan with its latched inputs, timers, flip-flops, faults and
//! messages, and what survives power-off (PMI 3.1; rulings, Scan).

mod announce;
mod lines;
mod load;
mod macros;
mod names;
mod scan;

#[cfg(test)]
mod tests;

pub use load::PmiLoadError;
pub use scan::{PmiExecutive, PmiOptions};
