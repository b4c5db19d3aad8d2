//! Where trace, events and dump of a run go. In simulated time the thread that runs the ticks writes
//! them, so that nothing is lost and a failure ends the run. In real time other threads write them;
//! the journal reports a failure, which has no other effect.

use std::io::{self, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use plcc_files::{BackgroundWriter, Next, UNTIL_WOKEN, Unfinished};

use super::SessionError;
use super::output::{Output, write_whole};
use crate::args::RunArgs;
use crate::journal::{EntryKind, Journal};
use crate::output_file::open;
use crate::run::{ReportQueues, TraceFormat};
use plcc_control::Watch;
use plcc_runtime::Executive;
use plcc_runtime::small_thread::small_thread;

/// How long the end of a run in real time waits for the dump to be written.
const DUMP_WAIT: Duration = Duration::from_secs(2);

/// The outputs that grow during a run.
#[derive(Debug, Default)]
pub(super) struct Reports {
    trace: Option<Output>,
    events: Option<Output>,
    queues: Option<ReportQueues>,
    pub(super) format: TraceFormat,
}

impl Reports {
    /// Opens them as the options say, and in real time starts the threads that write them.
    ///
    /// # Errors
    /// When one can't be opened.
    pub(super) fn open(
        args: &RunArgs,
        watch: &Watch,
        executive: &dyn Executive,
        journal: &Journal,
    ) -> Result<Self, SessionError> {
        let trace = args.trace_path();
        let format = trace.map_or_else(TraceFormat::default, |it| TraceFormat::of(it, args.time));
        if !args.realtime {
            let trace = trace.map(Output::create).transpose()?;
            let events = args.events.as_deref().map(Output::create).transpose()?;
            return Ok(Self { trace, events, queues: None, format });
        }
        let no_thread = |error| SessionError(format!("no thread can be started: {error}"));
        let mut queues = ReportQueues::new();
        if let Some(path) = trace {
            let file = open(path, false, true)?;
            let started = queues.write_trace(file, watch, format, executive, journal);
            started.map_err(no_thread)?;
        }
        if let Some(path) = &args.events {
            let file = open(path, false, true)?;
            let started = queues.write_events(file, watch, executive.names(), journal);
            started.map_err(no_thread)?;
        }
        Ok(Self { queues: Some(queues), format, ..Self::default() })
    }

    /// What a run in simulated time writes the trace to, what it writes the events to, and the queues of
    /// a run in real time.
    pub(super) fn parts(
        &mut self,
    ) -> (Option<&mut dyn Write>, Option<&mut dyn Write>, Option<&mut ReportQueues>) {
        let trace = self.trace.as_mut().map(|out| out as &mut dyn Write);
        let events = self.events.as_mut().map(|out| out as &mut dyn Write);
        (trace, events, self.queues.as_mut())
    }

    /// Writes what still waits. In real time that may take a second at most.
    pub(super) fn finish(self) {
        if let Some(queues) = self.queues {
            queues.finish();
        }
    }
}

/// Writes the dump's text.
///
/// # Errors
/// In simulated time, when it can't be written. In real time the journal reports that instead.
pub(super) fn write_dump(
    path: &Path,
    text: Vec<u8>,
    realtime: bool,
    journal: &Journal,
) -> Result<(), SessionError> {
    let failed = |error: io::Error| format!("the dump can't be written: {error}");
    if !realtime {
        return match write_whole(path, &text) {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                Err(SessionError(failed(error)))
            }
            _ => Ok(()),
        };
    }
    let (path, mut text) = (path.to_owned(), Some(text));
    let write = move |_| match text.take().map(|text| write_whole(&path, &text)) {
        None | Some(Ok(())) => Next::Idle(UNTIL_WOKEN),
        Some(Err(error)) => Next::Failed(failed(error)),
    };
    match BackgroundWriter::start(small_thread("dump"), write) {
        Err(error) => journal.error(failed(error)),
        Ok(writer) => match writer.finish(Instant::now() + DUMP_WAIT) {
            Ok(()) => {}
            Err(Unfinished::Failed(why)) => journal.error(why),
            Err(Unfinished::Stuck) => journal.write(EntryKind::OutputStuck { output: "dump" }),
        },
    }
    Ok(())
}
