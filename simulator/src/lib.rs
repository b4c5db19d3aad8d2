//! The other side of a control, for the desk (`--simulate`): a CNC for PMI and NCT programs, and small machines such as
//! contactors, cylinders and turrets for programs of every language.
//!
//! The crate knows neither executives nor languages. Whoever runs a program offers it the program's variables
//! ([`Access`]): find a name, read, write. In every tick, after the stimulus and before everything else, it does a
//! [step](Simulator::step). Time is counted in ticks and arithmetic is done in integers, so that every run is the same.
//!
//! - [`Setup`] is what a run is made from: the table `[simulator]` of the machine file with its defaults, and the part
//!   program, which [`read_part_program`] reads with diagnostics.
//! - [`Simulator`] is one run's: what never changes in it, and its [`State`], which is all that it remembers.
//!
//! A part program is read with all its mistakes, each at its place:
//!
//! ```
//! use plcc_abi::machine::simulator::SimulatorTable;
//! use plcc_abi::{Program, Tables, pmi::PmiTables};
//! use plcc_diag::SourceMap;
//! use plcc_simulator::{Rules, read_part_program};
//!
//! let tables = Tables::Pmi(PmiTables::default());
//! let program =
//!     Program { files: vec![], image_size: 0, regions: vec![], tasks: vec![], tables, names: vec![] };
//! let rules = Rules::new(&SimulatorTable::default(), &program);
//! let mut sources = SourceMap::new();
//! let file = sources.add("shaft.nc", b"N10 G90 G0 X1\nN20 G1 X1.5\nN30 M30\n");
//!
//! let (_, diagnostics) = read_part_program(&rules, &sources, file);
//! let [no_feed] = diagnostics.as_slice() else { panic!("one mistake") };
//! assert_eq!(no_feed.code, "SIM-8");
//! assert_eq!(sources.line_col(file, no_feed.span.start), (2, 8));
//! ```
//!
//! [`Equipment`] is what displays show of a machine. In the crate, `pmi` and `nct` are the two controls, `device` the small machines, `part_program` the reader, and `way`
//! the movement of axes.

mod access;
mod arc;
mod context;
mod device;
mod equipment;
mod event;
mod history;
mod keys;
mod length;
mod modal;
mod nct;
mod part_program;
mod pmi;
mod positions;
mod ramp;
mod setup;
mod simulator;
#[cfg(test)]
mod tests;
mod way;

pub use access::{Access, Handle, Use};
pub use equipment::{
    Equipment, MachineAxis, MachineDevice, MachineKey, MachineKind, MachinePath, MachineProgram,
    Reading,
};
pub use event::{Awaited, Refusal, Requested, Told};
pub use keys::Key;
pub use part_program::{MAX_PART_PROGRAM, read_part_program};
pub use setup::{Rules, Setup};
pub use simulator::{Simulator, State, Strictness};
