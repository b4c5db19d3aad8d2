//! What `plcc build --emit` writes of a compiled program: listings to read, objects to link.
//!
//! [`clif`] and [`asm`] are text with the source's statements as comments in between; [`object`]
//! is a relocatable object for linkers and debuggers.

mod asm;
#[allow(clippy::indexing_slicing, reason = "a SecondaryMap has a value for every key")]
mod clif;
mod dwarf;
mod layout;
mod object;
mod source;

pub use asm::asm;
pub use clif::clif;
pub use layout::layout;
pub use object::object;
