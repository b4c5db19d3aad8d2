//! Loads programs and runs them.
//!
//! Sees programs as tables and engines only: no language, no IR, no code generation. An
//! [`Executive`] does for one dialect what its control did around the
//! program: scans, slices, ticks, latching, timers, events. [`run`] plays a stimulus to it and
//! writes what comes of it; `session`, behind the feature `args`, is that from the options of a
//! command line to its exit status, the same for `plcc run` and `plcrt`.

#[cfg(feature = "args")]
pub mod args;
pub mod artifact;
mod control;
pub mod cpu;
pub mod event;
pub mod executive;
pub mod files;
pub mod native;
pub mod nct;
pub mod panic_barrier;
pub mod perf;
pub mod pmac;
pub mod pmi;
pub mod retain;
pub mod run;
#[cfg(feature = "args")]
pub mod session;
pub mod value;

pub use artifact::{Artifact, ArtifactError};
pub use event::{Event, EventBody, Shown};
pub use executive::{Executive, NameError, Purpose, Setting, Stop, ValueError, Variable};
pub use native::NativeEngine;
pub use panic_barrier::PanicBarrier;
pub use value::Value;
