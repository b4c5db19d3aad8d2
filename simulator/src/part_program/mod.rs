//! Part programs: what a simulated control executes (cnc-side 1.17 to 1.21).
//!
//! [`grammar`] reads a line as words, and [`read`] makes blocks of them, with what is wrong. What is modal is not resolved here, since
//! a block that is skipped changes nothing.

mod arcs;
mod block;
mod complete;
mod grammar;
mod read;
mod words;

pub(crate) use block::{AuxMove, Block, Cycle, Feed, Motion};
pub use read::{MAX_PART_PROGRAM, read_part_program};
pub(crate) use read::{PartProgram, read_entry};
