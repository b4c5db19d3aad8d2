//! Lines for a file or for standard error, written by a thread of their own, so that nobody else
//! waits when the file takes none.

use std::collections::VecDeque;
use std::fs::File;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use plcc_files::{BackgroundWriter, UNTIL_WOKEN};

use crate::patient_writer::{PatientWriter, WriteOutcome, write_in_background};

/// How many bytes of lines wait at most; what comes then is lost.
const MAX_WAITING: usize = 1 << 20;

/// A queue of lines with the thread that writes them.
#[derive(Debug)]
pub(super) struct Sink {
    name: &'static str,
    state: Arc<Mutex<State>>,
    writer: BackgroundWriter,
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
    /// Whether nobody reads the output any more, so that all further lines are lost.
    closed: bool,
}

fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

impl State {
    /// Takes all lines out of the queue into a buffer.
    fn take_lines(&mut self, buffer: &mut Vec<u8>) {
        if self.closed {
            self.lost += self.lines.len() as u64;
            self.lines.clear();
        }
        for line in self.lines.drain(..) {
            buffer.extend_from_slice(line.as_bytes());
        }
        self.bytes = 0;
    }

    fn note(&mut self, outcome: WriteOutcome) {
        self.closed |= outcome == WriteOutcome::Closed;
        if !self.outcomes.contains(&outcome) {
            self.outcomes.push(outcome);
        }
    }
}

impl Sink {
    /// Starts the thread. `name` is what messages call the output.
    ///
    /// # Errors
    /// When no thread can be started.
    pub(super) fn start(name: &'static str, to: File) -> io::Result<Self> {
        let state: Arc<Mutex<State>> = Arc::default();
        let (filling, reporting) = (Arc::clone(&state), Arc::clone(&state));
        let writer = write_in_background(
            name,
            PatientWriter::new(to),
            UNTIL_WOKEN,
            move |buffer| lock(&filling).take_lines(buffer),
            move |outcome| lock(&reporting).note(outcome),
        )?;
        Ok(Self { name, state, writer })
    }

    /// What messages call the output.
    pub(super) fn name(&self) -> &'static str {
        self.name
    }

    /// Adds a line, with its line feed; never waits. Where there is no room it is lost and counted.
    pub(super) fn push(&self, line: String) {
        let mut state = lock(&self.state);
        if state.bytes + line.len() > MAX_WAITING {
            state.lost += 1;
            return;
        }
        state.bytes += line.len();
        state.lines.push_back(line);
        drop(state);
        self.writer.wake();
    }

    /// How many lines were lost and how writing went, since this was last called.
    pub(super) fn take_reports(&self) -> (u64, Vec<WriteOutcome>) {
        let mut state = lock(&self.state);
        (std::mem::take(&mut state.lost), std::mem::take(&mut state.outcomes))
    }

    /// Has the thread end when all lines are written, and waits for that at most until `deadline`;
    /// gives whether all are written.
    pub(super) fn finish(&self, deadline: Instant) -> bool {
        self.writer.finish(deadline).is_ok()
    }
}
