//! Loads compiled programs and runs them, as the original control did.
//!
//! The crate knows programs as tables and engines only: no source language, no IR and no code
//! generation, so that `plcrt`, which runs artifacts, holds no compiler. Its main types:
//!
//! - [`Artifact`]: a program that `plcc build` has compiled, read from a file and checked.
//! - [`NativeEngine`]: runs machine code, of an artifact or of the JIT, as an
//!   [`Engine`](plcc_abi::Engine).
//! - [`Executive`]: what a control does around its program: scans, time slices or servo cycles,
//!   latching of inputs, timers, events, retained memory. One for each language, in [`pmi`], [`nct`]
//!   and [`pmac`].
//! - [`run::Run`]: plays a stimulus to an executive and writes trace and events.
//! - [`watchdog::Watchdog`], [`safe_outputs::SafeLines`]: stop a scan that takes too long, and say what
//!   the outputs become at a stop.
//! - [`retain::RetainedFile`], [`checkpoint`]: the data that survives power-off, in a file; the whole
//!   state of a control, as bytes.
//! - [`journal::Journal`]: tells what happens around a program, in the log and on standard error.
//! - `image_file`, `socket`, [`swap`], behind the feature `args`: other processes see the process image,
//!   act on the control, and replace its program.
//! - `supervisor`, behind the feature `args`: the process that watches a control in real time.
//! - `session`, behind the feature `args`: all of that from the options of a command line to its
//!   exit status, the same for `plcc run` and `plcrt`.
//!
//! ```no_run
//! use plcc_runtime::pmi::{PmiExecutive, PmiOptions};
//! use plcc_runtime::{Artifact, Executive, NativeEngine, Purpose};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let artifact = Artifact::open("lathe.plcx".as_ref(), None)?;
//! let mut engine = NativeEngine::new(&artifact.code, &artifact.program)?;
//! let mut executive = PmiExecutive::new(&artifact.program, PmiOptions::default())?;
//! let lamp = executive.find("LS27", Purpose::Watch)?;
//! let mut events = vec![];
//! for tick in 0..100 {
//!     executive.tick(&mut engine, &mut events).map_err(|stop| stop.message)?;
//!     println!("tick {tick}: LS27 is {}", executive.get(lamp));
//! }
//! # Ok(())
//! # }
//! ```

#[cfg(feature = "args")]
pub mod args;
pub mod artifact;
pub mod checkpoint;
mod clock_decisions;
#[cfg(feature = "args")]
pub mod configuration;
mod control;
#[cfg(feature = "args")]
pub mod control_args;
pub mod cpu;
mod display_field;
pub mod event;
pub mod executive;
mod force_list;
mod frame_search;
#[cfg(feature = "args")]
mod gdb;
#[cfg(feature = "args")]
pub mod image_file;
pub mod journal;
mod loaded_code;
mod mapped_code;
pub mod native;
mod native_error;
pub mod nct;
pub mod online_change;
pub mod panic_barrier;
mod patient_writer;
mod peer;
pub mod perf;
pub mod pmac;
pub mod pmi;
mod progress;
pub mod record;
pub mod retain;
mod retained;
pub mod run;
pub mod safe_outputs;
#[cfg(feature = "args")]
pub mod session;
#[cfg(feature = "args")]
mod signal_listener;
mod small_thread;
#[cfg(feature = "args")]
pub mod socket;
mod stop;
#[cfg(all(feature = "args", target_os = "linux"))]
pub mod supervisor;
pub mod swap;
mod table_check;
pub mod value;
mod variable;
pub mod watchdog;

pub use artifact::{Artifact, ArtifactError};
pub use checkpoint::CheckpointError;
pub use clock_decisions::{ClockDecision, Trip};
pub use control::compare;
pub use event::{AnnouncedText, DisplayedText, Event, EventBody};
pub use executive::{Executive, TaskStatus};
pub use native::NativeEngine;
pub use panic_barrier::PanicBarrier;
pub use peer::Peer;
pub use retained::Restored;
pub use stop::{Place, Stop};
pub use value::Value;
pub use variable::{MAX_FORCES, NameError, Purpose, Setting, ValueError, Variable, VariableKey};
