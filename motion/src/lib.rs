//! The other side of a PMAC's PLCs, simulated: motors with what they are fastened to, coordinate systems, and the
//! calculation of moves. It knows neither executives nor engines: an executive calls it at the places of its
//! cycle, and motion programs, which any engine runs, call it as host functions.
//!
//! | file | holds |
//! | --- | --- |
//! | `units` | units of time, pieces of polynomials, ramps |
//! | `shape` | jogs, searches and RAPID of single motors |
//! | `linear` | sequences of blended moves |
//! | `motor`, `system` | the state |
//! | `machine` | what every step works with: state, memory, tables, events |
//! | `servo` | the servo cycle |
//! | `plant`, `trigger` | physical positions, switches, searches |
//! | `registers` | what memory shows |
//! | `safety` | limits, following errors, in position |
//! | `commands`, `control`, `queries` | on-line commands |
//! | `axes` | targets of motors, matching |
//! | `calculation`, `flow`, `moves` | statements of motion programs |
//! | `names` | what users can watch and set |
//!
//! All positions are counts, all velocities counts/ms, as doubles; times are integers of 2^-23 ms.

#![allow(
    clippy::indexing_slicing,
    reason = "motors and systems are vectors of a fixed length, whose indices are counted, or checked where they come in"
)]

mod axes;
mod calculation;
mod commands;
mod control;
mod events;
mod flow;
mod linear;
mod machine;
mod motor;
mod moves;
mod names;
mod plant;
mod queries;
mod registers;
mod safety;
mod servo;
mod shape;
mod system;
#[cfg(test)]
mod tests;
mod trigger;
mod units;

pub use calculation::Next;
pub use events::{Error, MotionEvent, Reason, State as ProgramState};
pub use machine::{Machine, Setup, State};
pub use names::read;
