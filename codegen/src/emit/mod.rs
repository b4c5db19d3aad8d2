//! What `plcc build --emit` writes of a compiled program: listings to read, objects to link.
//!
//! [`clif()`] (Cranelift's IR) and [`asm()`] (machine code) are text with the source's statements
//! as comments; [`object()`] is a relocatable object for linkers and debuggers; [`debug_object()`] is what
//! debuggers need of code that is loaded in another way; [`layout()`] says where the program's state lies in its image.

mod asm;
#[allow(clippy::indexing_slicing, reason = "a SecondaryMap has a value for every key")]
mod clif;
mod debug_object;
mod dwarf;
mod image_type;
mod layout;
mod object;
mod object_options;
mod scan_context;
mod source;

pub use asm::asm;
pub use clif::clif;
pub use debug_object::debug_object;
pub use layout::layout;
pub use object::object;
pub use object_options::ObjectOptions;
