//! `plcc run`: makes an engine of a source or of an artifact, and runs it.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use plcc_abi::machine::Machine;
use plcc_abi::{Engine, Program};
use plcc_codegen::emit::ObjectOptions;
use plcc_diag::Diagnostic;
use plcc_files::open_regular;
use plcc_frontend::language;
use plcc_host::args::RunArgs;
use plcc_host::session::{self, Surroundings, USAGE};
use plcc_host::simulation::Simulation;
use plcc_load::Artifact;
use plcc_record::RecordedProgram;
use plcc_runtime::NativeEngine;

use crate::args::{EngineArg, FormatArg, PassArgs, RunCommand};
use crate::commands::plot::write_plot;
use crate::compile::{self, Checked, CompileError};
use crate::failure::{ERRORS, Failure};
use crate::input::{self, Input, SourceSettings};
use crate::later_code::jit_in_parts;
use crate::output;
use crate::plot::PlotRecorder;
use crate::recorded::recorded_sources;
use crate::report::{Count, Destination, Report, count_of};

pub(crate) fn run(args: &RunCommand, passes: &PassArgs, report: &Report) -> Result<u8, Failure> {
    if let Some(path) = artifact_among(&args.files)? {
        return run_artifact(path, args, passes, report);
    }
    if args.run.key.is_some() {
        return Err(Failure::usage("--key is for artifacts; a source has no signature"));
    }
    if args.run.gdb && args.engine == Some(EngineArg::Interp) {
        let what = "--gdb shows machine code, and --engine interp makes none; `plcc debug` steps \
                    through statements";
        return Err(Failure::usage(what));
    }
    let mut settings = SourceSettings::for_files(&args.source, &args.files, report)?;
    settings.options.simulate = args.run.simulate;
    let program = Input::read(&args.files, &args.source)?.check(&settings)?;
    input::refuse_options_of_others(program.dialect, |other| {
        (args.keep_going && language(other).runs_despite_errors()).then_some("--keep-going")
    })?;
    let outputs = [
        args.run.trace_path(),
        args.run.events.as_deref(),
        args.run.dump.as_deref(),
        args.plot.as_deref(),
    ];
    let stdout_taken = outputs.into_iter().flatten().any(output::is_stdout);
    let to = Destination { format: args.source.message_format, stdout_taken };
    let errors = Count::of(&program.diagnostics).errors;
    let other_language = program.other_language();
    let Some(checked) = program.checked.filter(|_| errors == 0 || args.keep_going) else {
        let count = report.show(&program.sources, &program.diagnostics, to)?;
        other_language.iter().for_each(|note| report.note(note));
        report.message(&format!("{count}: the program is not run"));
        return Ok(ERRORS);
    };
    let shown: Vec<_> = match args.source.message_format {
        FormatArg::Json => program.diagnostics,
        FormatArg::Human => {
            let (errors, rest): (Vec<_>, Vec<_>) =
                program.diagnostics.into_iter().partition(|d| d.is_error());
            let warnings = Count::of(&rest).warnings;
            if warnings > 0 {
                report.warn(&format!("{}; `plcc check` shows them", count_of(warnings, "warning")));
            }
            errors
        }
    };
    report.show(&program.sources, &shown, to)?;
    let (tables, mut engine) = match engine(&checked, args, passes) {
        Ok(engine) => engine,
        Err(error) => return report.not_compiled(error, &program.sources, to),
    };
    let machine_path = settings.machine.clone();
    if args.run.simulate && refuses_part_program(&tables, args, &settings, report, to)? {
        return Ok(USAGE);
    }
    let reads = settings.machine.iter().chain(&args.run.part_program).cloned().collect();
    let recorded = match (&args.run.record, &settings.machine) {
        (None, _) => None,
        (Some(_), path) => {
            let machine = path.as_deref().map(input::machine_text).transpose()?;
            let (sources, named) = (&program.sources, program.named_files);
            let options = &settings.options;
            let sources = recorded_sources(program.dialect, sources, named, options, machine);
            Some(Arc::new(RecordedProgram::Sources(sources)))
        }
    };
    let operator = args.run.socket.as_ref().map(|_| Arc::new(checked.operator_panel()));
    let run = RunArgs { reads, machine_path, program: recorded, operator, ..args.run.clone() };
    in_session(&tables, engine.as_mut(), run, settings.machine_file(), args, report)
}

/// Runs a program in a session, and draws the picture of `--plot`.
///
/// # Errors
/// When the picture can't be written.
fn in_session(
    program: &Program,
    engine: &mut dyn Engine,
    run: RunArgs,
    machine: Option<&Machine>,
    args: &RunCommand,
    report: &Report,
) -> Result<u8, Failure> {
    let Some(path) = &args.plot else { return Ok(session::run(program, engine, &run, machine)) };
    if run.watch.is_empty() {
        report.warn("the picture will be empty: --watch NAME,NAME… says what it shows");
    }
    let run = RunArgs { plot: Some(path.clone()), ..run };
    let mut recorder = PlotRecorder::new();
    let surroundings = Surroundings { hook: Some(&mut recorder), ..Surroundings::default() };
    let status = session::run_with(program, engine, &run, machine, surroundings);
    // Of a run that did not begin there is nothing to draw.
    if status != USAGE || !recorder.picture().is_empty() {
        write_plot(path, recorder.picture(), report)?;
    }
    Ok(status)
}

/// The most mistakes of a part program that are drawn; the others are counted.
const MAX_MISTAKES: usize = 20;

/// Draws the mistakes of the part program that the simulator would read. Returns whether there are any.
///
/// # Errors
/// When it can't be read, or the table does not fit.
fn refuses_part_program(
    tables: &Program,
    args: &RunCommand,
    settings: &SourceSettings,
    report: &Report,
    to: Destination,
) -> Result<bool, Failure> {
    let machine = settings.machine.as_deref().zip(settings.machine_file());
    let read = Simulation::read(machine, args.run.part_program.as_deref());
    let found = read.map_err(Failure::Usage)?.diagnostics(tables);
    let found = found.map_err(|errors| Failure::Usage(errors.join("\nerror: ")))?;
    let Some((sources, mut found)) = found else { return Ok(false) };
    found.retain(Diagnostic::is_error);
    if found.is_empty() {
        return Ok(false);
    }
    let more = found.len().saturating_sub(MAX_MISTAKES);
    found.truncate(MAX_MISTAKES);
    report.show(&sources, &found, to)?;
    let count = count_of(found.len() + more, "error");
    let shown = match more {
        0 => String::new(),
        _ => format!(", of which the first {MAX_MISTAKES} are shown"),
    };
    report.message(&format!("the part program has {count}{shown}: the program is not run"));
    Ok(true)
}

/// The engine that the options name, with the tables of the program.
fn engine(
    checked: &Checked,
    args: &RunCommand,
    passes: &PassArgs,
) -> Result<(Program, Box<dyn Engine>), CompileError> {
    let opt = passes.at(args.opt.unwrap_or_default());
    Ok(match args.engine.unwrap_or_default() {
        EngineArg::Interp => {
            let program = checked.lower()?.program;
            (program, checked.interpreter())
        }
        EngineArg::Jit => {
            let gdb = args.run.gdb.then(debug_options);
            let (program, native) = if gdb.is_some() || args.run.realtime {
                // gdb is told of code once, and a tick that is paced by the clock has no time to compile.
                let (lowered, native) = checked.compiled(opt, |lowered| match &gdb {
                    None => Ok(compile::jit(lowered)?.0),
                    Some(options) => compile::jit_for_gdb(lowered, options),
                })?;
                (lowered.program, native)
            } else {
                let made = jit_in_parts(|| checked.lower(), opt)?;
                (made.program, made.engine)
            };
            (program, Box::new(native))
        }
        EngineArg::Aot => {
            let (lowered, engine) = checked.compiled(opt, |lowered| match args.run.gdb {
                false => Ok(compile::aot(lowered)?.0),
                true => compile::aot_for_gdb(lowered, &debug_options()),
            })?;
            (lowered.program, Box::new(engine))
        }
    })
}

/// What debuggers are told by: the names of sources start from the current folder.
fn debug_options() -> ObjectOptions {
    let folder = std::env::current_dir().map(|folder| folder.to_string_lossy().into_owned());
    let default = ObjectOptions::default();
    ObjectOptions { folder: folder.unwrap_or(default.folder.clone()), ..default }
}

/// The artifact, if that is what was given.
///
/// # Errors
/// When there are other files beside it.
fn artifact_among(files: &[PathBuf]) -> Result<Option<&Path>, Failure> {
    for path in files {
        let named = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("plcx"));
        if !named && !begins_as_artifact(path) {
            continue;
        }
        if files.len() > 1 {
            return Err(Failure::file(
                path,
                "it is an artifact, which can't be run together with other files",
            ));
        }
        return Ok(Some(path));
    }
    Ok(None)
}

/// Whether a file begins as an artifact does. Of what is not an ordinary file (a pipe) nothing is
/// read, since it can't be read a second time.
fn begins_as_artifact(path: &Path) -> bool {
    let mut start = Vec::new();
    let mut read = || open_regular(path).and_then(|file| file.take(64).read_to_end(&mut start));
    path.is_file() && read().is_ok() && Artifact::is_artifact(&start)
}

fn run_artifact(
    path: &Path,
    args: &RunCommand,
    passes: &PassArgs,
    report: &Report,
) -> Result<u8, Failure> {
    let source = &args.source;
    let machine = source.machine.as_deref().map(input::machine).transpose()?;
    let variables = machine.as_ref().is_some_and(|machine| !machine.variables.is_empty());
    let fixed = [
        ("--limits", source.limits.is_some()),
        ("--define", !source.define.is_empty()),
        ("--controller", source.controller.is_some()),
        ("--machine's [variables]", variables),
    ];
    if let Some((option, _)) = fixed.iter().find(|(_, given)| *given) {
        let what = format!("{option} was fixed when this artifact was built; build it again");
        return Err(Failure::file(path, what));
    }
    let without_effect = [
        ("--engine", args.engine.is_some_and(|engine| engine != EngineArg::Aot)),
        ("--opt", args.opt.is_some()),
        ("--passes", passes.passes.is_some()),
        ("--keep-going", args.keep_going),
        ("-I", !source.include.is_empty()),
    ];
    for (option, _) in without_effect.iter().filter(|(_, given)| *given) {
        let path = path.display();
        report.warn(&format!("{option} changes nothing: {path} is an artifact, compiled already"));
    }
    let key = args.run.public_key().map_err(Failure::Usage)?;
    let (artifact, bytes) = Artifact::open_with_bytes(path, key.as_ref())
        .map_err(|error| Failure::file(path, error))?;
    let dialect = artifact.program.dialect();
    if source.dialect.is_some_and(|named| named != dialect) {
        return Err(Failure::file(
            path,
            format!("--dialect is wrong: the program is {}", dialect.name()),
        ));
    }
    let engine = NativeEngine::new(&artifact.code, &artifact.program);
    let mut engine = engine.map_err(|error| Failure::file(path, error))?;
    if args.run.gdb {
        artifact.show_to_gdb(&mut engine).map_err(|error| Failure::file(path, error))?;
    }
    let machine_path = source.machine.clone();
    let read = source.machine.iter().chain(&args.run.part_program).cloned();
    let reads = read.chain([path.to_owned()]).collect();
    let recorded = args.run.record.as_ref().map(|_| Arc::new(RecordedProgram::Artifact(bytes)));
    let operator = artifact.operator.clone().map(Arc::new);
    let run = RunArgs { reads, machine_path, program: recorded, operator, ..args.run.clone() };
    in_session(&artifact.program, &mut engine, run, machine.as_ref(), args, report)
}
