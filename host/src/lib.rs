//! What surrounds a running control: everything that `plcc run` and `plcrt` do from their options to the exit status.
//!
//! - [`session`]: all of it in its order, the same for both programs; [`args`] are its options, and
//!   [`configuration`] reads them from a file.
//! - [`run::Run`]: plays a stimulus to an executive and writes trace and events.
//! - [`journal::Journal`]: tells what happens around a program, in the log and on standard error.
//! - [`retain::RetainedFile`]: the data that survives power-off, in a file.
//! - [`image_file`], [`socket`]: other processes see the process image, act on the control, and replace its program.
//! - `supervisor`: the process that watches a control in real time.
//!
//! ```no_run
//! use plcc_control::{ControlArgs, executive};
//! use plcc_load::Artifact;
//! use plcc_runtime::{NativeEngine, Purpose};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let artifact = Artifact::open("lathe.plcx".as_ref(), None)?;
//! let mut engine = NativeEngine::new(&artifact.code, &artifact.program)?;
//! let mut control = executive(&artifact.program, &ControlArgs::default(), false, None)?;
//! let lamp = control.names().find("LS27", Purpose::Watch)?;
//! control.tick(&mut engine, &mut vec![]).map_err(|stop| stop.message)?;
//! println!("LS27 is {}", control.read(lamp));
//! # Ok(())
//! # }
//! ```

pub mod args;
pub mod configuration;
mod exit_status;
pub mod image_file;
pub mod journal;
mod output_file;
mod patient_writer;
mod peer;
mod progress;
mod realtime_priority;
mod replacement;
pub mod retain;
pub mod run;
pub mod session;
mod signal_listener;
pub mod simulation;
pub mod socket;
#[cfg(target_os = "linux")]
pub mod supervisor;

pub use peer::Peer;
