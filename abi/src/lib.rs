//! What compiled programs and their host agree on.
//!
//! Everything that both a compiler and a runtime must know stands here, and nothing else: the
//! [process image](image), the [calls](context) into compiled code, the [few ways out](host) of
//! it, [how a scan ends](outcome), and the [tables](program) that an executive works by. The
//! crate depends on no other of the project and needs no standard library.
#![no_std]

extern crate alloc;

pub mod code;
pub mod context;
pub mod engine;
pub mod host;
pub mod image;
#[cfg(feature = "machine")]
pub mod machine;
mod natural_order;
pub mod nct;
pub mod outcome;
pub mod pmac;
pub mod pmi;
pub mod program;
pub mod resume;
#[cfg(feature = "suggest")]
mod suggest;
mod symbols;
pub mod unwind;

pub use code::{Code, CodeError, CodeLine, CodeMemory, CodeParts, FunctionRange};
pub use context::{RawOutcome, ScanContext};
pub use engine::{Engine, Host, ResumePoint, Scan};
pub use host::{HostFn, HostType};
pub use natural_order::natural_cmp;
pub use outcome::{Outcome, TrapCode};
pub use program::{Dialect, Program, Region, Tables, Task};
pub use resume::ResumeLabels;
#[cfg(feature = "suggest")]
pub use suggest::closest;
pub use symbols::{ImageSymbol, ImageType};

/// The version of everything in this crate. An artifact of another version is refused.
pub const ABI_VERSION: u32 = 2;
