//! The records of tests that failed: each is run once more, with the flight recorder.

use std::cell::RefCell;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::Parser;
use plcc_files::why_not_written;
use plcc_host::session::replay::RunSettings;
use plcc_plctest::report::Ran;
use plcc_plctest::{Station, run_test};
use plcc_record::{
    Appending, Keep, RecordFile, RecordedProgram, Recorder, ReplaceableExecutive, RunHeader,
};
use plcc_replay::Debugger;
use plcc_runtime::{Executive, Stop};
use plcc_why::{Question, explain};

use super::Job;
use super::program::TestProgram;
use crate::args::{Cli, Command, TestArgs};
use crate::debug_session::attach;
use crate::failure::Failure;
use crate::input::machine_text;
use crate::recorded::recorded_sources;
use crate::report::Report;

/// The most failed tests that are explained.
const MAX_EXPLAINED: usize = 20;
/// The most failed tests that are recorded.
const MAX_RECORDS: usize = 100;

/// Records the tests that failed, and notes where.
///
/// # Errors
/// When the folder or a record can't be written.
pub(super) fn record_failures(
    all: &mut [Ran],
    jobs: &[Job<'_>],
    programs: &[TestProgram],
    args: &TestArgs,
    report: &Report,
) -> Result<(), Failure> {
    let failed: Vec<usize> = (0..all.len())
        .filter(|&at| all.get(at).is_some_and(|ran| ran.outcome.failure.is_some()))
        .collect();
    if failed.is_empty() {
        return Ok(());
    }
    let folder = folder(args.records.as_deref())?;
    for (number, &at) in (1..).zip(failed.iter().take(MAX_RECORDS)) {
        let (Some(ran), Some(job)) = (all.get_mut(at), jobs.get(at)) else { continue };
        let Some(program) = programs.get(job.script.program) else { continue };
        let stem = Path::new(&ran.script).file_stem().unwrap_or_default().to_string_lossy();
        let path = folder.join(format!("{number}-{stem}-{}.plcrec", ran.line));
        let station = RecordingStation { program, path: path.clone(), trouble: RefCell::new(None) };
        let mut engine = program.engine().map_err(Failure::usage)?;
        run_test(&job.script.plan, job.test, &station, engine.as_mut());
        if let Some(why) = station.trouble.into_inner() {
            return Err(Failure::file(&path, why));
        }
        if number <= MAX_EXPLAINED {
            ran.why = ran.outcome.failure.as_ref().and_then(|failure| why(&path, failure));
        }
        ran.record = Some(path.to_string_lossy().into_owned());
    }
    if failed.len() > MAX_RECORDS {
        report.note(&format!("only the first {MAX_RECORDS} tests that failed are recorded"));
    }
    Ok(())
}

/// Why a variable of the condition that failed has its value, as `plcc why` says it: the first one that is 0, or else the
/// first. `None` where nothing can be said of it.
fn why(record: &Path, failure: &plcc_plctest::Failure) -> Option<String> {
    let zero = failure.values.iter().find(|(_, value)| value == "0");
    let (name, _) = zero.or(failure.values.first())?;
    let tick = failure.tick?;
    let parsed = Cli::try_parse_from(["plcc", "run", "-"]).ok()?;
    let Command::Run(command) = parsed.command else { return None };
    let mut debugger = Debugger::new(attach(&command, record, false).ok()?);
    debugger.go_to_tick(tick).ok()?;
    let (program, history) = debugger.program_and_history();
    let explanation = explain(program, history, &Question::new(name, tick)).ok()?;
    Some(explanation.to_string().trim_end().to_owned())
}

/// The folder for the records, which is made where it does not exist.
fn folder(named: Option<&Path>) -> Result<PathBuf, Failure> {
    match named {
        Some(path) => {
            let made = fs::create_dir_all(path);
            made.map_err(|error| Failure::file(path, why_not_written(&error)))?;
            Ok(path.to_owned())
        }
        None => {
            let made = tempfile::Builder::new().prefix("plcc-test-").tempdir();
            let made = made.map_err(|error| {
                Failure::usage(format!(
                    "no temporary folder can be made: {}",
                    why_not_written(&error)
                ))
            })?;
            Ok(made.keep())
        }
    }
}

/// Makes controls that are recorded. After a power cycle the record begins anew, so that it ends with the tick in which the
/// test failed.
struct RecordingStation<'p> {
    program: &'p TestProgram,
    path: PathBuf,
    /// Why the record can't be written.
    trouble: RefCell<Option<String>>,
}

impl RecordingStation<'_> {
    fn recorded(&self, executive: Box<dyn Executive + Send>) -> Result<Box<dyn Executive>, String> {
        let TestProgram { checked, sources, settings, named_files, run, .. } = self.program;
        let machine = settings.machine.as_deref().map(machine_text).transpose();
        let machine = machine.map_err(|failure| failure.text("plcc test"))?;
        let recorded =
            recorded_sources(checked.dialect(), sources, *named_files, &settings.options, machine);
        let began = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let settings = RunSettings::of(run, settings.machine_file()).to_bytes();
        let header = RunHeader::new(began, executive.tick_ns(), false, settings);
        let program = RecordedProgram::Sources(recorded);
        let file = RecordFile::create(&self.path, Keep::default(), Appending::No, header, program);
        let file = file.map_err(|error| self.not_written(why_not_written(&error)))?;
        let mut replaceable = ReplaceableExecutive::new(executive);
        let recorder = Recorder::to_file(file, &replaceable);
        replaceable.record(recorder);
        Ok(Box::new(replaceable))
    }

    fn not_written(&self, why: String) -> String {
        self.trouble.borrow_mut().get_or_insert(why.clone());
        why
    }
}

impl Station for RecordingStation<'_> {
    fn executive(&self) -> Result<Box<dyn Executive>, String> {
        self.recorded(self.program.made()?)
    }

    fn executive_again(&self, retained: Option<&[u8]>) -> Result<Box<dyn Executive>, String> {
        let mut executive = self.program.made()?;
        if let Some(retained) = retained {
            executive.restore(retained)?;
        }
        self.recorded(executive)
    }

    fn over(&self, executive: &mut dyn Executive, stop: Option<&Stop>) {
        let replaceable = executive.as_any_mut().downcast_mut::<ReplaceableExecutive>();
        if let Some(Err(error)) = replaceable.map(|executive| executive.end_record(stop)) {
            self.not_written(why_not_written(&error));
        }
    }
}
