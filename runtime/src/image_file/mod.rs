//! The image file (`--image`): the process image of a running control in a file that other processes
//! map into their memory, such as drivers of outputs, displays and recorders.
//!
//! [`Publisher`] writes it, after each tick, in the scan's thread: it copies words into mapped memory,
//! without a system call, a lock or an allocation. [`ImageReader`] reads it in another process and
//! gives whole ticks. [`OutputDriver`] is for the supervisor of a control that has died.
//! `docs/image.md` explains the file byte by byte, for programs in other languages.
//!
//! | file | holds |
//! | --- | --- |
//! | `layout.rs` | the offsets in the file |
//! | `sequence.rs` | the sequence counter, by which readers see whole ticks |
//! | `pages.rs` | which parts of a large image are copied after each tick |
//! | `content.rs` | the bytes of a new file |
//! | `publisher.rs`, `reader.rs` | the two sides |
//! | `output_driver.rs` | safe outputs when the writer has died |
//! | `shared_memory.rs` | the mapped file as atomic words |

mod content;
pub mod layout;
mod output_driver;
mod pages;
mod publisher;
mod reader;
mod sequence;
mod shared_memory;

#[cfg(test)]
mod model;
#[cfg(test)]
mod tests;

/// The atomics that `sequence.rs` works on; its model check has others.
mod atomics {
    pub(crate) use std::sync::atomic::{AtomicU64, Ordering, fence};
}

pub use content::Content;
pub use layout::State;
pub use output_driver::OutputDriver;
pub use publisher::{ImageFileError, Publisher};
pub use reader::{ImageReader, Snapshot};
