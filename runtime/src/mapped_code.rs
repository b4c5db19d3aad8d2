//! Executable memory for code that was compiled ahead of time.
#![allow(unsafe_code)]

use std::io;

use memmap2::{Mmap, MmapMut};
use plcc_abi::{Code, CodeMemory};
use wasmtime_internal_jit_icache_coherence as icache;

/// A copy of some code in pages of its own, which can be executed and not written.
pub(crate) struct MappedCode(Mmap);

impl MappedCode {
    /// Copies the code and makes the copy executable.
    ///
    /// # Errors
    /// When the operating system gives no such memory.
    pub(crate) fn new(code: &Code) -> io::Result<Self> {
        let mut map = MmapMut::map_anon(code.bytes.len().max(1))?;
        if let Some(room) = map.get_mut(..code.bytes.len()) {
            room.copy_from_slice(&code.bytes);
        }
        // SAFETY: address and length are those of the mapping. Nothing of it is executed yet.
        unsafe { icache::clear_cache(map.as_ptr().cast(), map.len()) }.map_err(io_error)?;
        let map = map.make_exec()?;
        // Reaches all threads of the process, so that the code may be executed by another one.
        icache::pipeline_flush_mt().map_err(io_error)?;
        Ok(Self(map))
    }
}

/// An error of the crate that flushes caches as one of input and output; on some systems it has a
/// type of its own.
fn io_error(error: impl ToString) -> io::Error {
    io::Error::other(error.to_string())
}

// SAFETY: a mapping stays where it is until it is dropped, and this one is private, not writable
// and executable; `new` has made the instruction caches coherent and flushed the pipelines.
unsafe impl CodeMemory for MappedCode {
    fn bytes(&self) -> &[u8] {
        &self.0
    }
}

/// Memory of no length, in the place of memory that is kept until the process ends.
pub(crate) struct NoMemory;

// SAFETY: there is nothing that could move, be written or executed.

unsafe impl CodeMemory for NoMemory {
    fn bytes(&self) -> &[u8] {
        &[]
    }
}
