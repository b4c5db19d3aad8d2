//! What the compiler and the executive of PMI share: the [tables], the sizes and counts of the
//! [layout], the [names](name) of variables, and the language's [arithmetic].

pub mod arithmetic;
pub mod layout;
pub mod name;
mod symbols;
pub mod tables;

pub use layout::PORTS;
pub use name::{PmiName, PmiNameError, PmiVariable};
pub use tables::{
    Announcement, DeclaredCode, FlipFlop, Format, Lines, PmiTables, Role, Special, Symbol,
    TextItem, Timer, TimerKind, Type,
};

impl crate::DialectTables for PmiTables {
    type Variable = PmiVariable;

    fn symbols(&self) -> alloc::vec::Vec<crate::ImageSymbol> {
        symbols::symbols(self)
    }
}
