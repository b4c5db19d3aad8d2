//! The core of a control: it runs programs as the original control did.
//!
//! The crate knows programs as tables and engines only: no source language, no IR and no code
//! generation, so that `plcrt`, which runs artifacts, holds no compiler. Neither does it know files, sockets, options
//! or threads, but for the watchdog's. Its main types:
//!
//! - [`Executive`]: what a control does around its program: scans, time slices or servo cycles,
//!   latching of inputs, timers, events, retained memory. One for each language, in [`pmi`], [`nct`]
//!   and [`pmac`].
//! - [`Names`]: the names of a program's variables and what is known of each, one table for everybody.
//! - [`NativeEngine`]: runs machine code, of an artifact or of the JIT, as an
//!   [`Engine`](plcc_abi::Engine).
//! - [`watchdog::Watchdog`], [`safe_outputs::SafeLines`]: stop a scan that takes too long, and say what
//!   the outputs become at a stop.
//! - [`checkpoint`]: the whole state of a control, as bytes.
//! - [`online_change`]: what becomes of that state when another version of the program takes over.
//!
//! ```no_run
//! use plcc_runtime::pmi::{PmiExecutive, PmiOptions};
//! use plcc_runtime::{Executive, NativeEngine, Purpose};
//!
//! # fn run(program: &plcc_abi::Program, code: &plcc_abi::Code) -> Result<(), Box<dyn std::error::Error>> {
//! // Program and code are those of an artifact, or have just been compiled.
//! let mut engine = NativeEngine::new(code, program)?;
//! let mut executive = PmiExecutive::new(program, PmiOptions::default())?;
//! let lamp = executive.names().find("LS27", Purpose::Watch)?;
//! let mut events = vec![];
//! for tick in 0..100 {
//!     executive.tick(&mut engine, &mut events).map_err(|stop| stop.message)?;
//!     println!("tick {tick}: LS27 is {}", executive.read(lamp));
//! }
//! # Ok(())
//! # }
//! ```

mod aliased_names;
mod announced;
pub mod checkpoint;
mod clock_decisions;
mod control;
pub mod cpu;
mod display_field;
pub mod event;
pub mod executive;
mod force_list;
mod frame_search;
mod gdb;
pub mod given_names;
mod image_memory;
mod loaded_code;
mod mapped_code;
mod motion_report;
pub mod names;
pub mod native;
mod native_error;
pub mod nct;
pub mod online_change;
pub mod panic_barrier;
pub mod perf;
pub mod pmac;
pub mod pmi;
mod retained;
pub mod safe_outputs;
pub mod simulated;
pub mod small_thread;
pub mod stimulus;
mod stop;
pub mod table_check;
pub mod value;
pub mod variable;
pub mod watchdog;

pub use announced::Announced;
pub use checkpoint::CheckpointError;
pub use clock_decisions::{ClockDecision, Trip};
pub use control::{announced, announces, compare, names_of, validate};
pub use event::{AnnouncedText, DisplayedText, Event, EventBody, SimulatorEvent};
pub use executive::{DeferredAssignment, Executive, TaskStatus};
pub use given_names::GivenNames;
pub use names::{Class, Names, Press, Properties};
pub use native::NativeEngine;
pub use panic_barrier::PanicBarrier;
pub use plcc_simulator::{
    Equipment, MachineAxis, MachineDevice, MachineKey, MachineKind, MachinePath, MachineProgram,
    Reading,
};
pub use retained::Restored;
pub use simulated::{Feedback, SimulatedExecutive};
pub use small_thread::small_thread;
pub use stop::{Place, Stop};
pub use value::Value;
pub use variable::{MAX_FORCES, NameError, Purpose, Setting, ValueError, VariableKey};
