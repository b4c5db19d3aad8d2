//! The reading side of an image file.

use std::io;
use std::path::Path;
use std::sync::atomic::AtomicU64;

use super::layout::{self, State};
use super::sequence::{begin_read, end_read, read_word};
use super::shared_memory::{Access, SharedMemory};
use crate::files::open_regular;

/// How often a reader tries to copy a tick before it gives up. The writer needs some microseconds
/// for each tick, so a reader that fails so often meets a writer that has died while it wrote.
const TRIES: u32 = 100_000;

/// A whole tick.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Snapshot {
    /// How many ticks were done.
    pub ticks: u64,
    /// When the last one ended, in nanoseconds of `CLOCK_MONOTONIC`.
    pub time: u64,
    /// What the control is doing; `None` for a state of a later version.
    pub state: Option<State>,
    /// How many forces are in effect.
    pub forces: u64,
    /// The process image.
    pub image: Vec<u8>,
}

/// An image file that is read.
#[derive(Debug)]
pub struct ImageReader {
    memory: SharedMemory,
    image_words: std::ops::Range<usize>,
    image_size: usize,
}

pub(super) fn wrong(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}

/// Where the process image is in the file, as the header says: its range in words and its length in bytes.
///
/// # Errors
/// When the words are not those of an image file.
pub(super) fn image_place(words: &[AtomicU64]) -> io::Result<(std::ops::Range<usize>, usize)> {
    let word = |at: usize| words.get(at / 8).map_or(0, read_word).to_le();
    if word(layout::AT_MAGIC).to_le_bytes() != layout::MAGIC {
        return Err(wrong("it is no image file"));
    }
    let version = word(layout::AT_VERSION) as u32;
    if version != layout::VERSION {
        return Err(wrong("it is an image file of another version"));
    }
    // The upper half of this word is the 32 bits at `AT_IMAGE_SIZE`.
    let size = (word(layout::AT_DIALECT) >> 32) as usize;
    let from = usize::try_from(word(layout::AT_IMAGE)).unwrap_or(usize::MAX) / 8;
    let range = from..from.saturating_add(size.div_ceil(8));
    if words.get(range.clone()).is_none() {
        return Err(wrong("it is too short"));
    }
    Ok((range, size))
}

impl ImageReader {
    /// Opens an image file.
    ///
    /// # Errors
    /// When it can't be opened or is no image file.
    pub fn open(path: &Path) -> io::Result<Self> {
        let memory = SharedMemory::map(&open_regular(path)?, Access::Read)?;
        let (image_words, image_size) = image_place(memory.words())?;
        Ok(Self { memory, image_words, image_size })
    }

    fn word(&self, at: usize) -> u64 {
        self.memory.words().get(at / 8).map_or(0, read_word).to_le()
    }

    /// The program's fingerprint.
    pub fn fingerprint(&self) -> u64 {
        self.word(layout::AT_FINGERPRINT)
    }

    /// How often the program has been replaced by an online change.
    pub fn generation(&self) -> u64 {
        self.word(layout::AT_GENERATION)
    }

    /// The number of the process that writes the file.
    pub fn process(&self) -> u64 {
        self.word(layout::AT_PROCESS)
    }

    /// What the control is doing, as far as it says so itself; `None` for a state of a later version.
    pub fn state(&self) -> Option<State> {
        State::from_number(self.word(layout::AT_STATE))
    }

    /// When the last tick ended, in nanoseconds of `CLOCK_MONOTONIC`; 0 before the first one.
    pub fn last_tick(&self) -> u64 {
        self.word(layout::AT_TIME)
    }

    /// The table of variables, a JSON object a line.
    pub fn variables(&self) -> Vec<u8> {
        let place = |at| usize::try_from(self.word(at)).unwrap_or(usize::MAX);
        let (from, size) = (place(layout::AT_VARIABLES), place(layout::AT_VARIABLES_SIZE));
        let words = self.memory.words();
        let range = from / 8..(from / 8).saturating_add(size.div_ceil(8));
        let words = words.get(range).unwrap_or_default();
        let bytes = words.iter().flat_map(|word| read_word(word).to_ne_bytes());
        bytes.take(size).collect()
    }

    /// A whole tick: waits, without sleeping, while the writer writes. `None` when that does not end,
    /// since the writer has died while it wrote.
    pub fn read(&self) -> Option<Snapshot> {
        let words = self.memory.words();
        let counter = words.get(layout::AT_SEQUENCE / 8)?;
        let mut image = Vec::with_capacity(self.image_words.len() * 8);
        for _ in 0..TRIES {
            let Some(number) = begin_read(counter) else {
                std::hint::spin_loop();
                continue;
            };
            image.clear();
            for word in words.get(self.image_words.clone())? {
                image.extend(read_word(word).to_ne_bytes());
            }
            let header = [layout::AT_TICKS, layout::AT_TIME, layout::AT_STATE, layout::AT_FORCES];
            let [ticks, time, state, forces] = header.map(|at| self.word(at));
            if end_read(counter, number) {
                image.truncate(self.image_size);
                let state = State::from_number(state);
                return Some(Snapshot { ticks, time, state, forces, image });
            }
        }
        None
    }
}
