//! What `plcc replay`, `plcc convert` and `plcc debug` do with a record before they replay it: they choose
//! one of its runs, find the program of that run, and say what of the record is missing.

use std::path::{Path, PathBuf};

use plcc_files::FileIdentity;
use plcc_host::session::replay::recorded_executive;
use plcc_load::Artifact;
use plcc_record::{RecordedProgram, RecordedRun, Recording, Replayed, Replayer};
use plcc_runtime::Executive;

use crate::args::{EngineArg, SourceArgs};
use crate::failure::Failure;
use crate::input::{Input, SourceSettings};
use crate::output;
use crate::recorded::{Found, ReplayEngine};
use crate::report::{Report, count_of};

/// A run of a record, chosen by its number; without a number the last one of which a tick is kept. The report says so if
/// that is not the last one.
///
/// # Errors
/// When there is no such run, or not a single tick of it is whole.
pub(crate) fn chosen_run<'r>(
    recording: &'r Recording,
    number: Option<usize>,
    path: &Path,
    report: &Report,
) -> Result<&'r RecordedRun, Failure> {
    let runs = recording.runs();
    // A control that is killed within a second of its start leaves a run without ticks.
    let with_ticks = || runs.iter().rposition(RecordedRun::has_ticks).map(|index| index + 1);
    let asked = number;
    let number = asked.or_else(with_ticks).unwrap_or(runs.len());
    let index = number.checked_sub(1);
    let run = index.and_then(|index| runs.get(index)).ok_or_else(|| {
        Failure::file(
            path,
            format!("it has {}; they are counted from 1", count_of(runs.len(), "run")),
        )
    })?;
    if !run.has_ticks() {
        let what = match (with_ticks(), run.spans.is_empty()) {
            (Some(other), _) => {
                format!("run {number} has no whole tick; run {other} is the last one that has any")
            }
            (None, true) => {
                "nothing of this run can be replayed: it has no whole checkpoint".to_owned()
            }
            (None, false) => "the record has no whole tick".to_owned(),
        };
        return Err(Failure::file(path, what));
    }
    if asked.is_none() && number < runs.len() {
        report.warn(&format!(
            "this is run {number} of {}: no whole tick is kept of what came after it",
            runs.len()
        ));
    }
    Ok(run)
}

/// Warns of what is missing in a run of a record, as far as that is known before it is replayed.
pub(crate) fn tell_damage(recording: &Recording, run: &RecordedRun, report: &Report) {
    let damaged = recording.damaged_bytes();
    if damaged > 0 {
        report.warn(&format!("{damaged} bytes of the record are damaged or cut off"));
    }
    for gap in &run.gaps {
        let why = if gap.lost { "were lost by the recorder" } else { "are damaged" };
        report.warn(&format!("ticks before {} {why}", gap.before));
    }
    if let Some(last) =
        run.spans.last().filter(|last| !run.generations().contains(&last.generation))
    {
        report.warn(&format!(
            "no tick after the last online change, before tick {}, is in the record",
            last.first
        ));
    }
}

/// Warns of ticks that are missing before a replayed one and of which [`tell_damage`] does not know:
/// those that came while the record's file could not be written.
pub(crate) fn tell_unwritten(run: &RecordedRun, replayed: &Replayed, report: &Report) {
    let is_known = run.gaps.iter().any(|gap| gap.before == replayed.tick);
    if replayed.after_gap && !is_known {
        report.warn(&format!("ticks before {} could not be written", replayed.tick));
    }
}

/// Refuses outputs that would overwrite the record, or the program that is named in the place of the
/// recorded one.
///
/// # Errors
/// The first such output.
pub(crate) fn check_outputs<'p>(
    record: &Path,
    files: &[PathBuf],
    outputs: impl IntoIterator<Item = &'p Path>,
) -> Result<(), Failure> {
    let mut older = record.as_os_str().to_owned();
    older.push(".1");
    let older = PathBuf::from(older);
    let read = [record, older.as_path()].into_iter().chain(files.iter().map(PathBuf::as_path));
    let read: Vec<FileIdentity> = read.map(FileIdentity::of).collect();
    for output in outputs.into_iter().filter(|path| !output::is_stdout(path)) {
        let output_file = FileIdentity::of(output);
        if read.iter().any(|file| file.is_same(&output_file)) {
            let what =
                "it is read for this and is not overwritten; name another file for the output";
            return Err(Failure::file(output, what));
        }
    }
    Ok(())
}

/// The program of a run: the one on the disk, where files are named, else the one in the record.
///
/// # Errors
/// When there is none, it has errors, or is another one than the recorded one.
pub(crate) fn program(
    record: &Path,
    recorded: &RecordedProgram,
    files: &[PathBuf],
    source: &SourceArgs,
    report: &Report,
) -> Result<Found, Failure> {
    let Some(first) = files.first() else {
        return Found::in_record(recorded).map_err(|why| Failure::file(record, why));
    };
    let found = if let Ok((_, bytes)) = Artifact::open_with_bytes(first, None) {
        Found::in_record(&RecordedProgram::Artifact(bytes))
    } else {
        let settings = SourceSettings::for_files(source, files, report)?;
        let program = Input::read(files, source)?.check(&settings)?;
        let checked = program.checked.ok_or_else(|| {
            Failure::file(first, "the program has errors; `plcc check` shows them")
        })?;
        Found::of_checked(checked, program.sources).map_err(|error| error.to_string())
    };
    let found = found.and_then(|found| found.in_place_of(recorded));
    found.map_err(|why| Failure::file(first, why))
}

/// The engine that was asked for, or else the usual one.
pub(crate) fn engine_of(found: &Found, asked: Option<EngineArg>) -> ReplayEngine {
    match asked {
        None => found.usual_engine(),
        Some(EngineArg::Interp) => ReplayEngine::Interpreter,
        Some(EngineArg::Jit) => ReplayEngine::Jit,
        Some(EngineArg::Aot) => ReplayEngine::Aot,
    }
}

/// A replay of a run's ticks with its program of a generation, and its executive set as the run was.
///
/// # Errors
/// When the options of the run can't be used.
pub(crate) fn replayer<'r>(
    record: &Path,
    recording: &'r Recording,
    run: &'r RecordedRun,
    generation: u16,
    found: &Found,
) -> Result<Replayer<'r>, Failure> {
    let executive = fresh(record, run, found)?;
    Ok(Replayer::new(recording, run, generation, executive))
}

/// An executive of a run's program at its first power-up, set as the run was.
///
/// # Errors
/// When the options of the run can't be used.
pub(crate) fn fresh(
    record: &Path,
    run: &RecordedRun,
    found: &Found,
) -> Result<Box<dyn Executive + Send>, Failure> {
    recorded_executive(&run.header, &found.program).map_err(|error| Failure::file(record, error))
}
