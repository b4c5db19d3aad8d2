//! The journal: what happens around a program while it runs. Each [`Entry`] is a line of JSON in
//! the file that `--log` names, and a sentence on standard error.
//!
//! The events of the program itself (`--events`) are not part of it, since they are the same in every
//! run; a journal tells of this run on this computer: overruns, files that can't be written, who
//! changed a variable from outside.
//!
//! Any thread writes by a [`Journal`], which is cloned for each. The thread that runs the ticks in
//! real time must not wait, and writes by a [`ScanJournal`]: a queue of fixed size. What does not
//! fit there is counted, and the journal says how many entries are missing.
//!
//! In real time threads of the journal's own write the lines, one for each destination, so that a
//! terminal that is stopped does not keep lines from the log. In simulated time every entry is
//! written at once, by the thread that makes it.
//!
//! ```
//! use plcc_host::journal::{Destinations, EntryKind, JournalOwner};
//!
//! # fn main() -> std::io::Result<()> {
//! let (owner, mut scan) = JournalOwner::start(Destinations::default(), true)?;
//! let journal = owner.journal();
//! std::thread::spawn(move || journal.write(EntryKind::Note { text: "started".into() }));
//! scan.write(41, EntryKind::Lost { output: "trace", count: 3 });
//! # let _ =
//! owner.finish();
//! # Ok(())
//! # }
//! ```

mod entry;
mod progress_line;
mod queued;
mod sink;
#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

pub use entry::{Entry, EntryKind, Severity};
pub(crate) use progress_line::{FIRST_SHOWN_AFTER, UPDATE_INTERVAL, progress_line};
use queued::Queued;
pub(crate) use queued::trouble;

/// How many entries of the thread that runs the ticks wait at most to be written.
const SCAN_QUEUE: usize = 1024;
/// How long the end of a run waits for the journal's lines to be written.
const END_WAIT: Duration = Duration::from_secs(1);
/// The value of [`Shared::tick`] before the first tick.
const NO_TICK: u64 = u64::MAX;

/// Where a journal writes.
#[derive(Debug, Default)]
pub struct Destinations {
    /// The log: a JSON object a line.
    pub log: Option<File>,
    /// Standard error, or what stands for it: sentences for people.
    pub console: Option<File>,
    /// In real time, where `console` is a terminal on which a line is to show how many ticks have run: the
    /// number of ticks that the whole run has, if that is known. `None` shows no such line.
    pub progress: Option<Option<u64>>,
    /// Whether each sentence first removes such a line, which another process may have left on the terminal when it died.
    pub removes_progress: bool,
}

impl Destinations {
    /// Standard error, and the log where there is one.
    pub fn standard(log: Option<File>) -> Self {
        Self { log, console: standard_error(), ..Self::default() }
    }
}

/// Standard error as a file, without the lock that [`io::stderr`] has: a thread that is stuck in
/// writing must not stop others.
#[cfg(unix)]
fn standard_error() -> Option<File> {
    use std::os::fd::AsFd;
    io::stderr().as_fd().try_clone_to_owned().ok().map(File::from)
}

#[cfg(not(unix))]
fn standard_error() -> Option<File> {
    None
}

/// A counter of what an output has lost. The thread that runs the ticks counts, and the journal writes
/// entries about it.
#[derive(Clone, Debug, Default)]
pub struct LossCounter(Arc<AtomicU64>);

impl LossCounter {
    /// Counts `count` more. Called by one thread only.
    #[inline]
    pub fn add(&self, count: u64) {
        self.0.store(self.0.load(Ordering::Relaxed).wrapping_add(count), Ordering::Relaxed);
    }

    /// How many there were so far.
    pub fn total(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

/// Writes entries. Each thread has a clone, but in real time the thread that runs the ticks has a
/// [`ScanJournal`].
#[derive(Clone, Debug)]
pub struct Journal {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    /// The tick that runs or ran last.
    tick: AtomicU64,
    /// How often a tick has begun, or would have begun if nobody had stopped the program.
    rounds: AtomicU64,
    mode: Mode,
}

#[derive(Debug)]
enum Mode {
    /// Nothing is written.
    Discarding,
    /// The calling thread writes.
    Direct(Mutex<Direct>),
    /// Threads of the journal write.
    Queued(Queued),
}

/// The destinations of a journal whose entries are written at once.
#[derive(Debug)]
struct Direct {
    log: Option<File>,
    console: Option<File>,
    /// Why the log could not be written.
    failure: Option<String>,
}

impl Direct {
    fn write(&mut self, entry: &Entry) {
        // Nothing can be said where standard error can't be written.
        let _ = self.console.as_mut().map(|console| console.write_all(sentence(entry).as_bytes()));
        if let Some(log) = self.log.as_mut().filter(|_| entry.kind.is_logged())
            && let Err(error) = log.write_all(line(entry).as_bytes())
        {
            self.log = None;
            self.failure = Some(plcc_files::why_not_written(&error));
        }
    }
}

/// An entry as a line of the log, with its line feed.
fn line(entry: &Entry) -> String {
    // Writing to memory does not fail.
    let mut line = serde_json::to_string(entry).unwrap_or_default();
    line.push('\n');
    line
}

/// An entry as a line for people, with its line feed.
fn sentence(entry: &Entry) -> String {
    let word = entry.kind.severity().word();
    let text = entry.kind.to_string();
    let text = plcc_abi::printable(&text);
    match entry.tick {
        Some(tick) if entry.kind.names_tick() => format!("{word}: tick {tick}: {text}\n"),
        _ => format!("{word}: {text}\n"),
    }
}

impl Journal {
    /// A journal that is written nowhere.
    pub fn discarding() -> Self {
        Self::new(Mode::Discarding)
    }

    fn new(mode: Mode) -> Self {
        Self {
            shared: Arc::new(Shared {
                tick: AtomicU64::new(NO_TICK),
                rounds: AtomicU64::new(0),
                mode,
            }),
        }
    }

    /// Writes an entry, with the present time and the tick that runs or ran last. It waits for a file
    /// in simulated time only.
    pub fn write(&self, kind: EntryKind) {
        let tick = Some(self.shared.tick.load(Ordering::Relaxed)).filter(|&tick| tick != NO_TICK);
        self.put(Entry { time: SystemTime::now(), tick, kind });
    }

    /// How many ticks have begun.
    pub fn ticks(&self) -> u64 {
        // Before the first tick the counter holds the largest number, after which 0 follows.
        self.shared.tick.load(Ordering::Relaxed).wrapping_add(1)
    }

    /// A number that grows for as long as the thread that runs the ticks goes on, also while a user has
    /// stopped the program, so that no tick begins.
    pub fn rounds(&self) -> u64 {
        self.shared.rounds.load(Ordering::Relaxed)
    }

    /// Writes a note.
    pub fn note(&self, text: impl Into<Cow<'static, str>>) {
        self.write(EntryKind::Note { text: text.into() });
    }

    /// Writes a warning.
    pub fn warn(&self, text: impl Into<Cow<'static, str>>) {
        self.write(EntryKind::Warning { text: text.into() });
    }

    /// Writes an error.
    pub fn error(&self, text: impl Into<Cow<'static, str>>) {
        self.write(EntryKind::Error { text: text.into() });
    }

    /// Has the journal write an entry whenever a counter has grown, but at most one a second for each
    /// counter. In simulated time nothing is lost, and nothing is written.
    pub fn tell_losses(&self, output: &'static str, counter: LossCounter) {
        if let Mode::Queued(queued) = &self.shared.mode {
            queued.tell_losses(output, counter);
        }
    }

    /// How many entries wait for the thread that collects them.
    #[cfg(test)]
    fn backlog(&self) -> usize {
        match &self.shared.mode {
            Mode::Queued(queued) => queued.backlog(),
            Mode::Discarding | Mode::Direct(_) => 0,
        }
    }

    fn put(&self, entry: Entry) {
        match &self.shared.mode {
            Mode::Discarding => {}
            Mode::Direct(direct) => {
                direct.lock().unwrap_or_else(PoisonError::into_inner).write(&entry);
            }
            Mode::Queued(queued) => queued.put(entry),
        }
    }
}

/// Writes entries of the thread that runs the ticks. In real time it never waits, allocates no memory
/// and makes no system call but to read the clock.
#[derive(Debug)]
pub struct ScanJournal {
    journal: Journal,
    /// The queue, in real time.
    queue: Option<rtrb::Producer<Entry>>,
    lost: LossCounter,
}

impl ScanJournal {
    /// A journal that is written nowhere.
    pub fn discarding() -> Self {
        Self { journal: Journal::discarding(), queue: None, lost: LossCounter::default() }
    }

    /// Writes an entry about a tick. `kind` must hold no allocated memory.
    pub fn write(&mut self, tick: u64, kind: EntryKind) {
        let entry = Entry { time: SystemTime::now(), tick: Some(tick), kind };
        match &mut self.queue {
            None => self.journal.put(entry),
            Some(queue) => {
                if queue.push(entry).is_err() {
                    self.lost.add(1);
                }
            }
        }
    }

    /// Says which tick runs.
    #[inline]
    pub(crate) fn begin_tick(&self, tick: u64) {
        let Shared { tick: running, rounds, .. } = &*self.journal.shared;
        running.store(tick, Ordering::Relaxed);
        // Only this thread writes.
        rounds.store(rounds.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    }
}

/// Keeps a journal going until the end of a run.
#[derive(Debug)]
pub struct JournalOwner {
    journal: Journal,
}

impl JournalOwner {
    /// Starts a journal; in real time also its threads. The thread that runs the ticks gets the
    /// [`ScanJournal`].
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn start(to: Destinations, realtime: bool) -> io::Result<(Self, ScanJournal)> {
        let lost = LossCounter::default();
        if !realtime {
            let direct = Direct { log: to.log, console: to.console, failure: None };
            let journal = Journal::new(Mode::Direct(Mutex::new(direct)));
            let scan = ScanJournal { journal: journal.clone(), queue: None, lost };
            return Ok((Self { journal }, scan));
        }
        let (queue, entries) = rtrb::RingBuffer::new(SCAN_QUEUE);
        let terminal = queued::Terminal::new(&to);
        let queued = Queued::new(to.log, to.console)?;
        queued.tell_losses("log", lost.clone());
        let journal = Journal::new(Mode::Queued(queued));
        queued::start(&journal, entries, terminal)?;
        let scan = ScanJournal { journal: journal.clone(), queue: Some(queue), lost };
        Ok((Self { journal }, scan))
    }

    /// The journal for other threads.
    pub fn journal(&self) -> Journal {
        self.journal.clone()
    }

    /// Writes what waits to be written. In real time it waits for that at most a second for each
    /// destination, and threads that are stuck in writing are left behind.
    ///
    /// # Errors
    /// In simulated time: why the log could not be written. In real time an entry says so, and
    /// that is not an error.
    pub fn finish(self) -> Result<(), String> {
        match &self.journal.shared.mode {
            Mode::Discarding => Ok(()),
            Mode::Direct(direct) => {
                let failure = &direct.lock().unwrap_or_else(PoisonError::into_inner).failure;
                failure.clone().map_or(Ok(()), Err)
            }
            Mode::Queued(queued) => {
                queued.finish(END_WAIT);
                Ok(())
            }
        }
    }
}
