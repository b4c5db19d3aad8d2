//! What the compiler, the engines and the executive of PMAC share: the [tables] of a program, the
//! [layout] of memory in the image, how [memory] is accessed by definitions that are known only at
//! run time, the [values of expressions](expression), the [formats](fixed) of its words, the [names](name) of variables, the language's
//! [arithmetic], and what compiled code [assumes](assumption).

pub mod arithmetic;
pub mod assumption;
mod controller;
pub mod definition;
pub mod expression;
pub mod fixed;
pub mod layout;
pub mod memory;
pub mod motion;
pub mod name;
pub mod pure_functions;
pub mod range;
pub mod sparse_memory;
mod symbols;
pub mod tables;

pub use assumption::{Assumption, Definitions, DirectAccess};
pub use controller::Controller;
pub use definition::{Definition, Field, Format};
pub use layout::{COMMAND_CONTEXT, Layout, MOTION_CONTEXT, Place, Run, Space, WORD_SIZE, context};
pub use memory::{Memory, View};
pub use name::{PmacName, PmacNameError};
pub use range::Range;
pub use sparse_memory::SparseMemory;
pub use symbols::field_place;
pub use tables::{
    CommandStep, Define, Kind, Output, PlcOp, PmacTables, Program, Statement, Text, Variable,
};

impl crate::DialectTables for PmacTables {
    type Variable = PmacName;

    fn symbols(&self) -> alloc::vec::Vec<crate::ImageSymbol> {
        symbols::symbols(self)
    }

    fn bit_fields(&self) -> alloc::vec::Vec<crate::BitField> {
        symbols::bit_fields(self)
    }
}
