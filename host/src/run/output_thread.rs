//! A thread that writes one output of a run in real time.

use std::fs::File;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::journal::{EntryKind, Journal};
use crate::patient_writer::{PatientWriter, WriteOutcome};
use plcc_runtime::small_thread::small_thread;

/// Time between two looks at an empty queue, and between two attempts to write. The thread that fills the
/// queue wakes nobody, since that would be a system call.
const INTERVAL: Duration = Duration::from_millis(5);

/// The handle of the thread.
#[derive(Debug)]
pub(super) struct OutputThread {
    output: &'static str,
    shared: Arc<Shared>,
    journal: Journal,
}

#[derive(Debug, Default)]
struct Shared {
    closing: AtomicBool,
    finished: Mutex<bool>,
    changed: Condvar,
}

impl OutputThread {
    /// Starts the thread. It writes `header` and then, again and again, what `fill` appends to an empty
    /// buffer; `fill` appends nothing where its queue is empty. `output` is what the journal calls the
    /// output.
    ///
    /// # Errors
    /// When no thread can be started.
    pub(super) fn start(
        output: &'static str,
        to: File,
        header: Vec<u8>,
        journal: Journal,
        fill: impl FnMut(&mut Vec<u8>) + Send + 'static,
    ) -> io::Result<Self> {
        let shared: Arc<Shared> = Arc::default();
        let handle = Self { output, shared: Arc::clone(&shared), journal: journal.clone() };
        let run = move || {
            run(output, to, header, &journal, fill, &shared.closing);
            *shared.finished.lock().unwrap_or_else(PoisonError::into_inner) = true;
            shared.changed.notify_all();
        };
        small_thread(output).spawn(run)?;
        Ok(handle)
    }

    /// Has the thread end when everything is written, and waits for that at most until `deadline`.
    pub(super) fn finish(self, deadline: Instant) {
        self.shared.closing.store(true, Ordering::Release);
        let mut finished = self.shared.finished.lock().unwrap_or_else(PoisonError::into_inner);
        while !*finished {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                self.journal.write(EntryKind::OutputStuck { output: self.output });
                return;
            }
            let waited = self.shared.changed.wait_timeout(finished, left);
            finished = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

fn run(
    output: &'static str,
    to: File,
    header: Vec<u8>,
    journal: &Journal,
    mut fill: impl FnMut(&mut Vec<u8>),
    closing: &AtomicBool,
) {
    let mut writer = PatientWriter::new(to);
    writer.buffer().extend(header);
    loop {
        // Looked at before the queue, so that nothing is missed that was put there before the end.
        let last = closing.load(Ordering::Acquire);
        if writer.is_empty() {
            fill(writer.buffer());
            if writer.is_empty() {
                if last {
                    return;
                }
                thread::sleep(INTERVAL);
                continue;
            }
        }
        let was_closed = writer.is_closed();
        match writer.write(Instant::now()) {
            WriteOutcome::Done => {}
            WriteOutcome::Waiting => thread::sleep(INTERVAL),
            WriteOutcome::Recovered => journal.write(EntryKind::OutputRecovered { output }),
            WriteOutcome::Failed(_, error) => {
                journal.write(EntryKind::OutputFailed { output, error })
            }
            WriteOutcome::Closed if was_closed => {}
            WriteOutcome::Closed => journal.write(EntryKind::OutputClosed { output }),
        }
    }
}
