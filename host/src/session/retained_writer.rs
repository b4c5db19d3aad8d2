//! Writes the retained file while a control runs in real time, since the power may fail at any time.
//!
//! A thread of its own writes, so that no tick waits for the disk. The thread that runs the ticks
//! fills a buffer and puts it into a queue; neither of the two operations waits or calls the
//! operating system. Where the file can't be written, the writing thread tells it at once, keeps the
//! newest state, and tries again, until it succeeds. Unlike other outputs this one is not left at the first failure when
//! the run ends: attempts go on for five seconds.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use rtrb::{Consumer, Producer, RingBuffer};

use crate::journal::{EntryKind, Journal};
use crate::retain::RetainedFile;
use crate::run::{AfterTick, Hook};
use plcc_files::{BackgroundWriter, Next, Retry, Unfinished};
use plcc_runtime::Executive;
use plcc_runtime::small_thread::small_thread;

use super::SessionError;

/// Time from one write to the next, at least.
const WRITE_INTERVAL: Duration = Duration::from_secs(1);
/// How often the writing thread looks whether there is a new state. It is not woken, since waking it
/// is a system call.
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// How long the end of a run waits until the last state is written.
const END_WAIT: Duration = Duration::from_secs(5);
/// Buffers that go back and forth between the threads: one is filled, one is to be written, and one
/// holds what was written last.
const BUFFERS: usize = 3;

/// Why the retained file can't be written at present, if so; the writing thread says it, and any other
/// may ask.
#[derive(Clone, Debug, Default)]
pub(super) struct RetainedTrouble(Arc<Mutex<Option<String>>>);

impl RetainedTrouble {
    /// The reason.
    pub(super) fn get(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn set(&self, reason: Option<String>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = reason;
    }
}

/// How many bytes a buffer has room for. An online change may raise it; then the writing thread makes new
/// buffers.
#[derive(Clone, Debug)]
pub(super) struct BufferSize(Arc<AtomicUsize>);

impl BufferSize {
    /// The size for a state of this many bytes. A PMAC that nothing has saved yet has none, and more later.
    fn of(state: usize) -> usize {
        state.saturating_mul(2).max(1 << 16)
    }

    /// Has room made for what an executive keeps. It is called before that one runs.
    pub(super) fn make_room(&self, executive: &dyn Executive) {
        let size = Self::of(executive.retained().map_or(0, |state| state.len()));
        self.0.fetch_max(size, Ordering::Relaxed);
    }

    fn get(&self) -> usize {
        self.0.load(Ordering::Relaxed)
    }
}

/// What the writing thread is sent.
enum Sent {
    /// A state.
    State(Vec<u8>),
    /// A buffer that has become too small, to be freed.
    TooSmall(Vec<u8>),
}

/// The side of the thread that runs the ticks.
pub(super) struct RetainedWriter {
    path: PathBuf,
    /// When the data is handed over next.
    next: Instant,
    /// Buffers that may be filled.
    free: Consumer<Vec<u8>>,
    /// A buffer that was taken and not needed.
    spare: Option<Vec<u8>>,
    /// The revision of the data that was handed over last, where the control has one.
    revision: Option<u64>,
    to_write: Producer<Sent>,
    buffer_size: BufferSize,
    shown_trouble: RetainedTrouble,
    thread: BackgroundWriter,
}

impl RetainedWriter {
    /// Starts the thread that writes. `size` is how many bytes a state is expected to have.
    ///
    /// # Errors
    /// When no thread can be started.
    pub(super) fn new(
        path: PathBuf,
        file: RetainedFile,
        size: usize,
        journal: Journal,
    ) -> Result<Self, SessionError> {
        // There is room for the last state too, which needs no buffer of these, and for new buffers
        // beside those that have become too small.
        let (to_write, states) = RingBuffer::new(2 * BUFFERS + 1);
        let (used, free) = RingBuffer::new(2 * BUFFERS + 1);
        let buffer_size = BufferSize(Arc::new(BufferSize::of(size).into()));
        let shown = path.display().to_string();
        let shown_trouble = RetainedTrouble::default();
        let mut writer = Writer {
            file,
            shown,
            journal,
            states,
            used,
            buffer_size: buffer_size.clone(),
            made: 0,
            newest: None,
            written: None,
            trouble: None,
            retry: Retry::default(),
            deadline: None,
            shown_trouble: shown_trouble.clone(),
        };
        writer.make_buffers();
        let round = move |ends| writer.round(ends);
        let thread = BackgroundWriter::start(small_thread("retain"), round);
        let thread = thread.map_err(|error| {
            SessionError(format!("no thread for the retained file can be started: {error}"))
        })?;
        let next = Instant::now() + WRITE_INTERVAL;
        Ok(Self {
            path,
            next,
            free,
            spare: None,
            revision: None,
            to_write,
            buffer_size,
            shown_trouble,
            thread,
        })
    }

    /// Where the writing thread says what keeps it from writing.
    pub(super) fn trouble(&self) -> RetainedTrouble {
        self.shown_trouble.clone()
    }

    /// How large the buffers are.
    pub(super) fn buffer_size(&self) -> BufferSize {
        self.buffer_size.clone()
    }

    /// A buffer that may be filled and is large enough, if there is one. Those that are too small go to the
    /// writing thread, which frees them.
    fn take_buffer(&mut self) -> Option<Vec<u8>> {
        loop {
            let buffer = self.spare.take().or_else(|| self.free.pop().ok())?;
            if buffer.capacity() >= self.buffer_size.get() {
                return Some(buffer);
            }
            if let Err(rtrb::PushError::Full(Sent::TooSmall(buffer))) =
                self.to_write.push(Sent::TooSmall(buffer))
            {
                // It is tried again the next time.
                self.spare = Some(buffer);
                return None;
            }
        }
    }

    /// Hands the retained data to the thread that writes, if the last time is long enough ago. While
    /// that thread has not given a buffer back nothing happens; the call after the next interval
    /// tries again.
    fn hand_over(&mut self, executive: &dyn Executive) {
        let now = Instant::now();
        if now < self.next {
            return;
        }
        self.next = now + WRITE_INTERVAL;
        let revision = executive.retained_revision();
        if revision.is_some() && revision == self.revision {
            return;
        }
        let Some(mut state) = self.take_buffer() else { return };
        self.revision = revision;
        state.clear();
        if executive.retained_into(&mut state) {
            // There is room for every buffer.
            let _ = self.to_write.push(Sent::State(state));
        } else {
            self.spare = Some(state);
        }
    }

    /// Has the last state written, and waits for that at most five seconds.
    ///
    /// # Errors
    /// When it could not be written.
    pub(super) fn finish(mut self, executive: &dyn Executive) -> Result<(), SessionError> {
        if let Some(state) = executive.retained() {
            // There is room for one more than the buffers.
            let _ = self.to_write.push(Sent::State(state));
        }
        // Its own attempts end a little earlier.
        let wait = END_WAIT + Duration::from_millis(500);
        self.thread.finish(Instant::now() + wait).map_err(|unfinished| {
            let (shown, seconds) = (self.path.display(), END_WAIT.as_secs());
            SessionError(match unfinished {
                Unfinished::Failed(why) => why,
                Unfinished::Stuck => {
                    format!("the retained file {shown} could not be written within {seconds} s")
                }
            })
        })
    }
}

impl Hook for RetainedWriter {
    fn after_tick(&mut self, now: &mut AfterTick<'_>) {
        self.hand_over(now.executive);
    }
}

/// The side of the thread that writes.
struct Writer {
    file: RetainedFile,
    /// The file's path, for people.
    shown: String,
    journal: Journal,
    states: Consumer<Sent>,
    /// Where buffers go back.
    used: Producer<Vec<u8>>,
    buffer_size: BufferSize,
    /// The size of the buffers that were made last.
    made: usize,
    /// The newest state, where it is not written yet.
    newest: Option<Vec<u8>>,
    /// The state that was written last.
    written: Option<Vec<u8>>,
    /// What keeps the file from being written, if anything does.
    trouble: Option<Trouble>,
    /// When the next attempt is made then.
    retry: Retry,
    /// Where other threads see what keeps the file from being written.
    shown_trouble: RetainedTrouble,
    /// When the attempts end, once the run has ended.
    deadline: Option<Instant>,
}

/// What is known while the file can't be written.
struct Trouble {
    /// When the first attempt failed.
    since: Instant,
    /// How many attempts have failed.
    attempts: u64,
    /// Why the last attempt failed.
    error: String,
}

impl Writer {
    /// Writes the newest state, or tries to.
    fn round(&mut self, ends: bool) -> Next {
        while let Ok(sent) = self.states.pop() {
            if let Sent::State(state) = sent
                && let Some(older) = self.newest.replace(state)
            {
                self.give_back(older);
            }
        }
        self.make_buffers();
        let now = Instant::now();
        if ends && self.deadline.is_none() {
            self.deadline = Some(now + END_WAIT);
            // So that there are some attempts until then.
            self.retry.begin_anew(now);
        }
        if self.retry.is_due(now) {
            self.write(now);
        }
        match &self.trouble {
            None => Next::Idle(POLL_INTERVAL),
            Some(trouble) if self.deadline.is_some_and(|deadline| now >= deadline) => {
                Next::Failed(trouble.error.clone())
            }
            Some(_) => Next::Later(POLL_INTERVAL),
        }
    }

    /// Makes buffers of the present size, unless that was done.
    fn make_buffers(&mut self) {
        let size = self.buffer_size.get();
        if size > self.made && self.used.slots() > BUFFERS {
            self.made = size;
            for _ in 0..BUFFERS {
                // Its pages are written to here, so that no tick is the first that does it.
                let mut buffer = vec![u8::MAX; size];
                buffer.clear();
                let _ = self.used.push(buffer);
            }
        }
    }

    /// Gives a buffer back, unless it is too small by now.
    fn give_back(&mut self, buffer: Vec<u8>) {
        if buffer.capacity() >= self.made {
            // There is room for every buffer, and for that of the last state.
            let _ = self.used.push(buffer);
        }
    }

    /// Writes the newest state, if it is another than the last one that was written.
    fn write(&mut self, now: Instant) {
        let Some(state) = self.newest.take() else { return };
        if self.written.as_ref() == Some(&state) {
            self.give_back(state);
            return;
        }
        // A mistake in plcc must not end this thread.
        let stored = catch_unwind(AssertUnwindSafe(|| self.file.store(&state)));
        let failure = match stored {
            Ok(Ok(())) => None,
            Ok(Err(error)) => Some(error.to_string()),
            Err(_) => Some(format!(
                "the retained file {} can't be written: an internal error of plcc",
                self.shown
            )),
        };
        match failure {
            None => {
                self.recovered(now);
                if let Some(former) = self.written.replace(state) {
                    self.give_back(former);
                }
            }
            Some(error) => {
                self.failed(now, error);
                self.newest = Some(state);
            }
        }
    }

    fn failed(&mut self, now: Instant, error: String) {
        let known = self.trouble.as_ref().is_some_and(|trouble| trouble.error == error);
        if !known {
            self.shown_trouble.set(Some(error.clone()));
            let file = self.shown.clone();
            self.journal.write(EntryKind::RetainedFileFailed { file, error: error.clone() });
        }
        let trouble = self.trouble.get_or_insert_with(|| Trouble {
            since: now,
            attempts: 0,
            error: String::new(),
        });
        trouble.attempts += 1;
        trouble.error = error;
        self.retry.failed(now);
    }

    fn recovered(&mut self, now: Instant) {
        self.retry.succeeded();
        if let Some(trouble) = self.trouble.take() {
            self.shown_trouble.set(None);
            self.journal.write(EntryKind::RetainedFileRecovered {
                file: self.shown.clone(),
                attempts: trouble.attempts,
                failed: now.saturating_duration_since(trouble.since),
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;

    #[test]
    fn buffers_that_an_online_change_makes_too_small_are_replaced_by_the_writing_thread() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("kept");
        let file = RetainedFile::open(&path, Dialect::Pmi).unwrap();
        let mut writer = RetainedWriter::new(path, file, 10, Journal::discarding()).unwrap();
        const LARGE: usize = 1 << 20;
        for size in [LARGE, 2 * LARGE] {
            writer.buffer_size().0.store(size, Ordering::Relaxed);
            let mut large = vec![];
            while large.len() < BUFFERS {
                match writer.take_buffer() {
                    Some(buffer) => large.push(buffer),
                    None => std::thread::yield_now(),
                }
            }
            assert!(large.iter().all(|buffer| buffer.capacity() >= size));
            writer.spare = large.pop();
        }
        assert_eq!(writer.thread.finish(Instant::now() + END_WAIT), Ok(()));
    }
}
