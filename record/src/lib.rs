//! The flight recorder: everything that a control can't compute again, written to a file while it runs,
//! so that every tick can be run again later, in any engine, with every intermediate value.
//!
//! A tick follows from the state before it, from what acts on the control from outside, and from what
//! the clock decides. So a record holds a checkpoint now and then, and for each tick the writes, forces and skipped
//! ticks before it, its [clock decisions](plcc_runtime::ClockDecision), its events, and a hash of the state after it,
//! by which a replay is checked.
//!
//! - [`Recorder`] belongs to the thread that runs the ticks. In real time it puts what it records into a queue
//!   of fixed size; it neither waits, nor allocates memory, nor calls the operating system. A thread of
//!   its own ([`RecordThread`]) writes. In simulated time the recorder writes by itself.
//! - [`ReplaceableExecutive`] is the executive of whichever program runs now; it has the recorder told of everything
//!   that acts on it.
//! - [`Recording`] reads a record. The record may still grow, its end may be cut off, and parts of it may be
//!   damaged.
//! - [`Replayer`] brings an executive into the state before any recorded tick, and runs it on from there
//!   tick by tick in whichever engine it is given.
//!
//! ```no_run
//! use plcc_record::{Recording, Replayer};
//! # fn f(executive: Box<dyn plcc_runtime::Executive + Send>, mut engine: Box<dyn plcc_abi::Engine>)
//! # -> Result<(), Box<dyn std::error::Error>> {
//! let recording = Recording::open("lathe.plcrec".as_ref())?;
//! let run = recording.last_run().ok_or("nothing is recorded")?;
//! // The executive is made of the recorded program with the recorded options; see `session::replay`.
//! let mut replayer = Replayer::new(&recording, run, 0, executive);
//! replayer.go_to(1200, engine.as_mut())?;
//! let mut events = vec![];
//! while let Some(tick) = replayer.step(engine.as_mut(), &mut events)? {
//!     println!("tick {}: {}", tick.tick, if tick.matches { "as recorded" } else { "differs" });
//! }
//! # Ok(())
//! # }
//! ```
//!
//! A record is a sequence of blocks (`block.rs`), each with a checksum, most of them compressed. It has one or two
//! parts, each a file. When `FILE` has half the size that is to be kept, or covers the time that is to be kept,
//! it is renamed to `FILE.1` in place of the older part, and a new `FILE` begins.

mod block;
mod entry;
mod file;
mod keep;
mod queue;
mod recorded_event;
mod recorder;
mod recording;
mod replaceable;
mod replay;
mod run_header;
mod state_hash;
#[cfg(test)]
mod tests;
mod thread;

pub use entry::{Action, RecordedStop, TickRecord};
pub use file::{Appending, RecordFile};
pub use keep::Keep;
pub use queue::LargerQueue;
pub use recorder::{Recorder, RecorderProgram};
pub use recording::{Gap, RecordError, RecordedRun, Recording, RunEnd, Span};
pub use replaceable::ReplaceableExecutive;
pub use replay::{
    Difference, ReplayError, ReplayState, Replayed, Replayer, RunTicks, differing_variables,
};
pub use run_header::{RecordedFile, RecordedProgram, RecordedSources, RunHeader};
pub use thread::{RecordReport, RecordThread, RecordedPrograms};

/// How many ticks lie between two checkpoints at most.
const MAX_TICKS: u64 = 1 << 16;
