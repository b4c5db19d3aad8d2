//! Lines for a file or for standard error, written by a thread of their own, so that nobody else
//! waits when the file takes none.

use std::collections::VecDeque;
use std::fs::File;
use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::patient_writer::{PatientWriter, WriteOutcome};
use plcc_runtime::small_thread::small_thread;

/// How many bytes of lines wait at most; what comes then is lost.
const MAX_WAITING: usize = 1 << 20;
/// How long the thread sleeps before it tries again to write.
const RETRY: Duration = Duration::from_millis(20);

/// A queue of lines with the thread that writes them.
#[derive(Clone, Debug)]
pub(super) struct Sink {
    name: &'static str,
    shared: Arc<(Mutex<State>, Condvar)>,
}

#[derive(Debug, Default)]
struct State {
    lines: VecDeque<String>,
    /// How many bytes they have.
    bytes: usize,
    /// How many lines found no room since that was last asked for.
    lost: u64,
    /// How attempts to write went since that was last asked for; each outcome once.
    outcomes: Vec<WriteOutcome>,
    /// Whether the thread is to end when all lines are written.
    closing: bool,
    /// Whether it has ended.
    finished: bool,
}

impl Sink {
    /// Starts the thread. `name` is what messages call the output.
    ///
    /// # Errors
    /// When no thread can be started.
    pub(super) fn start(name: &'static str, to: File) -> io::Result<Self> {
        let shared: Arc<(Mutex<State>, Condvar)> = Arc::default();
        let sink = Self { name, shared };
        let writing = sink.clone();
        small_thread(name).spawn(move || writing.run(to))?;
        Ok(sink)
    }

    /// What messages call the output.
    pub(super) fn name(&self) -> &'static str {
        self.name
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.shared.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a line, with its line feed; never waits. Where there is no room it is lost and counted.
    pub(super) fn push(&self, line: String) {
        let mut state = self.lock();
        if state.bytes + line.len() > MAX_WAITING {
            state.lost += 1;
            return;
        }
        state.bytes += line.len();
        state.lines.push_back(line);
        drop(state);
        self.shared.1.notify_all();
    }

    /// How many lines were lost and how writing went, since this was last called.
    pub(super) fn take_reports(&self) -> (u64, Vec<WriteOutcome>) {
        let mut state = self.lock();
        (std::mem::take(&mut state.lost), std::mem::take(&mut state.outcomes))
    }

    /// Has the thread end when all lines are written, and waits for that at most until `deadline`;
    /// gives whether all are written.
    pub(super) fn finish(&self, deadline: Instant) -> bool {
        let mut state = self.lock();
        state.closing = true;
        self.shared.1.notify_all();
        while !state.finished {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            let waited = self.shared.1.wait_timeout(state, left);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        state.lines.is_empty()
    }

    fn run(&self, to: File) {
        let mut writer = PatientWriter::new(to);
        loop {
            let mut state = self.lock();
            // Lines are taken out of the queue only when all earlier ones are written: what waits in the
            // writer is then never more than the queue holds.
            while state.lines.is_empty() && writer.is_empty() && !state.closing {
                state = self.shared.1.wait(state).unwrap_or_else(PoisonError::into_inner);
            }
            if writer.is_empty() {
                for line in state.lines.drain(..) {
                    writer.buffer().extend_from_slice(line.as_bytes());
                }
                state.bytes = 0;
                if writer.is_empty() && state.closing {
                    state.finished = true;
                    self.shared.1.notify_all();
                    return;
                }
            }
            drop(state);
            let outcome = writer.write(Instant::now());
            match &outcome {
                WriteOutcome::Done => continue,
                WriteOutcome::Waiting => thread::sleep(RETRY),
                WriteOutcome::Closed | WriteOutcome::Failed(..) | WriteOutcome::Recovered => {}
            }
            let mut state = self.lock();
            let is_news = outcome != WriteOutcome::Waiting && !state.outcomes.contains(&outcome);
            if is_news {
                state.outcomes.push(outcome);
            }
            if writer.is_closed() {
                state.lost += state.lines.len() as u64;
                state.lines.clear();
                state.bytes = 0;
            }
        }
    }
}
