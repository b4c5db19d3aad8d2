//! Reads image files: whole ticks, the header, and the tables.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::sync::atomic::AtomicU64;

use crate::layout::{self, SYMBOL_SIZE, State};
use crate::sequence::{begin_read, end_read, read_word};
use crate::symbol::{Number, Symbol};
use crate::{Access, SharedMemory};

/// How often a reader tries to copy a tick before it gives up. The control needs some microseconds to write a tick,
/// so a reader that fails so often reads the file of a control that has died while it wrote.
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

impl Snapshot {
    /// The value of a symbol as the program sees it; `None` where the symbol lies outside the image.
    pub fn value(&self, symbol: &Symbol) -> Option<Number> {
        symbol.value.read(&self.image)
    }

    /// The value on the physical lines of an input or an output. `None` where the symbol has no lines of
    /// its own: its value is what counts then.
    pub fn line(&self, symbol: &Symbol) -> Option<Number> {
        symbol.line.and_then(|line| line.read(&self.image))
    }

    /// What a driver gives its hardware for an output: what is on its physical lines, or its value where it
    /// has none.
    pub fn output(&self, symbol: &Symbol) -> Option<Number> {
        self.line(symbol).or_else(|| self.value(symbol))
    }
}

/// Opens a file, for writing too if `write` is true. Anything but a regular file is an error; opening a FIFO does
/// not wait for its other end.
pub(crate) fn open_regular(path: &Path, write: bool) -> io::Result<File> {
    let flags = rustix::fs::OFlags::NONBLOCK.bits() as i32;
    let file = OpenOptions::new().read(true).write(write).custom_flags(flags).open(path)?;
    if file.metadata()?.is_file() { Ok(file) } else { Err(wrong("it is not a regular file")) }
}

/// The error for a file that is not what it should be.
pub(crate) fn wrong(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}

/// Where the process image is in the file, as the header says: its range in words and its length in bytes.
///
/// # Errors
/// When the words are not those of an image file.
pub(crate) fn image_place(words: &[AtomicU64]) -> io::Result<(std::ops::Range<usize>, usize)> {
    let word = |at: usize| words.get(at / 8).map_or(0, read_word).to_le();
    if word(layout::AT_MAGIC).to_le_bytes() != layout::MAGIC {
        return Err(wrong("it is not an image file"));
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
    /// When it can't be opened or is not an image file.
    pub fn open(path: &Path) -> io::Result<Self> {
        let memory = SharedMemory::map(&open_regular(path, false)?, Access::Read)?;
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

    /// The number of the program's language: 0 PMI, 1 NCT, 2 PMAC.
    pub fn dialect(&self) -> u64 {
        self.word(layout::AT_DIALECT) & 0xFFFF_FFFF
    }

    /// Gives the outputs in the copy of a tick their safe values, which the file's table says. For a driver whose
    /// control ends no ticks any more.
    pub fn make_safe(&self, tick: &mut Snapshot) {
        let place = |at| usize::try_from(self.word(at)).unwrap_or(0);
        let (from, count) = (place(layout::AT_SAFE_OUTPUTS), place(layout::AT_SAFE_OUTPUTS_COUNT));
        let table = self.bytes(from, count.saturating_mul(layout::SAFE_OUTPUT_SIZE));
        for entry in table.chunks_exact(layout::SAFE_OUTPUT_SIZE) {
            let &[a, b, c, d, mask, value, ..] = entry else { continue };
            let offset = u32::from_le_bytes([a, b, c, d]) as usize;
            if let Some(byte) = tick.image.get_mut(offset) {
                *byte = *byte & !mask | value & mask;
            }
        }
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

    /// The length of a tick in nanoseconds, as it was when the file was made.
    pub fn tick_ns(&self) -> u64 {
        self.word(layout::AT_TICK_NS)
    }

    /// The table of variables, a JSON object a line.
    pub fn variables(&self) -> Vec<u8> {
        let place = |at| usize::try_from(self.word(at)).unwrap_or(usize::MAX);
        self.bytes(place(layout::AT_VARIABLES), place(layout::AT_VARIABLES_SIZE))
    }

    /// The table of symbols. Entries that are not valid are left out.
    pub fn symbols(&self) -> Vec<Symbol> {
        let place = |at| usize::try_from(self.word(at)).unwrap_or(0);
        let (from, count) = (place(layout::AT_SYMBOLS), place(layout::AT_SYMBOLS_COUNT));
        if from == 0 {
            return vec![];
        }
        let entries = self.bytes(from, count.saturating_mul(SYMBOL_SIZE));
        let text = |at: u32, length: u32| self.bytes(at as usize, length as usize);
        entries.chunks_exact(SYMBOL_SIZE).filter_map(|entry| Symbol::decode(entry, text)).collect()
    }

    /// Bytes of the file; none where it is shorter.
    fn bytes(&self, from: usize, size: usize) -> Vec<u8> {
        let words = self.memory.words();
        let end = from.saturating_add(size).div_ceil(8);
        let words = words.get(from / 8..end).unwrap_or_default();
        let bytes = words.iter().flat_map(|word| read_word(word).to_ne_bytes());
        bytes.skip(from % 8).take(size).collect()
    }

    /// Whether [`read`](Self::read) would give another tick, or another state of the control, than this one.
    pub fn is_newer_than(&self, tick: &Snapshot) -> bool {
        let header = [layout::AT_TICKS, layout::AT_TIME].map(|at| self.word(at));
        header != [tick.ticks, tick.time] || self.state() != tick.state
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
