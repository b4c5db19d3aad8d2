//! The file of a record. [`RecordFile`] takes frames from the recorder (a tick, a checkpoint, a gap, the end),
//! makes blocks of them, writes these, and begins another part when the present one is full or somebody has
//! removed it.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::block::{self, Kind};
use super::run_header::{RecordedProgram, RunHeader};
use super::{Keep, recording::older_part};
use plcc_files::{LockError, has_name, open_locked};

/// A block of ticks is written when it has so many bytes.
const FULL_BLOCK: usize = 1 << 18;

/// The programs of a run: the first one, and those of online changes.
pub(super) type Programs = Arc<Mutex<Vec<RecordedProgram>>>;

/// The kinds of frames: what the recorder hands over to be written, one thing at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FrameKind {
    /// One tick.
    Tick,
    /// A checkpoint; its first two bytes are the number of the program.
    Checkpoint,
    /// The number of ticks that were lost.
    Gap,
    /// The end of the run.
    End,
}

/// Whether a record is appended to what is in the file already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Appending {
    /// It is appended, since the file may show how the run before ended.
    Yes,
    /// The file is emptied.
    No,
}

/// A record that is being written.
#[derive(Debug)]
pub struct RecordFile {
    path: PathBuf,
    keep: Keep,
    file: File,
    /// How long the present part is, in bytes.
    size: u64,
    /// Whether the start block of the present part is still to be written, since the attempt to write it failed.
    needs_start: bool,
    /// The tick of the first checkpoint of this run in the present part.
    first: Option<u64>,
    header: RunHeader,
    programs: Programs,
    /// The number of the program that was written last into the present part.
    written_program: Option<u16>,
    /// Ticks that are not written yet, and the number of the first one.
    pending: Vec<u8>,
    pending_tick: u64,
    /// A buffer for the bytes of one block.
    block_bytes: Vec<u8>,
    /// Set to ask the recorder for a checkpoint.
    wants_checkpoint: Arc<AtomicBool>,
}

impl RecordFile {
    /// Opens the record of a run: locks the file, empties it and removes its older part unless `appending` says
    /// otherwise, and writes `header`. A link is followed. `program` is the one with which the run begins; `keep`
    /// says how much of the record stays.
    ///
    /// # Errors
    /// When the file can't be opened or written, or another process writes to it.
    pub fn create(
        path: &Path,
        keep: Keep,
        appending: Appending,
        header: RunHeader,
        program: RecordedProgram,
    ) -> io::Result<Self> {
        // What a link points to is the record: parts are renamed, which a link does not follow.
        let path = &fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let mut file = open(path)?;
        if appending == Appending::No {
            file.set_len(0)?;
            match fs::remove_file(older_part(path)) {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        let size = file.seek(SeekFrom::End(0))?;
        let mut record = Self {
            path: path.clone(),
            keep,
            file,
            size,
            needs_start: true,
            first: None,
            header,
            programs: Arc::new(Mutex::new(vec![program])),
            written_program: None,
            pending: Vec::with_capacity(FULL_BLOCK),
            pending_tick: 0,
            block_bytes: vec![],
            wants_checkpoint: Arc::default(),
        };
        record.begin_part(0)?;
        Ok(record)
    }

    /// The path of the newest part.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The flag that asks the recorder for a checkpoint before the next tick. This file sets it when a new part
    /// is to begin.
    pub fn wants_checkpoint(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.wants_checkpoint)
    }

    /// The list to which the programs of online changes are added.
    pub(super) fn programs(&self) -> Programs {
        Arc::clone(&self.programs)
    }

    /// Asks the recorder for a checkpoint.
    pub(super) fn ask_for_checkpoint(&self) {
        self.wants_checkpoint.store(true, Ordering::Relaxed);
    }

    /// Takes a frame, the bytes of `parts` one after the other. `tick` is the number of the tick that is run next,
    /// and of a frame of a tick that tick's own number, or of the first that was skipped before it.
    ///
    /// # Errors
    /// When the file can't be written.
    pub(super) fn take(&mut self, kind: FrameKind, tick: u64, parts: &[&[u8]]) -> io::Result<()> {
        match kind {
            FrameKind::Tick => {
                if self.pending.is_empty() {
                    self.pending_tick = tick;
                }
                parts.iter().for_each(|part| self.pending.extend_from_slice(part));
                if self.pending.len() >= FULL_BLOCK { self.flush() } else { Ok(()) }
            }
            FrameKind::Checkpoint => {
                self.flush()?;
                if self.is_full(tick) || !has_name(&self.file, &self.path) {
                    self.rotate(tick)?;
                } else if self.needs_start || self.first.is_some() {
                    // What the run is stands before each checkpoint, so that damage at the beginning of the file costs
                    // no more than damage elsewhere.
                    self.begin_part(tick)?;
                }
                let content = parts.concat();
                let program = content.first_chunk::<2>().copied().map(u16::from_le_bytes);
                self.write_program(program.unwrap_or(0), tick)?;
                self.first.get_or_insert(tick);
                self.write(Kind::Checkpoint, tick, &content)
            }
            FrameKind::Gap => {
                self.flush()?;
                self.write(Kind::Gap, tick, &parts.concat())
            }
            FrameKind::End => {
                self.flush()?;
                self.write(Kind::End, tick, &parts.concat())?;
                self.file.sync_data()
            }
        }
    }

    /// Writes the ticks that were taken and not written yet.
    ///
    /// # Errors
    /// When the file can't be written. These ticks are lost then.
    pub(super) fn flush(&mut self) -> io::Result<()> {
        if self.pending.is_empty() {
            return Ok(());
        }
        let pending = std::mem::take(&mut self.pending);
        let written = self.write(Kind::Ticks, self.pending_tick, &pending);
        self.pending = pending;
        self.pending.clear();
        written?;
        if self.is_full(self.pending_tick) || !has_name(&self.file, &self.path) {
            self.ask_for_checkpoint();
        }
        Ok(())
    }

    /// Whether the next part is to begin.
    fn is_full(&self, tick: u64) -> bool {
        match self.keep {
            Keep::Size(bytes) => self.size >= bytes / 2,
            Keep::Time(time) => {
                let ticks = tick.saturating_sub(self.first.unwrap_or(tick));
                Duration::from_nanos(ticks.saturating_mul(self.header.tick_ns)) >= time
            }
        }
    }

    /// Renames the present part to the older one and begins a new part. If the path names another file or none
    /// (somebody has removed or renamed the present part, or an earlier attempt has renamed it and then
    /// failed), nothing is renamed.
    fn rotate(&mut self, tick: u64) -> io::Result<()> {
        if has_name(&self.file, &self.path) {
            fs::rename(&self.path, older_part(&self.path))?;
        }
        self.file = open(&self.path)?;
        // If somebody else has put a file there, its content stays and the record is appended.
        self.size = self.file.seek(SeekFrom::End(0))?;
        (self.first, self.written_program) = (None, None);
        self.begin_part(tick)
    }

    /// Writes the start block, with which each part begins, and which says what run it is.
    fn begin_part(&mut self, tick: u64) -> io::Result<()> {
        self.needs_start = true;
        let header = encoded(&self.header)?;
        self.write(Kind::Start, tick, &header)?;
        self.needs_start = false;
        Ok(())
    }

    /// Writes the program of a number, unless it was the last one that was written into this part.
    fn write_program(&mut self, number: u16, tick: u64) -> io::Result<()> {
        if self.written_program == Some(number) {
            return Ok(());
        }
        let content = {
            let programs = self.programs.lock().unwrap_or_else(PoisonError::into_inner);
            let program = programs.get(usize::from(number));
            encoded(&(number, program.unwrap_or(&RecordedProgram::Unknown)))?
        };
        self.write(Kind::Program, tick, &content)?;
        self.written_program = Some(number);
        Ok(())
    }

    fn write(&mut self, kind: Kind, tick: u64, content: &[u8]) -> io::Result<()> {
        self.block_bytes.clear();
        block::write(kind, tick, content, &mut self.block_bytes);
        self.size += self.block_bytes.len() as u64;
        self.file.write_all(&self.block_bytes)
    }
}

/// Opens a file and locks it, so that no other process records into it.
fn open(path: &Path) -> io::Result<File> {
    open_locked(path).map_err(|error| match error {
        LockError::Held(_) => {
            io::Error::new(ErrorKind::ResourceBusy, "another process writes to it")
        }
        LockError::Io(error) => error,
    })
}

/// A value by postcard.
fn encoded(value: &impl serde::Serialize) -> io::Result<Vec<u8>> {
    postcard::to_allocvec(value).map_err(|error| io::Error::new(ErrorKind::InvalidData, error))
}
