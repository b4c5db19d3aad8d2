//! The executive of NCT: the 20 ms slice with its modules (NCT 1.2, 1.3), the registers and
//! timers, the messages, and the statements that reach beyond the program.

mod arithmetic;
mod host;
mod image;
mod memory;
mod messages;
mod operand;
mod search;
mod slice;
mod variables;

#[cfg(test)]
mod tests;

pub use slice::{NctExecutive, NctLoadError, NctOptions};
