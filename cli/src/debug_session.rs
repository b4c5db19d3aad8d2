//! What `plcc debug` and `plcc monitor` begin with: a program that is run here, or a recording.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use clap::Parser;
use plcc_dap::LaunchArguments;
use plcc_diag::SourceMap;
use plcc_host::args::RunArgs;
use plcc_host::run::{Player, Stimulus};
use plcc_host::session;
use plcc_host::session::replay::recorded_executive;
use plcc_record::{RecordedRun, Recording};
use plcc_replay::{DebugError, DebuggedProgram, Launched, Recorded, Session};

use crate::args::{Cli, Command, RunCommand, SourceArgs};
use crate::compile::Checked;
use crate::failure::Failure;
use crate::input::{Input, SourceSettings};
use crate::recorded::{Found, ReplayEngine};
use crate::replay_input;
use crate::report::Report;

/// The arguments of a client as the command line of `plcc run` that means the same.
pub(crate) fn run_command(arguments: &LaunchArguments) -> Result<RunCommand, String> {
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

/// A report without colours, since an editor or the monitor may show what it says.
fn report() -> Report {
    Report::new(clap::ColorChoice::Never)
}

/// A session of a program that is run in simulated time.
pub(crate) fn launch(command: &RunCommand) -> Result<Session<'static>, Failure> {
    let mut settings = SourceSettings::for_files(&command.source, &command.files, &report())?;
    settings.options.simulate = command.run.simulate;
    let program = Input::read(&command.files, &command.source)?.check(&settings)?;
    let Some(checked) = program.checked.filter(|_| {
        command.keep_going || !program.diagnostics.iter().any(plcc_diag::Diagnostic::is_error)
    }) else {
        let errors = program.diagnostics.iter().filter(|diagnostic| diagnostic.is_error());
        let lines: Vec<_> = errors.map(|error| place_and_text(&program.sources, error)).collect();
        return Err(Failure::usage(format!("the program has errors:\n{}", lines.join("\n"))));
    };
    launch_checked(command, checked, program.sources, &settings)
}

/// A session of a checked program that is run in simulated time. `settings` are those with which it was checked.
pub(crate) fn launch_checked(
    command: &RunCommand,
    checked: Checked,
    sources: SourceMap,
    settings: &SourceSettings,
) -> Result<Session<'static>, Failure> {
    let tables = checked.lower().map_err(Failure::from)?.program;
    let run = RunArgs { machine_path: settings.machine.clone(), ..command.run.clone() };
    let make = || {
        session::simulated_executive(&tables, &run, settings.machine_file())
            .map_err(|error| Failure::usage(error.to_string()))
    };
    let (executive, view) = (make()?, make()?);
    let stimulus = match &command.run.stimulus {
        Some(path) => session::stimulus(path, &*executive.names(), executive.tick_ns())
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
    let program = DebuggedProgram::new(checked.into_program(), sources, tables);
    Ok(Session::offline(program, Box::new(history), view, true))
}

/// A session of the run that was recorded last, at first with the program of its last online change. It opens the programs
/// before that when the user comes to their ticks. `is_live` says that the control is known to run: then it is the
/// last run even if no tick of it is in the record yet.
pub(crate) fn attach(
    command: &RunCommand,
    path: &Path,
    is_live: bool,
) -> Result<Session<'static>, Failure> {
    let recording = Recording::open(path).map_err(|error| Failure::usage(error.to_string()))?;
    let live = recording.last_run().filter(|run| is_live && !run.spans.is_empty());
    let run = match live {
        Some(run) => run,
        None => {
            let run = replay_input::chosen_run(&recording, None, path, &report())?;
            replay_input::tell_damage(&recording, run, &report());
            run
        }
    };
    let newest = run.generations().last().copied();
    let generation = newest.or_else(|| run.spans.last().map(|span| span.generation)).unwrap_or(0);
    let files: Vec<PathBuf> =
        command.files.iter().filter(|path| path.as_os_str() != "-").cloned().collect();
    let record = Rc::new(AttachedRecord {
        path: path.to_owned(),
        run: run.header.run,
        newest: generation,
        files,
        source: command.source.clone(),
    });
    record.session(recording, generation)
}

/// A recorded run whose versions of the program are opened one after the other.
struct AttachedRecord {
    path: PathBuf,
    /// What the run's header calls it.
    run: u64,
    /// The version that was the newest one when the record was opened.
    newest: u16,
    /// The sources that the user has named, for a record without them.
    files: Vec<PathBuf>,
    source: SourceArgs,
}

impl AttachedRecord {
    /// Reads the record again, and opens a version of the program.
    fn open(self: &Rc<Self>, generation: u16) -> Result<Session<'static>, Failure> {
        let recording = Recording::open(&self.path);
        let recording = recording.map_err(|error| Failure::usage(error.to_string()))?;
        self.session(recording, generation)
    }

    fn session(
        self: &Rc<Self>,
        recording: Recording,
        generation: u16,
    ) -> Result<Session<'static>, Failure> {
        let path = self.path.as_path();
        let run = recording.runs().iter().rfind(|run| run.header.run == self.run);
        let run = run.ok_or_else(|| Failure::file(path, "its run is no longer kept"))?;
        let found = self.program(run, generation)?;
        let engine = found.engine(found.usual_engine());
        let engine = engine.or_else(|_| found.engine(ReplayEngine::Interpreter));
        let engine = engine.map_err(|error| Failure::file(path, error))?;
        let executive = || {
            recorded_executive(&run.header, &found.program)
                .map_err(|error| Failure::file(path, error))
        };
        let (view, executive) = (executive()?, executive()?);
        let Some(checked) = found.checked else {
            return Err(Failure::file(
                path,
                "the record holds an artifact without the text of its sources; name the program's source",
            ));
        };
        let history = Recorded::new(path, recording, self.run, generation, executive, engine);
        let history = history.map_err(|error| Failure::usage(error.0))?;
        let program = DebuggedProgram::new(checked.into_program(), found.sources, found.program);
        let record = Rc::clone(self);
        let open_version = move |generation| {
            record.open(generation).map_err(|failure| DebugError(failure.text("plcc")))
        };
        Ok(Session {
            program,
            history: Box::new(history),
            view,
            may_change: false,
            control: None,
            open_version: Some(Box::new(open_version)),
        })
    }

    /// The program of a version. The sources that the user has named are those of the newest version; of another one they
    /// are only taken where the record has no sources and they are the same program.
    fn program(&self, run: &RecordedRun, generation: u16) -> Result<Found, Failure> {
        let path = self.path.as_path();
        let recorded = run.program_of(generation);
        let recorded = recorded.ok_or_else(|| Failure::file(path, "its program is missing"))?;
        let named = || replay_input::program(path, recorded, &self.files, &self.source, &report());
        if generation == self.newest || self.files.is_empty() {
            return named();
        }
        match Found::in_record(recorded) {
            Ok(found) if found.checked.is_some() => Ok(found),
            _ => named(),
        }
    }
}

/// A diagnostic in one line of text: file, line, column, code and message.
fn place_and_text(sources: &plcc_diag::SourceMap, error: &plcc_diag::Diagnostic) -> String {
    let (line, column) = sources.line_col(error.span.file, error.span.start);
    let path = PathBuf::from(sources.path(error.span.file));
    format!("{}:{line}:{column}: {}: {}", path.display(), error.code, error.message)
}
