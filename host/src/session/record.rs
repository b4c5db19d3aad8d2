//! The record of a run (`--record`). In simulated time the thread that runs the ticks writes it, so that
//! nothing is lost, and a failure is an error of the run. In real time another thread writes it.

use std::io;
use std::time::SystemTime;

use plcc_abi::machine::Machine;

use super::SessionError;
use super::predecessor::Predecessor;
use super::replay::RunSettings;
use crate::args::RunArgs;
use crate::journal::{EntryKind, Journal};
use crate::run::{AfterTick, End, Hook};
use plcc_files::why_not_written;
use plcc_record::ReplaceableExecutive;
use plcc_record::{
    Appending, RecordFile, RecordReport, RecordThread, RecordedProgram, RecordedPrograms, Recorder,
    RunHeader,
};
use plcc_runtime::Executive;
use plcc_runtime::watchdog::WatchdogLimit;

/// The record of a run, if it has one.
#[derive(Default)]
pub(super) struct Record {
    thread: Option<RecordThread>,
}

impl Record {
    /// Begins the record that the options ask for.
    ///
    /// # Errors
    /// When the file can't be written. In real time that is only told, since a control must not stand
    /// still because of its record.
    pub(super) fn start(
        args: &RunArgs,
        machine: Option<&Machine>,
        executive: &mut ReplaceableExecutive,
        predecessor: &Predecessor<'_>,
        journal: &Journal,
    ) -> Result<Self, SessionError> {
        let Some(path) = args.record.as_deref().filter(|_| !args.no_record) else {
            return Ok(Self::default());
        };
        let began = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let timed_out = matches!(args.watchdog, Some(WatchdogLimit::Time(_)));
        let header = RunHeader::new(
            began,
            executive.tick_ns(),
            args.realtime || timed_out,
            RunSettings::of(args, machine).to_bytes(),
        );
        let program = args.program.as_deref().cloned().unwrap_or(RecordedProgram::Unknown);
        // A file that is there may tell how the control ended that ran before this one.
        let appending = if args.realtime { Appending::Yes } else { Appending::No };
        let keep = args.keep.unwrap_or_default();
        let create = || RecordFile::create(path, keep, appending, header.clone(), program.clone());
        let is_held = |error: &io::Error| error.kind() == io::ErrorKind::ResourceBusy;
        let file = predecessor.wait(&format!("the record {}", path.display()), create, is_held);
        let not_written = |error| {
            format!("the record {} can't be written: {}", path.display(), why_not_written(&error))
        };
        if !args.realtime {
            let file = file.map_err(|error| SessionError(not_written(error)))?;
            executive.record(Recorder::to_file(file, executive));
            return Ok(Self::default());
        }
        match file.and_then(|file| RecordThread::start(file, executive, told(journal.clone()))) {
            Ok((recorder, thread)) => {
                executive.record(recorder);
                Ok(Self { thread: Some(thread) })
            }
            Err(error) => {
                journal.error(format!("{}; the run is not recorded", not_written(error)));
                Ok(Self::default())
            }
        }
    }

    /// Where the programs of online changes are told.
    pub(super) fn programs(&self) -> Option<RecordedPrograms> {
        self.thread.as_ref().map(RecordThread::programs)
    }

    /// Ends the record. In real time that may take two seconds at most.
    ///
    /// # Errors
    /// When it could not be written, in simulated time.
    pub(super) fn finish(
        self,
        executive: &mut ReplaceableExecutive,
        end: &End,
        journal: &Journal,
    ) -> Result<(), SessionError> {
        let ended = executive.end_record(end.stop.as_ref());
        if let Some(thread) = self.thread
            && let Err(why) = thread.finish()
        {
            journal.error(why);
        }
        ended.map_err(|error| {
            SessionError(format!("the record can't be written: {}", why_not_written(&error)))
        })
    }
}

/// Has the record take its checkpoints in the idle time between two ticks.
#[derive(Debug)]
pub(super) struct IdleCheckpoints;

impl Hook for IdleCheckpoints {
    fn after_tick(&mut self, now: &mut AfterTick<'_>) {
        if recorded(now).is_some_and(|executive| executive.waits_for_idle_time()) {
            let idle = now.idle_time();
            if let Some(executive) = recorded(now) {
                executive.checkpoint_in_idle_time(idle);
            }
        }
    }
}

/// The executive whose run is recorded.
fn recorded<'a>(now: &'a mut AfterTick<'_>) -> Option<&'a mut ReplaceableExecutive> {
    now.executive.as_any_mut().downcast_mut()
}

/// Has a journal told of what happens to a record.
fn told(journal: Journal) -> impl FnMut(RecordReport) + Send {
    move |report| match report {
        RecordReport::Lost(count) => journal.write(EntryKind::Lost { output: "record", count }),
        RecordReport::Failing(text) => journal.warn(text),
        RecordReport::WrittenAgain(text) => journal.note(text),
    }
}
