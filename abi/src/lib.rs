//! What the compiler and the executives that run its programs agree on.
//!
//! Everything that both sides must know is here, and nothing else: the
//! [process image](image), the [calls](context) into compiled code, the [functions](host) that
//! program code may call in return, [how a scan ends](outcome), and the [tables](program) that an
//! executive works by. What belongs to one language only is in [`pmi`], [`nct`] and [`pmac`]. The
//! crate depends on no other of the project and needs no standard library.
//!
//! An engine runs a task's scan on the process image, and says how it ended. This one adds 1 to
//! the 32-bit integer at the beginning of the image:
//!
//! ```
//! use plcc_abi::engine::NoHost;
//! use plcc_abi::image::{read_i32, write_i32};
//! use plcc_abi::{Engine, Outcome, ResumePoint, Scan};
//!
//! struct Counter;
//!
//! impl Engine for Counter {
//!     fn call(&mut self, _: usize, _: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
//!         let count = read_i32(scan.image, 0);
//!         write_i32(scan.image, 0, count + 1);
//!         Outcome::End
//!     }
//! }
//!
//! let mut image = [0; 8];
//! let mut host = NoHost;
//! let mut scan = Scan::new(&mut image, &mut host);
//! assert_eq!(Counter.call(0, None, &mut scan), Outcome::End);
//! assert_eq!(read_i32(&image, 0), 1);
//! ```
#![no_std]

extern crate alloc;

pub mod code;
pub mod context;
pub mod deadline;
pub mod engine;
mod fingerprint;
pub mod function_marker;
pub mod given_name;
pub mod host;
pub mod image;
#[cfg(feature = "machine")]
pub mod machine;
mod natural_order;
pub mod nct;
mod number;
mod operator_panel;
pub mod outcome;
pub mod place;
pub mod pmac;
pub mod pmi;
mod printable;
pub mod program;
pub mod resume;
#[cfg(feature = "suggest")]
mod suggest;
mod symbols;
pub mod time;
pub mod unwind;

pub use code::{Code, CodeError, CodeLine, CodeMemory, CodeParts, FunctionRange};
pub use context::{RawOutcome, ScanContext};
pub use deadline::TimeLimit;
pub use engine::{Engine, Host, ResumePoint, Scan};
pub use fingerprint::Fnv;
pub use given_name::GivenName;
pub use host::{DoubleRange, HostFn, HostType, IntegerForm};
pub use natural_order::natural_cmp;
pub use number::number;
pub use operator_panel::{OperatorCell, OperatorPanel};
pub use outcome::{OutOfBoundsAccess, Outcome, SourceLine, Trap, TrapCode, TrapSite};
pub use printable::printable;
pub use program::{
    Dialect, DialectTables, DialectVariable, Program, Region, SimulatorVariable, Tables, Task,
};
pub use resume::ResumeLabels;
#[cfg(feature = "suggest")]
pub use suggest::closest;
pub use symbols::{BitField, ImageSymbol, ImageType};

/// The version of everything in this crate. An artifact of another version is refused, so it is
/// raised with every change after which an older artifact would be misread: of the tables, the
/// context, outcomes, or the numbers of host functions and trap codes.
pub const ABI_VERSION: u32 = 8;
