//! What PMAC's executive knows of a program, and what all engines share: [where](layout) memory
//! stands in the image, how [general access](memory) to it goes, its [formats](fixed) and its
//! [arithmetic], and what compiled code [assumes](assumption).

pub mod arithmetic;
pub mod assumption;
mod controller;
pub mod definition;
pub mod fixed;
pub mod layout;
pub mod memory;
pub mod name;
pub mod pure_functions;
pub mod range;
pub mod sparse_memory;
mod symbols;
pub mod tables;

/// The arithmetic by its former name.
pub use arithmetic as math;
pub use assumption::{Assumption, Definitions, Direct};
pub use controller::Controller;
pub use definition::{Definition, Field, Format};
pub use layout::{COMMAND_CONTEXT, Layout, Place, Run, Space, context};
pub use memory::{Memory, View};
pub use name::{PmacName, PmacNameError};
pub use range::Range;
pub use sparse_memory::SparseMemory;
pub(crate) use symbols::symbols;
pub use tables::{Define, Kind, PlcOp, PmacTables, Program, Text, Variable};
