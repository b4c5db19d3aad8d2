//! Online change, as a run carries it out.
//!
//! The socket's thread prepares it: it reads the new artifact, makes its engine and executive, and compares the two
//! programs ([`compare`](crate::compare)). The thread that runs the ticks only carries it out (`Replacement`), without
//! allocating or freeing memory.

mod replaceable;
#[cfg(feature = "args")]
mod replacement;

pub use replaceable::ReplaceableExecutive;
#[cfg(feature = "args")]
pub(crate) use replacement::Replacement;
