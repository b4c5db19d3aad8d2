//! Reads records: [`Recording`] finds runs, checkpoints and ticks, also in a record that is still being written or
//! is damaged.

use std::fs::File;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::MAX_TICKS;
use super::block::{self, Block, Kind};
use super::entry::{Action, RecordedStop, TickRecord, read_ticks, read_trailing};
use super::run_header::{RecordedProgram, RunHeader, VERSION};
use plcc_files::has_name;
use plcc_files::{open_regular, resolve_links, why_not_read};

/// Why a record can't be read.
#[derive(Debug, Error)]
pub enum RecordError {
    /// The file can't be read.
    #[error("{} can't be read: {}", .0.display(), why_not_read(.1))]
    Read(PathBuf, io::Error),
    /// It holds no block of a record.
    #[error("{} is not a record; plcrt run --record and `plcc run --record` write records", .0.display())]
    NoRecord(PathBuf),
    /// It holds blocks of a record, but none that says what run they belong to.
    #[error(
        "what {} says of its runs is damaged, so that nothing of it can be replayed", .0.display()
    )]
    NoRun(PathBuf),
    /// Another version of plcc has written it.
    #[error("the record was written by {age} plcc: it has version {0}, this plcc reads version {VERSION}; \
             use the plcc that wrote it", age = age(.0))]
    Version(u32),
    /// A block has the right checksum but holds what this plcc does not write.
    #[error(
        "the record holds, at tick {0}, what this plcc does not write: it is damaged, or another build \
             of plcc has recorded it; use the plcc that recorded it"
    )]
    Damaged(u64),
}

/// Whether a version is older or newer than this plcc's, for a sentence.
fn age(version: &u32) -> &'static str {
    if *version < VERSION { "an older" } else { "a newer" }
}

/// The path of the older part of a record.
pub(super) fn older_part(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".1");
    name.into()
}

/// One of the files of a record.
#[derive(Debug)]
struct Part {
    path: PathBuf,
    file: File,
    /// The offset after the last block that was read.
    read: u64,
}

/// How often parts are opened because they were renamed meanwhile.
const MAX_TRIES: usize = 3;

/// Opens the parts of a record that are there, the older one first.
fn open_parts(path: &Path) -> io::Result<Vec<Part>> {
    // A link's older part lies beside what it points to.
    let older_path = older_part(&resolve_links(path));
    let mut tries = 1;
    let (older, newest) = loop {
        let newest = open_regular(path);
        let older = open_regular(&older_path).ok();
        match newest {
            // The recorder has begun a new part just now, so that both are the same file.
            Ok(file) if older.is_some() && has_name(&file, &older_path) => {
                if tries == MAX_TRIES {
                    break (None, Some(file));
                }
                tries += 1;
            }
            Ok(file) => break (older, Some(file)),
            // The recorder was killed after it had renamed the newest part, before it could begin another.
            Err(error) if error.kind() == ErrorKind::NotFound && older.is_some() => {
                break (older, None);
            }
            Err(error) => return Err(error),
        }
    };
    let part = |path: &Path, file| Part { path: path.to_owned(), file, read: 0 };
    let older = older.map(|file| part(&older_path, file));
    let newest = newest.map(|file| part(path, file));
    Ok(older.into_iter().chain(newest).collect())
}

/// Where a block is.
#[derive(Clone, Copy, Debug)]
struct Place {
    part: usize,
    block: Block,
}

/// A record that is read.
#[derive(Debug)]
pub struct Recording {
    parts: Vec<Part>,
    runs: Vec<RecordedRun>,
    /// How many bytes of the files belong to no whole block.
    damaged: u64,
    /// Whether blocks were found that belong to no run which is known, since its start block is damaged, and no start
    /// block has followed them yet.
    is_run_unknown: bool,
}

/// A run in a record, from its power-up to its end, or what is kept of that.
#[derive(Debug)]
pub struct RecordedRun {
    /// What the record says of the run.
    pub header: RunHeader,
    /// The programs by their numbers: the first one, and those of online changes. A program whose
    /// ticks are no longer kept is [`RecordedProgram::Unknown`].
    pub programs: Vec<RecordedProgram>,
    /// The spans, each from one checkpoint to the next, in the order of their ticks.
    pub spans: Vec<Span>,
    /// Where ticks are missing: between two spans, or before the end.
    pub gaps: Vec<Gap>,
    /// How the run ended; `None` where the process died, or the run goes on.
    pub end: Option<RunEnd>,
    /// Where ticks are missing and no checkpoint has followed yet, so that the ticks that follow can't be
    /// used: whether the recorder has lost them (`true`), or the file is damaged (`false`).
    open_gap: Option<bool>,
}

/// Ticks that are not in a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// The first tick after them, or the number of ticks of the run if they are its last.
    pub before: u64,
    /// Whether the recorder itself has lost them, since the file could not be written fast enough (`true`), or
    /// the file is damaged there (`false`).
    pub lost: bool,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub struct RunEnd {
    /// The number of ticks.
    pub ticks: u64,
    /// The whole hash after the last tick.
    pub hash: u64,
    /// What acted on the control after the last tick, for example that its outputs were made safe.
    pub actions: Vec<Action>,
    /// Why the control stopped the program, if it did so between two ticks, since a tick would have begun too late.
    pub stop: Option<RecordedStop>,
}

/// What a record holds from one checkpoint to the next.
#[derive(Debug)]
pub struct Span {
    /// The number of the first tick, before which the checkpoint was taken.
    pub first: u64,
    /// How many online changes there were before the checkpoint.
    pub generation: u16,
    /// The number of the program among those of the run.
    pub program: u16,
    /// When the checkpoint was taken, in milliseconds since 1970.
    pub time_ms: u64,
    /// Whether the record shows no gap between the span before and this one. (Ticks that came while the file
    /// could not be written may be missing all the same; a [`Replayer`](super::Replayer) notices that.)
    pub follows: bool,
    /// The whole hash before the first tick.
    pub(super) hash: u64,
    /// The [fingerprint](plcc_runtime::Executive::fingerprint) of the executive that the checkpoint is of.
    pub fingerprint: u64,
    checkpoint: Place,
    ticks: Vec<Place>,
}

impl Span {
    /// Whether any tick of it is kept.
    pub fn has_ticks(&self) -> bool {
        !self.ticks.is_empty()
    }
}

/// A checkpoint in a record.
pub(super) struct StoredCheckpoint {
    pub(super) image: Vec<u8>,
    pub(super) state: Vec<u8>,
}

impl Recording {
    /// Opens a record and finds its runs and spans. `path` is that of its newest part; the older part is read
    /// too, if it exists.
    ///
    /// # Errors
    /// When the file can't be read, or is not a record of this version.
    pub fn open(path: &Path) -> Result<Self, RecordError> {
        let parts = open_parts(path).map_err(|error| RecordError::Read(path.to_owned(), error))?;
        let mut recording = Self { parts, runs: vec![], damaged: 0, is_run_unknown: false };
        recording.refresh()?;
        if recording.runs.is_empty() {
            return Err(match recording.is_run_unknown {
                true => RecordError::NoRun(path.to_owned()),
                false => RecordError::NoRecord(path.to_owned()),
            });
        }
        Ok(recording)
    }

    /// Takes in what was written since the record was opened or refreshed. It goes on in the same files: when a
    /// new part was begun meanwhile, the record has to be opened again to see it.
    ///
    /// # Errors
    /// When the file can't be read.
    pub fn refresh(&mut self) -> Result<(), RecordError> {
        for number in 0..self.parts.len() {
            let Some(part) = self.parts.get(number) else { break };
            let failed = |error| RecordError::Read(part.path.clone(), error);
            let length = part.file.metadata().map_err(failed)?.len();
            let mut at = part.read;
            let (mut found, mut wasted) = (vec![], 0);
            while let Some((block, before)) =
                block::find(&part.file, at, length, &mut wasted).map_err(failed)?
            {
                at = block.end();
                found.push((block, before));
            }
            for (block, before) in found {
                self.take(Place { part: number, block }, before)?;
            }
            if let Some(part) = self.parts.get_mut(number) {
                part.read = at;
            }
        }
        Ok(())
    }

    /// Takes in a block that stands after `before` bytes of damage.
    fn take(&mut self, place: Place, before: u64) -> Result<(), RecordError> {
        self.damaged += before;
        let Block { kind, tick, .. } = place.block;
        if kind == Kind::Start {
            // The version stands first in every version.
            let content = self.content(place)?;
            let version = postcard::take_from_bytes(&content).map(|(version, _)| version);
            if let Ok(version) = version
                && version != VERSION
            {
                return Err(RecordError::Version(version));
            }
            let header: RunHeader = self.decoded(place)?;
            self.is_run_unknown = false;
            // A run has a start block before each checkpoint.
            match self.runs.last_mut().filter(|run| run.header.run == header.run) {
                Some(run) if before > 0 => _ = run.open_gap.get_or_insert(false),
                Some(_) => {}
                None => self.runs.push(RecordedRun {
                    header,
                    programs: vec![],
                    spans: vec![],
                    gaps: vec![],
                    end: None,
                    open_gap: (before > 0).then_some(false),
                }),
            }
            return Ok(());
        }
        let content = match kind {
            Kind::Ticks => vec![],
            _ => self.content(place)?,
        };
        // Blocks before the first start block belong to no run that is known; neither do those of a run whose start
        // block is damaged, which shows in that its ticks are counted from 0 again.
        let is_earlier = |run: &RecordedRun| run.spans.last().is_some_and(|span| tick < span.first);
        let run = self.runs.last_mut().filter(|_| !self.is_run_unknown);
        let Some(run) = run.filter(|run| kind != Kind::Checkpoint || !is_earlier(run)) else {
            self.is_run_unknown = true;
            return Ok(());
        };
        if before > 0 {
            run.open_gap.get_or_insert(false);
        }
        let damaged = || RecordError::Damaged(tick);
        match kind {
            Kind::Start => {}
            Kind::Program => {
                let (number, program): (u16, RecordedProgram) =
                    postcard::from_bytes(&content).map_err(|_| damaged())?;
                let index = usize::from(number);
                if index >= run.programs.len() {
                    run.programs.resize(index + 1, RecordedProgram::Unknown);
                }
                if let Some(slot) = run.programs.get_mut(index) {
                    *slot = program;
                }
            }
            Kind::Checkpoint => {
                let (numbers, _) = checkpoint_head(&content).ok_or_else(damaged)?;
                let [program, hash, time_ms, fingerprint] = numbers;
                let gap = run.open_gap.take().map(|lost| Gap { before: tick, lost });
                run.spans.push(Span {
                    first: tick,
                    generation: (program >> 16) as u16,
                    program: program as u16,
                    time_ms,
                    follows: gap.is_none() && !run.spans.is_empty(),
                    hash,
                    fingerprint,
                    checkpoint: place,
                    ticks: vec![],
                });
                run.gaps.extend(gap);
            }
            Kind::Ticks => {
                if let Some(span) = run.spans.last_mut().filter(|_| run.open_gap.is_none()) {
                    span.ticks.push(place);
                }
            }
            Kind::Gap => run.open_gap = Some(true),
            Kind::End => {
                let (hash, rest) = content.split_first_chunk::<8>().ok_or_else(damaged)?;
                let (actions, stop) = read_trailing(rest).ok_or_else(damaged)?;
                let gap = run.open_gap.take().map(|lost| Gap { before: tick, lost });
                run.gaps.extend(gap);
                run.end =
                    Some(RunEnd { ticks: tick, hash: u64::from_le_bytes(*hash), actions, stop });
            }
        }
        Ok(())
    }

    /// What a block holds, decompressed.
    fn content(&self, place: Place) -> Result<Vec<u8>, RecordError> {
        let damaged = RecordError::Damaged(place.block.tick);
        let Some(part) = self.parts.get(place.part) else { return Err(damaged) };
        place.block.read(&part.file).map_err(|error| RecordError::Read(part.path.clone(), error))
    }

    fn decoded<T: serde::de::DeserializeOwned>(&self, place: Place) -> Result<T, RecordError> {
        let content = self.content(place)?;
        postcard::from_bytes(&content).map_err(|_| RecordError::Damaged(place.block.tick))
    }

    /// The runs in the order in which they were recorded.
    pub fn runs(&self) -> &[RecordedRun] {
        &self.runs
    }

    /// The run that was recorded last.
    pub fn last_run(&self) -> Option<&RecordedRun> {
        self.runs.last()
    }

    /// How many bytes of the record belong to no whole block: they are damaged, or the end of their block is
    /// missing.
    pub fn damaged_bytes(&self) -> u64 {
        let open = self.parts.iter().map(|part| {
            let length = part.file.metadata().map_or(0, |metadata| metadata.len());
            length.saturating_sub(part.read)
        });
        self.damaged + open.sum::<u64>()
    }

    /// The recorded ticks of a span, in order.
    ///
    /// # Errors
    /// When the file can't be read or is damaged.
    pub fn ticks(&self, span: &Span) -> Result<Vec<TickRecord>, RecordError> {
        let mut ticks = vec![];
        let mut next = span.first;
        for place in &span.ticks {
            let content = self.content(*place)?;
            if place.block.tick != next {
                return Err(RecordError::Damaged(next));
            }
            let read = read_ticks(&content, &mut next).ok_or(RecordError::Damaged(next))?;
            ticks.extend(read);
            if ticks.len() as u64 > MAX_TICKS {
                return Err(RecordError::Damaged(next));
            }
        }
        Ok(ticks)
    }

    /// The number of the tick after a span's last one.
    ///
    /// # Errors
    /// When the file can't be read or is damaged.
    pub fn end_of(&self, span: &Span) -> Result<u64, RecordError> {
        let Some(place) = span.ticks.last() else { return Ok(span.first) };
        let mut next = place.block.tick;
        let content = self.content(*place)?;
        read_ticks(&content, &mut next).ok_or(RecordError::Damaged(next))?;
        Ok(next)
    }

    /// The checkpoint with which a span begins.
    pub(super) fn checkpoint(&self, span: &Span) -> Result<StoredCheckpoint, RecordError> {
        let content = self.content(span.checkpoint)?;
        let damaged = || RecordError::Damaged(span.first);
        let (numbers, rest) = checkpoint_head(&content).ok_or_else(damaged)?;
        let [first, ..] = numbers;
        let (image, state) = rest.split_at_checked((first >> 32) as usize).ok_or_else(damaged)?;
        Ok(StoredCheckpoint { image: image.to_vec(), state: state.to_vec() })
    }
}

/// The four numbers with which a checkpoint begins, and the image and the state after them. The first number has
/// the program's number (bits 0 to 15), the generation (16 to 31) and the length of the image (32 to 63); the
/// others are the hash, the time and the fingerprint.
fn checkpoint_head(content: &[u8]) -> Option<([u64; 4], &[u8])> {
    let mut numbers = [0; 4];
    let mut rest = content;
    for number in &mut numbers {
        let bytes;
        (bytes, rest) = rest.split_first_chunk::<8>()?;
        *number = u64::from_le_bytes(*bytes);
    }
    Some((numbers, rest))
}

impl RecordedRun {
    /// The generations of which ticks are kept, in order. A generation is the number of online changes before it.
    pub fn generations(&self) -> Vec<u16> {
        let kept = self.spans.iter().filter(|span| span.has_ticks());
        let mut all: Vec<u16> = kept.map(|span| span.generation).collect();
        all.dedup();
        all
    }

    /// The program that ran after so many online changes; `None` if no checkpoint of it is kept.
    pub fn program_of(&self, generation: u16) -> Option<&RecordedProgram> {
        static UNKNOWN: RecordedProgram = RecordedProgram::Unknown;
        let span = self.spans.iter().find(|span| span.generation == generation)?;
        Some(self.programs.get(usize::from(span.program)).unwrap_or(&UNKNOWN))
    }

    /// Whether any tick is kept. A control that was killed within a second of its start has left none.
    pub fn has_ticks(&self) -> bool {
        self.spans.iter().any(Span::has_ticks)
    }

    /// The number of the first tick that is kept.
    pub fn first_tick(&self) -> u64 {
        self.spans.iter().find(|span| span.has_ticks()).map_or(0, |span| span.first)
    }
}
