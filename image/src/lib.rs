//! The image file of a running control (`plcrt run --image FILE`), for both of its sides: the control,
//! which writes its process image and takes inputs, and other processes, which read whole ticks and
//! give inputs. `docs/image.md` explains the file byte by byte, for programs in other languages;
//! `image/include/plcc_image.h` has the same for C.
//!
//! A driver reads outputs with an [`ImageReader`] and gives inputs with an [`InputWriter`]:
//!
//! ```no_run
//! use plcc_image::{ImageReader, InputWriter, Number};
//!
//! let image = ImageReader::open("/dev/shm/lathe".as_ref())?;
//! let mut inputs = InputWriter::open("/dev/shm/lathe".as_ref(), "my driver")?;
//! let ready = inputs.claim("READY")?;
//! let symbols = image.symbols();
//! let pump = symbols.iter().find(|symbol| symbol.name == "PUMP");
//! while let Some(tick) = image.read() {
//!     let on = pump.and_then(|pump| tick.line(pump));
//!     inputs.set(ready, Number::Int(1))?;
//!     inputs.publish()?;
//! #   let _ = on;
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | file | holds |
//! | --- | --- |
//! | `layout.rs` | the offsets in the file |
//! | `clock.rs` | the clock of its times |
//! | `sequence.rs` | the sequence counter, by which readers see whole ticks |
//! | `triple_buffer.rs` | the three buffers by which the control takes a writer's inputs as a whole |
//! | `symbol.rs` | the table of symbols: names, types and places |
//! | `reader.rs` | reads the image |
//! | `input_area.rs` | where the parts of the area for inputs lie |
//! | `writer.rs` | gives inputs |
//! | `latch.rs` | takes inputs, in the control |
//! | `process.rs` | which process gives inputs, and whether it still runs |
//! | `safe_output_writer.rs` | writes the safe outputs of a control that has died |
//! | `shared_memory.rs` | the mapped file as atomic words |

mod clock;
mod hal_pin_name;
pub mod input_area;
pub mod latch;
pub mod layout;
mod process;
mod reader;
mod safe_output_writer;
pub mod sequence;
mod shared_memory;
pub mod symbol;
pub mod triple_buffer;
mod writer;

#[cfg(test)]
mod model;
#[cfg(test)]
mod tests;

/// The atomics that `sequence.rs` and `triple_buffer.rs` use. `model.rs` compiles these two files once more with
/// those of loom.
mod atomics {
    pub(crate) use std::sync::atomic::{AtomicU64, Ordering, fence};
}

pub use clock::monotonic_ns;
pub use hal_pin_name::hal_pin_name;
pub use layout::State;
pub use reader::{ImageReader, Snapshot};
pub use safe_output_writer::SafeOutputWriter;
pub use shared_memory::{Access, SharedMemory};
pub use symbol::{Direction, Number, Place, Symbol, Type};
pub use writer::{ClaimError, Input, InputWriter};
