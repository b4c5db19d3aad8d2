//! A thread that writes one output of a run in real time.

use std::fs::File;
use std::io;
use std::time::{Duration, Instant};

use plcc_files::BackgroundWriter;

use crate::journal::{EntryKind, Journal, trouble};
use crate::patient_writer::{PatientWriter, write_in_background};

/// Time between two looks at an empty queue. The thread that fills the queue wakes nobody, since that would be a
/// system call.
const INTERVAL: Duration = Duration::from_millis(5);

/// The handle of the thread.
#[derive(Debug)]
pub(super) struct OutputThread {
    output: &'static str,
    writer: BackgroundWriter,
    journal: Journal,
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
        let mut writer = PatientWriter::new(to);
        writer.buffer().extend(header);
        let told = journal.clone();
        let report = move |outcome| {
            if let Some(kind) = trouble(output, outcome) {
                told.write(kind);
            }
        };
        let writer = write_in_background(output, writer, INTERVAL, fill, report)?;
        Ok(Self { output, writer, journal })
    }

    /// Has the thread end when everything is written, and waits for that at most until `deadline`.
    pub(super) fn finish(self, deadline: Instant) {
        if self.writer.finish(deadline).is_err() {
            self.journal.write(EntryKind::OutputStuck { output: self.output });
        }
    }
}
