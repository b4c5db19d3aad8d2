//! What a supervisor does with the image file of a control that has died: it writes the outputs' safe
//! values.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::ops::Range;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use crate::layout::{self, SAFE_OUTPUT_SIZE, State};
use crate::reader::{image_place, wrong};
use crate::sequence::{begin_write, end_write, read_word, write_word};
use crate::{Access, SharedMemory};

/// An image file, mapped so that its outputs can be made safe at once: [`drive`](Self::drive) makes no
/// system call.
#[derive(Debug)]
pub struct OutputDriver {
    memory: SharedMemory,
    image_words: Range<usize>,
    image_size: usize,
    /// By which a file is known: its device and its number there.
    identity: (u64, u64),
}

impl OutputDriver {
    /// Maps an image file.
    ///
    /// # Errors
    /// When the file can't be opened or is no image file.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file: File = OpenOptions::new().read(true).write(true).open(path)?;
        let about = file.metadata()?;
        let memory = SharedMemory::map(&file, Access::Write)?;
        let (image_words, image_size) = image_place(memory.words())?;
        Ok(Self { memory, image_words, image_size, identity: (about.dev(), about.ino()) })
    }

    /// Whether this is the file at `path`. An online change puts another one there.
    pub fn is_at(&self, path: &Path) -> bool {
        fs::metadata(path).is_ok_and(|about| (about.dev(), about.ino()) == self.identity)
    }

    /// Whether the process of this number made the file and has not ended its work in order.
    pub fn is_in_use_by(&self, process: u32) -> bool {
        let words = self.memory.words();
        let number = |at: usize| words.get(at / 8).map(|word| read_word(word).to_le());
        let ended = [State::Ended, State::Replaced].map(|state| Some(state.number()));
        number(layout::AT_PROCESS) == Some(u64::from(process))
            && !ended.contains(&number(layout::AT_STATE))
    }

    /// Writes the safe outputs, and the state [`State::Dead`], into the file of a process that has died.
    /// It may have died while it wrote, so that the rest of the image belongs to two ticks.
    ///
    /// # Errors
    /// When the file is too short.
    pub fn drive(&self) -> io::Result<()> {
        let words = self.memory.words();
        let number = |at: usize| words.get(at / 8).map_or(0, read_word).to_le();
        let counter = words.get(layout::AT_SEQUENCE / 8).ok_or_else(|| wrong("it is too short"))?;
        let table = usize::try_from(number(layout::AT_SAFE_OUTPUTS)).unwrap_or(usize::MAX);
        let count = usize::try_from(number(layout::AT_SAFE_OUTPUTS_COUNT)).unwrap_or(0);
        let first = table / SAFE_OUTPUT_SIZE;
        let even = begin_write(counter, read_word(counter));
        for entry in words.iter().skip(first).take(count) {
            let [a, b, c, d, mask, value, ..] = read_word(entry).to_ne_bytes();
            let offset = u32::from_le_bytes([a, b, c, d]) as usize;
            if offset >= self.image_size {
                continue;
            }
            if let Some(word) = words.get(self.image_words.start + offset / 8) {
                let mut bytes = read_word(word).to_ne_bytes();
                if let Some(byte) = bytes.get_mut(offset % 8) {
                    *byte = *byte & !mask | value & mask;
                }
                write_word(word, u64::from_ne_bytes(bytes));
            }
        }
        if let Some(word) = words.get(layout::AT_STATE / 8) {
            write_word(word, State::Dead.number().to_le());
        }
        end_write(counter, even);
        Ok(())
    }
}
