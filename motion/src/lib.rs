//! The other side of a PMAC's PLCs, simulated: motors with what they are fastened to, coordinate systems, and the
//! calculation of moves. It knows neither executives nor engines: an executive calls it at the places of its
//! cycle, and motion programs, which any engine runs, call it as host functions.
//!
//! | file | holds |
//! | --- | --- |
//! | `units` | units of time, pieces of polynomials, ramps |
//! | `shape` | jogs, searches and RAPID of single motors |
//! | `sequence` | sequences of moves without a stop between them |
//! | `linear`, `pieces`, `segments` | how those of LINEAR, of PVT and SPLINE, and with segments go on |
//! | `circle` | arcs |
//! | `motor`, `system` | the state |
//! | `machine` | what every step works with: state, memory, tables, events |
//! | `servo` | the servo cycle |
//! | `plant`, `trigger` | physical positions, switches, searches |
//! | `time_base` | time bases |
//! | `words`, `registers`, `status` | what memory shows |
//! | `rest` | what is the same in each servo cycle |
//! | `variables` | I-variables of motors |
//! | `safety` | limits, following errors, in position |
//! | `commands`, `control`, `queries` | on-line commands |
//! | `axes` | targets of motors, matching |
//! | `arguments` | words of a line with a call |
//! | `transform` | transformations of axes |
//! | `halt` | `/` and `\\` |
//! | `kinematics` | kinematic programs |
//! | `panel` | the control panel |
//! | `calculation`, `flow`, `modes`, `moves` | statements of motion programs |
//! | `names` | what users can watch and set |
//!
//! A motor that jogs, without any program:
//!
//! ```
//! use plcc_abi::image::write_f64;
//! use plcc_abi::pmac::motion::{Jog, JogGoal, MotionAction, MotionCommand, MotionName, MotionTables, MotorValue};
//! use plcc_abi::pmac::{Controller, Layout, Memory, SparseMemory, View};
//! use plcc_motion::{Machine, Setup, State, read};
//!
//! let layout = Layout::new(Controller::Pmac);
//! let action = MotionAction::Jog(Jog { goal: JogGoal::To(200.0), trigger: None });
//! let tables = MotionTables {
//!     commands: vec![MotionCommand { text: "J=200".into(), action }],
//!     ..MotionTables::default()
//! };
//! let setup = Setup::new(&layout, &[], &tables, &[]);
//! let mut state = State::new(&setup, &tables);
//! let (mut image, mut sparse) = (vec![0; layout.size as usize], SparseMemory::default());
//! // Motor 1 is activated and jogs at 10 counts/ms; the time base is that of the servo cycle.
//! for (number, value) in [(100, 1.0), (120, 10.0), (122, 10.0), (10, 4_194_304.0)] {
//!     write_f64(&mut image, layout.i_offset(number), value);
//! }
//! let mut events = vec![];
//! let memory = Memory { image: &mut image, layout: &layout, sparse: &mut sparse };
//! let mut machine =
//!     Machine { state: &mut state, setup: &setup, tables: &tables, memory, events: &mut events };
//! machine.memory.write_word(plcc_abi::pmac::Space::X, 0x806, 4_194_304);
//! machine.start();
//! machine.command(0, &mut 1, &mut 1);
//! for _ in 0..100 {
//!     machine.servo();
//!     machine.finish_servo();
//!     machine.housekeeping();
//! }
//! let view = View { image: &image, layout: &layout, sparse: &sparse };
//! let name = MotionName::Motor(1, MotorValue::Commanded);
//! assert_eq!(read(&state, &setup, &tables, view, name), 200.0);
//! assert!(events.is_empty());
//! ```
//!
//! All positions are counts, all velocities counts/ms, as doubles; times are integers of 2^-23 ms.

#![allow(
    clippy::indexing_slicing,
    reason = "motors and systems are vectors of a fixed length, whose indices are counted, or checked where they come in"
)]

mod arguments;
mod axes;
mod calculation;
mod carried_out;
mod circle;
mod commands;
mod control;
mod events;
mod flow;
mod halt;
mod kinematics;
mod linear;
mod machine;
mod modes;
mod motor;
mod moves;
mod names;
mod panel;
mod pieces;
mod plant;
mod queries;
mod registers;
mod rest;
mod safety;
mod segments;
mod sequence;
mod servo;
mod shape;
mod status;
mod system;
#[cfg(test)]
mod tests;
mod time_base;
mod transform;
mod trigger;
mod units;
mod variables;
mod words;

pub use calculation::Next;
pub use carried_out::Assigned;
pub use events::{Error, MotionEvent, Reason, State as ProgramState};
pub use machine::{Machine, Setup, State};
pub use names::read;
