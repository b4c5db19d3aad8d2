//! The file of a record: puts what the recorder gives into blocks, writes them, and begins another part
//! when the file has become long enough.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::block::{self, Kind};
use super::run_header::{RecordedProgram, RunHeader};
use super::{Keep, recording::older_part};
use crate::file_lock::{LockError, has_name, open_locked};

/// So many bytes of ticks make a block.
const FULL_BLOCK: usize = 1 << 18;

/// The programs of a run: the first one, and those of online changes.
pub(super) type Programs = Arc<Mutex<Vec<RecordedProgram>>>;

/// What the recorder gives to be written.
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

/// Whether a record goes on behind what is in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Appending {
    /// It does, since the file may hold how the last run ended.
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
    /// Whether a part has been begun whose beginning could not be written whole.
    begins: bool,
    /// The first tick of this run in the present part.
    first: Option<u64>,
    header: RunHeader,
    programs: Programs,
    /// The program that was written last into the present part.
    program: Option<u16>,
    /// Ticks that are not written yet, and the number of the first one.
    pending: Vec<u8>,
    pending_tick: u64,
    blocks: Vec<u8>,
    wants_checkpoint: Arc<AtomicBool>,
}

impl RecordFile {
    /// Opens a record for a run of a program.
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
            begins: true,
            first: None,
            header,
            programs: Arc::new(Mutex::new(vec![program])),
            program: None,
            pending: Vec::with_capacity(FULL_BLOCK),
            pending_tick: 0,
            blocks: vec![],
            wants_checkpoint: Arc::default(),
        };
        record.begin_part(0)?;
        Ok(record)
    }

    /// The path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The flag by which this file, or anybody else, asks the recorder for a checkpoint before the next
    /// tick.
    pub fn wants_checkpoint(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.wants_checkpoint)
    }

    /// Where programs of online changes are put.
    pub(super) fn programs(&self) -> Programs {
        Arc::clone(&self.programs)
    }

    /// Asks the recorder for a checkpoint.
    pub(super) fn ask_for_checkpoint(&self) {
        self.wants_checkpoint.store(true, Ordering::Relaxed);
    }

    /// Takes what the recorder gives. `tick` is the number of the next tick before it.
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
                } else if self.begins {
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

    /// Writes the ticks that wait.
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

    /// Has a new file take the place of the present one, which becomes the older part. Where somebody has
    /// removed or renamed the present one, or an earlier attempt came no further than that, the new one is
    /// begun all the same.
    fn rotate(&mut self, tick: u64) -> io::Result<()> {
        if has_name(&self.file, &self.path) {
            fs::rename(&self.path, older_part(&self.path))?;
        }
        self.file = open(&self.path)?;
        // What somebody else has put there stays.
        self.size = self.file.seek(SeekFrom::End(0))?;
        (self.first, self.program) = (None, None);
        self.begin_part(tick)
    }

    /// Writes what a part begins with.
    fn begin_part(&mut self, tick: u64) -> io::Result<()> {
        self.begins = true;
        let header = encoded(&self.header)?;
        self.write(Kind::Start, tick, &header)?;
        self.begins = false;
        Ok(())
    }

    /// Writes the program of a number, unless it was the last one that was written into this part.
    fn write_program(&mut self, number: u16, tick: u64) -> io::Result<()> {
        if self.program == Some(number) {
            return Ok(());
        }
        let content = {
            let programs = self.programs.lock().unwrap_or_else(PoisonError::into_inner);
            let program = programs.get(usize::from(number));
            encoded(&(number, program.unwrap_or(&RecordedProgram::Unknown)))?
        };
        self.write(Kind::Program, tick, &content)?;
        self.program = Some(number);
        Ok(())
    }

    fn write(&mut self, kind: Kind, tick: u64, content: &[u8]) -> io::Result<()> {
        self.blocks.clear();
        block::write(kind, tick, content, &mut self.blocks);
        self.size += self.blocks.len() as u64;
        self.file.write_all(&self.blocks)
    }
}

/// Opens a file for this process alone.
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
