//! What a PMI program and its executive agree on: the [tables] that the compiler fills and the
//! executive works by, and how variables stand in the image; and the language's [arithmetic].

pub mod arithmetic;
pub mod layout;
pub mod name;
mod symbols;
pub mod tables;

pub use layout::PORTS;
pub use name::{PmiName, PmiNameError};
pub(crate) use symbols::symbols;
pub use tables::{
    Announcement, FlipFlop, Format, Lines, PmiTables, Role, Special, Symbol, TextItem, Timer,
    TimerKind, Type,
};
