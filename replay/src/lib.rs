//! Runs the ticks of a PLC program again and shows each statement of them: a debugger that steps forwards and backwards,
//! through one scan and through all scans of a run.
//!
//! All engines agree to the byte, so every tick of a run can be run again, from a checkpoint before
//! it, in the statement interpreter. The debugger does this for the tick that is looked at, and
//! records a [trace](trace::TickTrace) of its statements. Stepping is then moving in that trace, in
//! either direction. The main types:
//!
//! - [`DebuggedProgram`]: a program with its sources, the places of its statements and the names of
//!   its variables.
//! - [`History`]: the ticks of a run. [`Launched`] is a run in simulated time that the debugger makes
//!   itself, [`Recorded`] one that was recorded (a record, which this crate and its clients also call a recording).
//! - [`Debugger`]: where the user stands, breakpoints, and all ways to move.
//!
//! ```
//! use plcc_replay::{DebugError, Debugger, Direction, Session};
//!
//! # fn example(session: Session<'_>) -> Result<(), DebugError> {
//! let mut debugger = Debugger::new(session);
//! debugger.set_line_breakpoints(0, &[plcc_replay::LineBreakpoint::at(12)]);
//! while debugger.run(Direction::Forward, 1000)?.is_none() {}
//! println!("tick {}", debugger.position().tick);
//! debugger.go_to_last_writer("LS27")?;
//! # Ok(())
//! # }
//! ```

pub mod breakpoints;
pub mod control;
mod debugger;
pub mod history;
mod hits;
mod interruption;
pub mod observers;
pub mod program;
pub mod recorded;
pub mod trace;
pub mod variables;

use thiserror::Error;

pub use breakpoints::{Breakpoints, DataBreakpoint, LineBreakpoint};
pub use control::{ControlSocket, forced_by, not_as_given};
pub use debugger::{
    Debugger, Direction, OpenVersion, Position, Session, StepKind, StopAt, Stopped,
};
pub use history::{Act, ActKind, History, Launched, Version};
pub use interruption::Interruption;
pub use program::DebuggedProgram;
pub use recorded::Recorded;

/// Why something that the user asked for can't be done; the text is for people.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct DebugError(pub String);

impl DebugError {
    /// An error with this text.
    pub fn new(text: impl Into<String>) -> Self {
        Self(text.into())
    }
}
