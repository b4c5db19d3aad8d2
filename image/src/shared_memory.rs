//! Memory that is shared with other processes: a file that is mapped, seen as atomic words.
//!
//! Other processes may read and write the file at any time, so nothing here gives out a reference to
//! plain bytes. The only thing that this can't protect from is a process of the same user that makes
//! the file shorter: an access after its end then raises SIGBUS.
#![allow(unsafe_code)]

use std::fs::File;
use std::io;
use std::sync::atomic::AtomicU64;

use memmap2::{MmapOptions, MmapRaw};

/// Whether a mapping is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// It is only read. Storing a word would end the process.
    Read,
    /// It is read and written.
    Write,
}

/// A whole file in memory.
#[derive(Debug)]
pub struct SharedMemory {
    map: MmapRaw,
}

impl SharedMemory {
    /// Maps a file, with all of its pages present.
    ///
    /// # Errors
    /// When the system refuses it.
    pub fn map(file: &File, access: Access) -> io::Result<Self> {
        let mut options = MmapOptions::new();
        options.populate();
        let map = match access {
            Access::Read => options.map_raw_read_only(file)?,
            Access::Write => options.map_raw(file)?,
        };
        Ok(Self { map })
    }

    /// The file as words, the last bytes left out where its length is not a multiple of eight.
    pub fn words(&self) -> &[AtomicU64] {
        // SAFETY: a mapping begins at a page, which is aligned for words, is as long as `len` says,
        // and stays where it is until `self` is dropped. This process accesses it through this
        // slice only, and every bit pattern is a valid word. A mapping that is only for reading is only
        // loaded from.
        unsafe {
            std::slice::from_raw_parts(self.map.as_ptr().cast::<AtomicU64>(), self.map.len() / 8)
        }
    }
}
