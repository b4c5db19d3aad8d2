//! Writes the outputs' safe values into the image file of a control that has died. The supervisor does
//! this, so that drivers find the safe values in the file.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::ops::Range;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use crate::layout::{self, SAFE_OUTPUT_SIZE, State};
use crate::reader::{image_place, wrong};
use crate::sequence::{begin_write, end_write, read_word, write_word};
use crate::{Access, SharedMemory};

/// An image file that is mapped while its control runs, so that the safe outputs can be written as soon as the
/// control has died: [`write`](Self::write) makes no system call.
#[derive(Debug)]
pub struct SafeOutputWriter {
    memory: SharedMemory,
    image_words: Range<usize>,
    image_size: usize,
    /// What identifies the file: the number of its device and its inode.
    identity: (u64, u64),
}

impl SafeOutputWriter {
    /// Maps an image file.
    ///
    /// # Errors
    /// When the file can't be opened or is not an image file.
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

    /// Whether the process with this number made the file, and the file does not say that this process has ended
    /// or made another file.
    pub fn is_in_use_by(&self, process: u32) -> bool {
        let words = self.memory.words();
        let number = |at: usize| words.get(at / 8).map(|word| read_word(word).to_le());
        let ended = [State::Ended, State::Replaced].map(|state| Some(state.number()));
        number(layout::AT_PROCESS) == Some(u64::from(process))
            && !ended.contains(&number(layout::AT_STATE))
    }

    /// Writes the safe outputs and the state [`State::Dead`]. The control may have died while it wrote a tick; then
    /// other parts of the process image belong to two ticks.
    ///
    /// # Errors
    /// When the file is too short.
    pub fn write(&self) -> io::Result<()> {
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
