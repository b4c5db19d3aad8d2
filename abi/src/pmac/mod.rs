//! What PMAC's executive knows of a program, and what all engines share: [where](layout) memory
//! stands in the image, how [general access](memory) to it goes, its [formats](fixed) and its
//! [arithmetic](math), and what compiled code [relies](reliance) on.

pub mod definition;
pub mod far;
pub mod fixed;
pub mod layout;
pub mod math;
pub mod memory;
pub mod pure;
pub mod range;
pub mod reliance;
mod symbols;
pub mod tables;

pub use definition::{Definition, Field, Format};
pub use far::Far;
pub use layout::{COMMAND_CONTEXT, Layout, Place, Run, Space, context};
pub use memory::{Memory, View};
pub use range::Range;
pub use reliance::{Definitions, Direct, Relied};
pub(crate) use symbols::symbols;
pub use tables::{Define, Kind, PlcOp, PmacTables, Program, Text, Variable};
