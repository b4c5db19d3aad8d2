//! The writing side of an image file.

use std::collections::HashMap;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use thiserror::Error;

use plcc_image::latch::{InputEvent, InputLatch};
use plcc_image::layout::{self, HEADER_SIZE, State};
use plcc_image::sequence::{begin_write, end_write, write_word};
use plcc_image::{Access, Number, SharedMemory, monotonic_ns};

use super::content::Content;
use super::pages::{PAGE, Pages};
use crate::journal::{EntryKind, ScanJournal};
use plcc_files::{open_regular, why_not_written};
use plcc_runtime::{Executive, Setting, VariableKey};

/// Why an image file can't be made.
#[derive(Debug, Error)]
pub enum ImageFileError {
    /// A file of that name is something else, which is not overwritten.
    #[error("{0} is not written as the image file, since it is something else")]
    Other(PathBuf),
    /// Another process writes it.
    #[error("the image file {0} is in use by process {1}")]
    InUse(PathBuf, u64),
    /// It can't be written or mapped.
    #[error("the image file {0} can't be written: {why}", why = why_not_written(.1))]
    Io(PathBuf, io::Error),
}

/// Writes an image file. Making it and dropping it are for other threads than the scan's.
#[derive(Debug)]
pub struct Publisher {
    memory: SharedMemory,
    pages: Pages,
    inputs: InputLatch,
    /// For each slot of the area for inputs its variable and its name.
    slots: Vec<(VariableKey, Arc<str>)>,
    /// The slot of each variable that can be given.
    slot_of: HashMap<VariableKey, u32>,
    /// What the sequence counter holds.
    sequence: u64,
    /// The open file, whose lock tells other processes that it is in use.
    file: File,
}

/// Whether a new file may take the place of the one at a path.
///
/// # Errors
/// When there is something else, or another process writes it.
fn check_replaceable(path: &Path) -> Result<(), ImageFileError> {
    let failed = |error| ImageFileError::Io(path.to_owned(), error);
    let about = match fs::metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        about => about.map_err(failed)?,
    };
    if !about.is_file() {
        return Err(ImageFileError::Other(path.to_owned()));
    }
    let mut file = open_regular(path).map_err(failed)?;
    let mut head = Vec::new();
    Read::take(&mut file, HEADER_SIZE as u64).read_to_end(&mut head).map_err(failed)?;
    if !head.is_empty() && !head.starts_with(&layout::MAGIC) {
        return Err(ImageFileError::Other(path.to_owned()));
    }
    match file.try_lock() {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => {
            let process = head.get(layout::AT_PROCESS..).and_then(|tail| tail.first_chunk());
            let process = process.map_or(0, |bytes| u64::from_le_bytes(*bytes));
            Err(ImageFileError::InUse(path.to_owned(), process))
        }
        Err(TryLockError::Error(error)) => Err(failed(error)),
    }
}

/// Where a file is made that is to get the name `path`.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(format!(".{}.tmp", std::process::id()));
    name.into()
}

impl Publisher {
    /// Makes the image file of a control. An image file of a process that has ended is replaced; a
    /// process that still has it open keeps what it held.
    ///
    /// # Errors
    /// When a file of that name is something else or in use, or can't be written.
    pub fn create(path: &Path, content: &Content<'_>) -> Result<Self, ImageFileError> {
        check_replaceable(path)?;
        let publisher = Self::prepare(path, content)?;
        Self::put_in_place(path)?;
        Ok(publisher)
    }

    /// Makes a file beside `path`, for a program that is about to take the place of another one:
    /// [`put_in_place`](Self::put_in_place) makes it the file that readers find.
    ///
    /// # Errors
    /// When it can't be written.
    pub fn prepare(path: &Path, content: &Content<'_>) -> Result<Self, ImageFileError> {
        let beside = beside(path);
        Self::make(&beside, content).map_err(|error| {
            Self::discard(path);
            ImageFileError::Io(path.to_owned(), error)
        })
    }

    /// Renames the file that [`prepare`](Self::prepare) has made for `path` to that name.
    ///
    /// # Errors
    /// When the system refuses it; the file is then removed.
    pub fn put_in_place(path: &Path) -> Result<(), ImageFileError> {
        fs::rename(beside(path), path).map_err(|error| {
            Self::discard(path);
            ImageFileError::Io(path.to_owned(), error)
        })
    }

    /// Removes the file that [`prepare`](Self::prepare) has made for `path`.
    pub fn discard(path: &Path) {
        // A temporary file that can't be removed does no harm.
        let _ = fs::remove_file(beside(path));
    }

    fn make(path: &Path, content: &Content<'_>) -> io::Result<Self> {
        match fs::remove_file(path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let mut options = OpenOptions::new();
        let mut file = options.read(true).write(true).create_new(true).mode(0o644).open(path)?;
        let (bytes, area) = content.encode();
        // Blocks that the file system could not provide later would end the process by SIGBUS.
        let allocated = rustix::fs::fallocate(
            &file,
            rustix::fs::FallocateFlags::empty(),
            0,
            bytes.len().next_multiple_of(PAGE) as u64,
        );
        match allocated {
            Ok(()) | Err(rustix::io::Errno::OPNOTSUPP) => {}
            Err(error) => return Err(error.into()),
        }
        file.write_all(&bytes)?;
        file.lock()?;
        Ok(Self {
            memory: SharedMemory::map(&file, Access::Write)?,
            pages: Pages::new(content.image, content.used),
            inputs: content.latch(area),
            slots: content.symbols.slots.clone(),
            slot_of: content.symbols.slots.iter().map(|&(key, _)| key).zip(0..).collect(),
            sequence: 0,
            file,
        })
    }

    /// Whether the file lies in memory (tmpfs), where writing to it never waits for a disk.
    pub fn is_in_memory(&self) -> bool {
        const TMPFS: i64 = 0x0102_1994;
        rustix::fs::fstatfs(&self.file).is_ok_and(|about| about.f_type == TMPFS)
    }

    /// Writes what the control has reached: the process image after `ticks` ticks, and how many
    /// forces are in effect. `time` is now, in nanoseconds of `CLOCK_MONOTONIC`. An image of another
    /// length than the file was made for is not written.
    pub fn publish(&mut self, image: &[u8], ticks: u64, time: u64, state: State, forces: u64) {
        let words = self.memory.words();
        let (Some(counter), Some(shared)) =
            (words.get(layout::AT_SEQUENCE / 8), words.get(HEADER_SIZE / 8..))
        else {
            return;
        };
        if image.len() != self.pages.image_size() {
            return;
        }
        self.sequence = begin_write(counter, self.sequence);
        let header = [
            (layout::AT_TICKS, ticks),
            (layout::AT_TIME, time),
            (layout::AT_STATE, state.number()),
            (layout::AT_FORCES, forces),
        ];
        for (at, value) in header {
            if let Some(word) = words.get(at / 8) {
                write_word(word, value.to_le());
            }
        }
        self.pages.write_changes(image, shared);
        end_write(counter, self.sequence);
    }

    /// Takes the inputs that other processes give, as wholes, and calls `apply` with the slot and the value of
    /// each variable that is to be set, and `report` for what has happened to inputs. `now` is the time
    /// in nanoseconds of `CLOCK_MONOTONIC`; `again` has inputs set that have not changed, too.
    pub fn take_inputs(
        &mut self,
        now: u64,
        again: bool,
        apply: impl FnMut(u32, Number),
        report: impl FnMut(InputEvent),
    ) {
        self.inputs.take(self.memory.words(), now, again, apply, report);
    }

    /// Takes the inputs that other processes give before the tick with this number, sets them in the
    /// executive, and tells the journal what has happened to them.
    pub(crate) fn latch(
        &mut self,
        executive: &mut dyn Executive,
        tick: u64,
        again: bool,
        journal: &mut ScanJournal,
    ) {
        let slots = &self.slots;
        let apply = |slot: u32, value: Number| {
            if let Some(&(key, _)) = slots.get(slot as usize) {
                let setting = match value {
                    Number::Int(number) => Setting::Int(number),
                    Number::Float(number) => Setting::Float(number),
                };
                executive.write(key, setting);
            }
        };
        let report = |InputEvent { change, writer, first, count }: InputEvent| {
            if let Some((_, name)) = slots.get(first as usize) {
                let (change, first) = (change.name(), Arc::clone(name));
                journal.write(tick, EntryKind::Inputs { change, writer, first, count });
            }
        };
        self.inputs.take(self.memory.words(), monotonic_ns(), again, apply, report);
    }

    /// Whether another process gives the input, or it has its safe value since that process is late or gone, so that
    /// nothing would come of setting it.
    pub(crate) fn holds(&self, key: VariableKey) -> bool {
        self.slot_of.get(&key).is_some_and(|&slot| self.inputs.holds(slot))
    }

    /// Writes that nothing will be written any more, and why. The image stays as it was last.
    pub fn end(&mut self, state: State) {
        let words = self.memory.words();
        if let (Some(counter), Some(word)) =
            (words.get(layout::AT_SEQUENCE / 8), words.get(layout::AT_STATE / 8))
        {
            self.sequence = begin_write(counter, self.sequence);
            write_word(word, state.number().to_le());
            end_write(counter, self.sequence);
        }
    }
}
