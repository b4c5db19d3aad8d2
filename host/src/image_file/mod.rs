//! The image file (`--image`): the process image of a running control in a file that other processes
//! map into their memory, such as drivers of outputs, displays and recorders, and by which they give it
//! inputs.
//!
//! [`Publisher`] is the control's side: after each tick the scan's thread copies words into mapped memory,
//! and before each tick it takes inputs, both without a system call, a lock or an allocation. The layout
//! of the file and the other side are the crate `plcc-image`. `docs/image.md` explains the file byte by
//! byte, for programs in other languages.
//!
//! | file | holds |
//! | --- | --- |
//! | `content.rs` | the bytes of a new file |
//! | `pages.rs` | which parts of a large image are copied after each tick |
//! | `publisher.rs` | writes the file and takes inputs |
//! | `symbols.rs` | the table of symbols of a program |

mod content;
mod pages;
mod publisher;
mod symbols;

#[cfg(test)]
mod tests;

pub use content::Content;
pub use plcc_image::{ImageReader, Number, Place, SafeOutputWriter, Snapshot, State, layout};
pub use publisher::{ImageFileError, Publisher};
pub use symbols::SymbolTable;
