//! `plcc debug`: the Debug Adapter Protocol on standard input and output.

use std::cell::{Cell, OnceCell};
use std::fs;
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};

use clap::Parser;
use plcc_debugger::dap::{self, LaunchArguments, Launcher};
use plcc_debugger::{DebugError, DebuggedProgram, Launched, Recorded, Session};
use plcc_runtime::record::{Recording, Replayer};
use plcc_runtime::run::{Player, Stimulus};
use plcc_runtime::session;
use plcc_runtime::session::replay::recorded_executive;

use crate::args::{Cli, Command, RunCommand};
use crate::failure::{DONE, Failure};
use crate::input::{Input, SourceSettings};
use crate::recorded::ReplayEngine;
use crate::replay_input;
use crate::report::Report;

pub(crate) fn debug() -> Result<u8, Failure> {
    let input = BufReader::new(io::stdin());
    let sources = Sources::default();
    let served = dap::serve(input, io::stdout().lock(), &sources);
    served.map_err(|error| {
        Failure::usage(match error.kind() {
            io::ErrorKind::InvalidData => format!(
                "standard input is no stream of messages of the Debug Adapter Protocol, which an \
                 editor writes: {error}"
            ),
            _ => format!("the debugger's client is gone: {error}"),
        })
    })?;
    Ok(DONE)
}

/// Makes sessions of source files and of recordings.
#[derive(Default)]
struct Sources {
    recordings: Recordings,
}

impl Launcher for Sources {
    fn launch(&self, arguments: &LaunchArguments) -> Result<Session<'_>, String> {
        let command = run_command(arguments)?;
        let session = match arguments.recording.as_deref() {
            Some(path) => {
                let folder = arguments.cwd.as_deref().unwrap_or_default();
                attach(&command, Path::new(folder).join(path), &self.recordings)
            }
            None => launch(&command),
        };
        session.map_err(|failure| failure.text("plcc debug"))
    }
}

/// A list of all records that were opened. A record that still grows is opened again to see what was added, and
/// sessions refer to the earlier one; so all are kept until the client leaves.
#[derive(Default)]
struct Recordings {
    first: OnceCell<Box<OpenedRecording>>,
}

struct OpenedRecording {
    recording: Recording,
    next: OnceCell<Box<OpenedRecording>>,
}

impl Recordings {
    fn open(&self, path: &Path) -> Result<&Recording, DebugError> {
        let recording = Recording::open(path).map_err(|error| DebugError(error.to_string()))?;
        let mut free = &self.first;
        while let Some(opened) = free.get() {
            free = &opened.next;
        }
        let opened =
            free.get_or_init(|| Box::new(OpenedRecording { recording, next: OnceCell::new() }));
        Ok(&opened.recording)
    }
}

/// The arguments of a client as the command line of `plcc run` that means the same.
fn run_command(arguments: &LaunchArguments) -> Result<RunCommand, String> {
    let LaunchArguments { program, stimulus, machine, ticks, args, cwd, .. } = arguments;
    let folder = cwd.as_deref().map(Path::new).unwrap_or(Path::new(""));
    let path = |text: &String| folder.join(text).to_string_lossy().into_owned();
    let mut words = vec!["plcc".to_owned(), "run".to_owned()];
    words.extend(program.all().iter().map(path));
    if arguments.recording.is_some() && program.all().is_empty() {
        // The record holds the program, but the command line is only valid with the name of a file.
        words.push("-".to_owned());
    }
    for (option, value) in [("--stimulus", stimulus), ("--machine", machine)] {
        if let Some(value) = value {
            words.extend([option.to_owned(), path(value)]);
        }
    }
    if let Some(ticks) = ticks {
        words.extend(["--ticks".to_owned(), ticks.to_string()]);
    }
    words.extend(args.iter().cloned());
    match Cli::try_parse_from(words) {
        Ok(Cli { command: Command::Run(command), .. }) => Ok(*command),
        Ok(_) => Err("`args` has options of another command than `plcc run`".into()),
        Err(error) => Err(error.render().to_string().trim_end().to_owned()),
    }
}

fn report() -> Report {
    Report::new(clap::ColorChoice::Never)
}

fn launch(command: &RunCommand) -> Result<Session<'static>, Failure> {
    let settings = SourceSettings::for_files(&command.source, &command.files, &report())?;
    let program = Input::read(&command.files, &command.source)?.check(&settings.options);
    let Some(checked) = program.checked.filter(|_| {
        command.keep_going || !program.diagnostics.iter().any(plcc_diag::Diagnostic::is_error)
    }) else {
        let errors = program.diagnostics.iter().filter(|diagnostic| diagnostic.is_error());
        let lines: Vec<_> = errors.map(|error| place_and_text(&program.sources, error)).collect();
        return Err(Failure::usage(format!("the program has errors:\n{}", lines.join("\n"))));
    };
    let tables = checked.lower().map_err(Failure::from)?.program;
    let make = || {
        session::executive(&tables, &command.run.control, false, settings.machine_file())
            .map_err(|error| Failure::usage(error.to_string()))
    };
    let (mut executive, view) = (make()?, make()?);
    let stimulus = match &command.run.stimulus {
        Some(path) => session::stimulus(path, executive.as_mut())
            .map_err(|error| Failure::usage(error.to_string()))?,
        None => Stimulus::default(),
    };
    let ticks = match (command.run.ticks, command.run.duration) {
        (Some(ticks), _) => Some(ticks),
        (None, Some(time)) => {
            let ticks = time.as_nanos().div_ceil(u128::from(executive.tick_ns().max(1)));
            Some(u64::try_from(ticks).unwrap_or(u64::MAX))
        }
        (None, None) => None,
    };
    let player = Player::new(stimulus, command.run.repeat);
    let history = Launched::new(executive, checked.interpreter(), player, ticks);
    let program = DebuggedProgram::new(checked.into_program(), program.sources, tables);
    Ok(Session { program, history: Box::new(history), view, may_change: true })
}

/// A session of the run that was recorded last, with the program of its last online change.
fn attach<'r>(
    command: &RunCommand,
    path: PathBuf,
    recordings: &'r Recordings,
) -> Result<Session<'r>, Failure> {
    let usage = |error: DebugError| Failure::usage(error.0);
    let recording = recordings.open(&path).map_err(usage)?;
    let number = recording.runs().len();
    let run = replay_input::chosen_run(recording, Some(number), &path)?;
    let generation = run.spans.last().map_or(0, |span| span.generation);
    let recorded = run.program_of(generation);
    let recorded = recorded.ok_or_else(|| Failure::file(&path, "its program is missing"))?;
    let files: Vec<PathBuf> =
        command.files.iter().filter(|path| path.as_os_str() != "-").cloned().collect();
    let found = replay_input::program(&path, recorded, &files, &command.source, &report())?;
    let engine = found.engine(found.usual_engine());
    let engine = engine.or_else(|_| found.engine(ReplayEngine::Interpreter));
    let engine = engine.map_err(|error| Failure::file(&path, error))?;
    let executive = |tables: &plcc_abi::Program| {
        recorded_executive(&run.header, tables).map_err(|error| Failure::file(&path, error))
    };
    let view = executive(&found.program)?;
    let Some(checked) = found.checked else {
        return Err(Failure::file(
            &path,
            "the record holds an artifact, which has no statements; name the program's source",
        ));
    };
    let tables = found.program;
    let again = (path.clone(), tables.clone());
    let length_before = Cell::new(None);
    let reopen = move || {
        let (path, tables) = &again;
        let length = fs::metadata(path).map(|metadata| metadata.len()).ok();
        if length.is_some() && length_before.replace(length) == length {
            return Ok(None);
        }
        let recording = recordings.open(path)?;
        let run = recording.runs().get(number.saturating_sub(1));
        let run = run.ok_or_else(|| DebugError::new("the recording has become another one"))?;
        let executive = recorded_executive(&run.header, tables);
        let executive = executive.map_err(|error| DebugError(error.to_string()))?;
        Ok(Some(Replayer::new(recording, run, generation, executive)))
    };
    let history = Recorded::new(engine, Box::new(reopen)).map_err(usage)?;
    let program = DebuggedProgram::new(checked.into_program(), found.sources, tables);
    Ok(Session { program, history: Box::new(history), view, may_change: false })
}

/// A diagnostic in one line of text: file, line, column, code and message.
fn place_and_text(sources: &plcc_diag::SourceMap, error: &plcc_diag::Diagnostic) -> String {
    let (line, column) = sources.line_col(error.span.file, error.span.start);
    let path = PathBuf::from(sources.path(error.span.file));
    format!("{}:{line}:{column}: {}: {}", path.display(), error.code, error.message)
}
