//! Logic: an and-inverter graph, numbers as lists of its literals, and a process image of them.

mod bits;
mod float;
mod graph;
mod memory;
mod table;

pub use graph::{FALSE, Graph, Lit, Node, TRUE};
pub use memory::Memory;
pub(crate) use table::Tables;
