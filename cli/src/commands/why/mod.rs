//! `plcc why`: why a variable has its value, for a source that is run here, a record, or a control that runs.

mod present;

use std::fs;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use clap::Parser;
use plcc_abi::printable;
use plcc_host::session;
use plcc_replay::{ControlSocket, DebugError, Debugger, Session, forced_by, not_as_given};
use plcc_why::{ChangedBy, Explanation, Line, PieceKind, Question, explain};

use super::monitor::{is_recording, own_record};
use crate::args::{Cli, Command, FormatArg, RunCommand, WhyArgs};
use crate::debug_session::{attach, launch_checked};
use crate::failure::{DONE, ERRORS, Failure};
use crate::input::{Input, SourceSettings};
use crate::output;
use crate::report::{Destination, Report};

/// How long the record of a control that runs is waited for, and how often it is read meanwhile.
const PATIENCE: Duration = Duration::from_secs(3);
const PAUSE: Duration = Duration::from_millis(200);

pub(crate) fn why(args: &WhyArgs, report: &Report) -> Result<u8, Failure> {
    let path = args.target.first().ok_or_else(|| Failure::usage("TARGET is missing"))?;
    let is_socket = fs::metadata(path).is_ok_and(|metadata| metadata.file_type().is_socket());
    let explanation = if is_socket {
        let control = ControlSocket::new(path);
        // Who names a source asks without a record.
        let own = own_record(&control).filter(|_| args.target.len() == 1);
        let recorded = match (&args.record, own) {
            (Some(record), _) => Some(of_live_record(args, record, &control, report)?),
            // Of a record that can't explain it, since it holds no sources for example, the present values remain.
            (None, own) => own.and_then(|own| of_live_record(args, &own, &control, report).ok()),
        };
        let mut explanation = match recorded {
            Some(recorded) => recorded,
            None => {
                let Some(found) = present::explanation(args, &control, report)? else {
                    return Ok(ERRORS);
                };
                found
            }
        };
        // Forces of the past may have been another one's; a control without an answer has none at present.
        if args.tick.is_none()
            && let Ok(status) = control.status()
        {
            explanation.note_forces(&|name| forced_by(&status, name));
            // The answer tells a force on what is asked for by itself, where the program reads it.
            let is_told = matches!(explanation.changed_by, ChangedBy::Force { .. });
            if let Some(note) = not_as_given(&status, &explanation.name).filter(|_| !is_told) {
                report.note(&note);
            }
        }
        explanation
    } else if path.as_os_str() != "-" && is_recording(path)? {
        of_record(args, path, false)?
    } else {
        let Some(explanation) = of_source(args, report)? else { return Ok(ERRORS) };
        explanation
    };
    show(&explanation, args.source.message_format, report)?;
    Ok(DONE)
}

/// The answer for a control that runs, by a file of its program.
pub(super) fn of_control(
    control: &ControlSocket,
    program: &Path,
    name: &str,
) -> Result<Explanation, Failure> {
    let words = ["plcc", "why", "--"].map(AsRef::<Path>::as_ref).into_iter();
    let words = words.chain([control.path(), program, name.as_ref()]);
    let Ok(Cli { command: Command::Why(args), .. }) = Cli::try_parse_from(words) else {
        return Err(Failure::internal("`plcc why` is not understood"));
    };
    let report = Report::new(clap::ColorChoice::Never);
    let found = present::explanation(&args, control, &report)?;
    found.ok_or_else(|| Failure::usage("the program has errors"))
}

/// Prints an answer.
fn show(explanation: &Explanation, format: FormatArg, report: &Report) -> Result<(), Failure> {
    let text = match format {
        FormatArg::Human => explanation.lines().iter().map(|line| text_of(line, report)).collect(),
        FormatArg::Json => {
            let json = serde_json::to_string(explanation);
            format!("{}\n", json.map_err(Failure::internal)?)
        }
    };
    output::print(text.as_bytes())
}

/// A line with its line feed, on a terminal with colours.
fn text_of(line: &Line, report: &Report) -> String {
    let pieces = line.pieces.iter().map(|piece| {
        let text = printable(&piece.text);
        match piece.kind {
            PieceKind::Plain => text.into_owned(),
            PieceKind::Name => report.paint_result(&text, "1"),
            PieceKind::Value => report.paint_result(&text, "1;36"),
            PieceKind::Forced => report.paint_result(&text, "1;31"),
            PieceKind::Place => report.paint_result(&text, "2"),
            PieceKind::Wish => report.paint_result(&text, "32"),
        }
    });
    pieces.chain(["\n".to_owned()]).collect()
}

/// The answer for a source, which is run from power-up; `None` if it has errors, which are shown.
fn of_source(args: &WhyArgs, report: &Report) -> Result<Option<Explanation>, Failure> {
    if args.record.is_some() {
        return Err(Failure::usage("--record names the record of a control: name its socket too"));
    }
    let settings = SourceSettings::for_files(&args.source, &args.target, report)?;
    let program = Input::read(&args.target, &args.source)?.check(&settings)?;
    let to = Destination::from(args.source.message_format);
    let Some((checked, sources)) = program.without_errors(to, report)? else { return Ok(None) };
    let command = run_command(args)?;
    let session = launch_checked(&command, checked, sources, &settings)?;
    let last = match (args.tick, command.run.ticks, &args.stimulus) {
        (Some(tick), _, _) => tick,
        (None, Some(ticks), _) => ticks.saturating_sub(1),
        (None, None, Some(path)) => {
            let stimulus = session::stimulus(path, &*session.view.names(), session.view.tick_ns());
            let stimulus = stimulus.map_err(|error| Failure::usage(error.to_string()))?;
            stimulus.period().saturating_sub(1)
        }
        (None, None, None) => 0,
    };
    let mut debugger = Debugger::new(session);
    let tick = run_to(&mut debugger, last, args.tick.is_some()).map_err(refused)?;
    answer(&mut debugger, args, tick).map(Some)
}

/// Runs up to a tick, and gives it: the tick in which the program is stopped, if that comes before and need not be the one
/// that is asked for.
fn run_to(debugger: &mut Debugger<'_>, last: u64, is_asked: bool) -> Result<u64, DebugError> {
    let history = debugger.history_mut();
    for tick in 0..=last {
        if history.run_unobserved(tick)?.stop.is_none() {
            continue;
        }
        if is_asked && tick < last {
            return Err(DebugError(format!(
                "the program was stopped in tick {tick}, so that there is no tick {last}"
            )));
        }
        return Ok(tick);
    }
    Ok(last)
}

/// The answer for a record; `is_live` says that its control runs.
fn of_record(args: &WhyArgs, path: &Path, is_live: bool) -> Result<Explanation, Failure> {
    of_session(args, attach(&run_command(args)?, path, is_live)?)
}

/// The answer for a control that runs, by its record. That ends about a second before the present, so the tick of the present
/// is waited for.
fn of_live_record(
    args: &WhyArgs,
    path: &Path,
    control: &ControlSocket,
    report: &Report,
) -> Result<Explanation, Failure> {
    let done = control.status().ok().map(|status| status.ticks);
    let asked = args.tick.map(|tick| tick.saturating_add(1));
    let wanted = done.map_or(0, |done| asked.map_or(done, |asked| asked.min(done)));
    let start = Instant::now();
    loop {
        let session = attach(&run_command(args)?, path, true)?;
        let known = session.history.known();
        if known < wanted && start.elapsed() < PATIENCE {
            thread::sleep(PAUSE);
            continue;
        }
        if known < wanted && asked.is_none() {
            let (last, now) = (known.saturating_sub(1), wanted - 1);
            report.note(&format!(
                "the record ends with tick {last}, and the control is at tick {now}: the answer is about tick {last}"
            ));
        }
        return of_session(args, session);
    }
}

/// The answer for what was recorded.
fn of_session(args: &WhyArgs, session: Session<'static>) -> Result<Explanation, Failure> {
    let last = session.history.known().saturating_sub(1);
    let mut debugger = Debugger::new(session);
    let tick = args.tick.unwrap_or(last);
    debugger.go_to_tick(tick).map_err(refused)?;
    answer(&mut debugger, args, tick)
}

/// The answer at a tick. Of a text it is about the last time that it was put out, unless a tick was asked for.
fn answer(debugger: &mut Debugger<'_>, args: &WhyArgs, tick: u64) -> Result<Explanation, Failure> {
    let (program, history) = debugger.program_and_history();
    let looks_back = args.tick.is_none();
    let question = Question { looks_back, ..Question::new(&*args.name, tick) };
    explain(program, history, &question).map_err(refused)
}

fn refused(error: DebugError) -> Failure {
    Failure::usage(error.0)
}

/// The command line of `plcc run` that means the same.
fn run_command(args: &WhyArgs) -> Result<RunCommand, Failure> {
    let Ok(Cli { command: Command::Run(command), .. }) = Cli::try_parse_from(["plcc", "run", "-"])
    else {
        return Err(Failure::internal("`plcc run -` is not understood"));
    };
    let mut command = *command;
    // Behind the name of a record or socket stand the sources of its program.
    let is_source = |path: &&std::path::PathBuf| !is_recording(path).unwrap_or(true);
    command.files = args.target.iter().filter(is_source).cloned().collect();
    command.source = args.source.clone();
    command.run.control = args.control.clone();
    command.run.stimulus = args.stimulus.clone();
    command.run.repeat = args.repeat;
    command.run.simulate = args.simulate;
    command.run.part_program = args.part_program.clone();
    (command.run.ticks, command.run.duration) = (args.ticks, args.duration);
    Ok(command)
}
