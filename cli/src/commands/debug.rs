//! `plcc debug`: the Debug Adapter Protocol on standard input and output.

use std::io::{self, BufReader};
use std::path::{Path, PathBuf};

use clap::Parser;
use plcc_debugger::dap::{self, LaunchArguments, Launcher};
use plcc_debugger::{DebuggedProgram, Launched, Session};
use plcc_runtime::run::{Player, Stimulus};
use plcc_runtime::session;

use crate::args::{Cli, Command, RunCommand};
use crate::failure::{DONE, Failure};
use crate::input::{Input, SourceSettings};
use crate::report::Report;

pub(crate) fn debug() -> Result<u8, Failure> {
    let input = BufReader::new(io::stdin());
    let served = dap::serve(input, io::stdout().lock(), &Sources);
    served.map_err(|error| Failure::usage(format!("the debugger's client is gone: {error}")))?;
    Ok(DONE)
}

/// Makes sessions of source files.
struct Sources;

impl Launcher for Sources {
    fn launch(&self, arguments: &LaunchArguments) -> Result<Session<'_>, String> {
        let command = run_command(arguments)?;
        launch(&command).map_err(|failure| failure.text("plcc debug"))
    }
}

/// The options of `plcc run` that mean the same.
fn run_command(arguments: &LaunchArguments) -> Result<RunCommand, String> {
    let LaunchArguments { program, stimulus, machine, ticks, args, cwd, .. } = arguments;
    if arguments.recording.is_some() {
        return Err("this version of plcc debug opens no recordings yet".into());
    }
    let folder = cwd.as_deref().map(Path::new).unwrap_or(Path::new(""));
    let path = |text: &String| folder.join(text).to_string_lossy().into_owned();
    let mut words = vec!["plcc".to_owned(), "run".to_owned()];
    words.extend(program.all().iter().map(path));
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

fn launch(command: &RunCommand) -> Result<Session<'static>, Failure> {
    let report = Report::new(clap::ColorChoice::Never);
    let settings = SourceSettings::for_files(&command.source, &command.files, &report)?;
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

/// A diagnostic in a line: file, line, column, code and message.
fn place_and_text(sources: &plcc_diag::SourceMap, error: &plcc_diag::Diagnostic) -> String {
    let (line, column) = sources.line_col(error.span.file, error.span.start);
    let path = PathBuf::from(sources.path(error.span.file));
    format!("{}:{line}:{column}: {}: {}", path.display(), error.code, error.message)
}
