//! The thread that writes a record in real time.
//!
//! The thread that runs the ticks puts frames into a queue of bytes. This thread looks at the queue every
//! 20 ms, and writes what has come to the file at least once a second. When the file can't be written, it
//! says so once and drops what comes. It asks for a checkpoint every two seconds, and tries to go on
//! writing with that: this pause is longer than that of other background writers and does not grow, since each attempt
//! costs a checkpoint, which the thread that runs the ticks makes.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use rtrb::{Consumer, RingBuffer};

use super::file::{FrameKind, Programs, RecordFile};
use super::queue::{
    FRAME_HEADER, LargerQueue, NextQueue, NextQueues, queue_length, read_frame_header, touch,
};
use super::recorder::Recorder;
use super::run_header::RecordedProgram;
use plcc_files::{BackgroundWriter, Next, Unfinished, why_not_written};
use plcc_runtime::Executive;
use plcc_runtime::small_thread::small_thread;

/// How often the thread looks at the queue. It is not woken, since waking it is a system call.
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// How long ticks wait at most before they are written.
const WRITE_INTERVAL: Duration = Duration::from_millis(900);
/// Time from a failure to the next attempt.
const RETRY_INTERVAL: Duration = Duration::from_secs(2);
/// How long the end of a run waits until the record is written.
const END_WAIT: Duration = Duration::from_secs(2);
/// What the thread that writes a record has to tell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RecordReport {
    /// This many ticks are missing in the record.
    Lost(u64),
    /// The file can't be written for the time being; a sentence that says why.
    Failing(String),
    /// It is written again; a sentence that says from where on.
    WrittenAgain(String),
}

/// To whom that is told, in the thread that writes.
type Tell = Box<dyn FnMut(RecordReport) + Send>;

/// The thread that writes a record, as the thread of the run holds it: to ask for its end, and for its result.
#[derive(Debug)]
pub struct RecordThread {
    /// The file's path, for people.
    shown_path: String,
    programs: RecordedPrograms,
    writer: BackgroundWriter,
}

impl RecordThread {
    /// Starts the thread, and gives the recorder whose frames it writes. `executive` is the one that will run, at
    /// power-up. The thread calls `tell` with what
    /// happens to the record.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn start(
        file: RecordFile,
        executive: &dyn Executive,
        tell: impl FnMut(RecordReport) + Send + 'static,
    ) -> io::Result<(Recorder, Self)> {
        let length = queue_length(executive);
        let (mut queue, mut frames) = RingBuffer::<u8>::new(length);
        touch(&mut queue, &mut frames);
        let next_queues = NextQueues::default();
        let wants_checkpoint = file.wants_checkpoint();
        let (programs, shown_path) = (file.programs(), file.path().display().to_string());
        let mut writer = Writer {
            file,
            shown_path: shown_path.clone(),
            tell: Box::new(tell),
            frames,
            next_queues: Arc::clone(&next_queues),
            bytes: vec![],
            trouble: None,
            written: Instant::now(),
        };
        let round = move |ends| writer.round(ends);
        let writer = BackgroundWriter::start(small_thread("record"), round)?;
        let recorder = Recorder::to_queue(queue, wants_checkpoint, executive);
        let programs = RecordedPrograms { programs, next_queues, length };
        Ok((recorder, Self { shown_path, programs, writer }))
    }

    /// The list to which the programs of online changes are added.
    pub fn programs(&self) -> RecordedPrograms {
        self.programs.clone()
    }

    /// Waits until everything is written, at most two seconds. The recorder must have been ended before.
    ///
    /// # Errors
    /// When it could not be written in that time; the text is for people.
    pub fn finish(self) -> Result<(), String> {
        self.writer.finish(Instant::now() + END_WAIT).map_err(|unfinished| {
            let why = match unfinished {
                Unfinished::Stuck => "it takes too long".into(),
                Unfinished::Failed(why) => why,
            };
            format!("the end of the record {} is missing: {why}", self.shown_path)
        })
    }
}

/// The list of the programs of a run that is being recorded. Whoever prepares an online change adds the new
/// program.
#[derive(Clone, Debug)]
pub struct RecordedPrograms {
    programs: Programs,
    next_queues: NextQueues,
    /// The length of the queue with which the run began.
    length: usize,
}

impl RecordedPrograms {
    /// Adds a program. Gives its number in the record, 65 535 at most.
    pub fn add(&self, program: RecordedProgram) -> u16 {
        let mut programs = self.programs.lock().unwrap_or_else(PoisonError::into_inner);
        programs.push(program);
        u16::try_from(programs.len().saturating_sub(1)).unwrap_or(u16::MAX)
    }

    /// A longer queue for the run, if the one with which it began is too short for this executive's
    /// checkpoints. It allocates memory, so it is called before an online change, in another thread than
    /// that of the ticks.
    pub fn larger_queue(&self, executive: &dyn Executive) -> Option<LargerQueue> {
        let length = queue_length(executive);
        if length <= self.length {
            return None;
        }
        let (mut queue, mut frames) = RingBuffer::<u8>::new(length);
        touch(&mut queue, &mut frames);
        let in_use = Arc::new(AtomicBool::new(false));
        let next = NextQueue { frames, in_use: Arc::clone(&in_use) };
        self.next_queues.lock().unwrap_or_else(PoisonError::into_inner).push(next);
        Some(LargerQueue { frames: queue, in_use })
    }
}

/// The side of the thread that writes.
struct Writer {
    file: RecordFile,
    /// The file's path, for people.
    shown_path: String,
    tell: Tell,
    frames: Consumer<u8>,
    /// Queues of which one may take that one's place.
    next_queues: NextQueues,
    /// Bytes that were taken from the queue and are not a whole frame yet.
    bytes: Vec<u8>,
    /// Why the file can't be written at present, and when a checkpoint was last asked for.
    trouble: Option<(String, Instant)>,
    /// When waiting ticks were last written.
    written: Instant,
}

impl Writer {
    /// Writes what has come. At the end there is no further attempt.
    fn round(&mut self, ends: bool) -> Next {
        self.take_frames();
        if ends || self.written.elapsed() >= WRITE_INTERVAL {
            self.written = Instant::now();
            let result = if self.trouble.is_none() { self.file.flush() } else { Ok(()) };
            self.note(result);
        }
        if let Some((why, asked)) = &mut self.trouble {
            if ends {
                return Next::Failed(std::mem::take(why));
            }
            if asked.elapsed() >= RETRY_INTERVAL {
                *asked = Instant::now();
                self.file.ask_for_checkpoint();
            }
        }
        Next::Idle(POLL_INTERVAL)
    }

    /// Takes the whole frames that are in the queue, and goes on with the next queue if that is in use.
    fn take_frames(&mut self) {
        loop {
            // This is looked up first: when another queue is in use, nothing more comes into this one.
            let next = self.queue_in_use();
            self.take_frames_of_queue();
            let Some(next) = next else { return };
            self.frames = next;
        }
    }

    /// Takes the queue out of the list that has come into use, if one has. Those that never will are freed.
    fn queue_in_use(&self) -> Option<Consumer<u8>> {
        let mut queues = self.next_queues.lock().unwrap_or_else(PoisonError::into_inner);
        let is_used = |queue: &NextQueue| queue.in_use.load(Ordering::Acquire);
        // The other end of a queue is dropped when its online change was not carried out.
        queues.retain(|queue| !queue.frames.is_abandoned() || is_used(queue));
        let position = queues.iter().position(is_used)?;
        Some(queues.remove(position).frames)
    }

    /// Takes the whole frames that are in the present queue.
    fn take_frames_of_queue(&mut self) {
        let waiting = self.frames.slots();
        if let Ok(chunk) = self.frames.read_chunk(waiting) {
            let (first, second) = chunk.as_slices();
            self.bytes.extend_from_slice(first);
            self.bytes.extend_from_slice(second);
            chunk.commit_all();
        }
        let bytes = std::mem::take(&mut self.bytes);
        let mut rest = bytes.as_slice();
        while let Some((kind, length, tick)) = read_frame_header(rest)
            && let Some(content) = rest.get(FRAME_HEADER..FRAME_HEADER + length)
        {
            self.take(kind, tick, content);
            rest = rest.get(FRAME_HEADER + length..).unwrap_or_default();
        }
        self.bytes = rest.to_vec();
    }

    fn take(&mut self, kind: FrameKind, tick: u64, content: &[u8]) {
        if kind == FrameKind::Gap
            && let Some(count) = content.first_chunk::<8>()
        {
            let count = u64::from_le_bytes(*count);
            (self.tell)(RecordReport::Lost(count));
        }
        if self.trouble.is_some() {
            if kind != FrameKind::Checkpoint {
                return;
            }
            let result = self.file.take(kind, tick, &[content]);
            if result.is_ok() {
                self.trouble = None;
                let text =
                    format!("the record {} is written again, from tick {tick} on", self.shown_path);
                (self.tell)(RecordReport::WrittenAgain(text));
            }
            return;
        }
        let result = self.file.take(kind, tick, &[content]);
        self.note(result);
    }

    /// Notes and reports a failure, if `result` is one.
    fn note(&mut self, result: io::Result<()>) {
        if let Err(error) = result {
            let why = why_not_written(&error);
            let text = format!("the record {} can't be written at present: {why}", self.shown_path);
            (self.tell)(RecordReport::Failing(text));
            self.trouble = Some((why, Instant::now()));
        }
    }
}
