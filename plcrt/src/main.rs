//! The loader for the controller: runs an artifact that `plcc build` has made. Neither it nor what it
//! depends on contains a compiler.

mod args;
mod check_config;
mod dump_image;
mod info;
mod pages;

use std::ffi::OsString;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Parser;
use plcc_abi::machine::Machine;
use plcc_abi::{Program, printable};
use plcc_configuration::Configuration;
use plcc_files::{MAX_SETTINGS, read_regular, why_not_read, why_not_written};
use plcc_host::args::RunArgs;
use plcc_host::configuration;
use plcc_host::session;
use plcc_host::supervisor::{self, Supervision};
use plcc_load::signature::PublicKey;
use plcc_load::{Artifact, Inspection};
use plcc_record::RecordedProgram;
use plcc_runtime::NativeEngine;

use args::{Cli, Command, RunCommand};
use check_config::{check_config, check_wiring, refuse};

fn main() -> ExitCode {
    let started = Instant::now();
    let words = args::words();
    let program = OsString::from("plcrt");
    let command = Cli::parse_from(std::iter::once(&program).chain(&words)).command.of_today();
    ExitCode::from(run(command, words, started).unwrap_or_else(|message| {
        // Where standard error can't be written either, the exit status still says it.
        let _ = writeln!(io::stderr(), "error: {}", printable(&message));
        session::USAGE
    }))
}

/// Carries out a command, which `words` say. The process began at `started`.
fn run(command: Command, words: Vec<OsString>, started: Instant) -> Result<u8, String> {
    match command {
        Command::Run(args) => run_program(*args, words, started),
        Command::CheckConfig { config } => check_config(&config),
        Command::Info { artifact, key } => info(&artifact, key),
        Command::DumpImage { image, artifact, watch, key } => {
            let run = RunArgs { watch, key, ..RunArgs::default() };
            let key = run.public_key()?;
            let open = |path: &PathBuf| inspect(path, key.as_ref());
            let artifact = artifact.as_ref().map(open).transpose()?;
            print(&dump_image::dump(&image, artifact.as_ref(), &run)?)
        }
        Command::Man { dir: Some(folder) } => {
            let written = pages::write(&folder);
            written.map_err(|why| {
                format!("{}: the pages can't be written: {why}", folder.display())
            })?;
            Ok(session::DONE)
        }
        Command::Man { dir: None } => page(pages::MANUAL),
        Command::Completions { shell } => page(&shell),
    }
}

/// Prints one of the pages that are kept in the program.
fn page(name: &str) -> Result<u8, String> {
    let page = pages::page(name);
    print(&page.ok_or_else(|| format!("the page `{name}` is missing from plcrt"))?)
}

/// Prints what an artifact holds.
fn info(artifact: &Path, key: Option<PathBuf>) -> Result<u8, String> {
    let key = RunArgs { key, ..RunArgs::default() }.public_key()?;
    let artifact = inspect(artifact, key.as_ref())?;
    print(info::info(&artifact, key.is_some()).as_bytes())
}

/// Reads an artifact without loading it; with a key it must be signed.
fn inspect(path: &Path, key: Option<&PublicKey>) -> Result<Inspection, String> {
    Inspection::open(path, key).map_err(|error| error.with_path(path))
}

/// Runs a program, in this process or in one that this process watches.
fn run_program(args: RunCommand, mut words: Vec<OsString>, started: Instant) -> Result<u8, String> {
    let args = match &args.config {
        Some(path) => configured(&path.clone(), args)?,
        None => args,
    };
    if args.info {
        return info(args.artifact.as_deref().unwrap_or(Path::new("")), args.run.key);
    }
    if !args.run.realtime || args.no_supervisor || args.run.gdb || args.supervised {
        return run_here(&args, started);
    }
    let began = supervisor::monotonic().saturating_sub(started.elapsed());
    words.push(format!("--started-at={}", began.as_nanos()).into());
    supervisor::supervise(&Supervision {
        words,
        image: args.run.image.clone(),
        log: args.run.log.clone().filter(|path| path.as_os_str() != "-"),
        restart: args.restart.unwrap_or(0),
        device: args.watchdog_device,
    })
}

/// The options `args` with what a configuration says besides.
///
/// # Errors
/// When the file can't be read or has mistakes, or an option needs another one that neither has.
fn configured(path: &Path, mut args: RunCommand) -> Result<RunCommand, String> {
    let (configuration, findings) = Configuration::open(path)?;
    let mut mistakes = findings.for_control();
    mistakes.extend(configuration::apply(&configuration, &mut args.run));
    refuse(path, mistakes)?;
    args.run.realtime = true;
    args.run.record.get_or_insert_with(|| configuration.record_path());
    let Configuration { artifact, restart, watchdog_device, entries, .. } = configuration;
    args.artifact = args.artifact.or(artifact);
    args.restart = args.restart.or(restart);
    args.watchdog_device = args.watchdog_device.or(watchdog_device);
    args.wiring = entries;
    // Any of these is taken beside --config, as long as the file is not read.
    let missing = |option: &str, key: &str| {
        let file = path.display();
        Err(format!("{option} needs --{key}, or the key `{key}` in {file}"))
    };
    let run = &args.run;
    let lists = [
        ("--allow", !run.allow.is_empty()),
        ("--allow-user", !run.allow_user.is_empty()),
        ("--allow-group", !run.allow_group.is_empty()),
    ];
    if let Some((list, _)) = lists.into_iter().find(|(_, given)| *given)
        && run.socket.is_none()
    {
        return missing(list, "socket");
    }
    if run.retain_must_exist && run.retain.is_none() {
        return missing("--retain-must-exist", "retain");
    }
    Ok(args)
}

/// Reads the artifact, maps its code and runs it in this process.
fn run_here(args: &RunCommand, started: Instant) -> Result<u8, String> {
    let path = args.artifact.as_deref().unwrap_or(Path::new(""));
    let named = |error: &dyn Display| format!("{}: {error}", path.display());
    let key = args.run.public_key()?;
    let (artifact, bytes) =
        Artifact::open_with_bytes(path, key.as_ref()).map_err(|error| error.with_path(path))?;
    let engine = NativeEngine::new(&artifact.code, &artifact.program);
    let mut engine = engine.map_err(|error| named(&error))?;
    if args.run.gdb {
        artifact.show_to_gdb(&mut engine).map_err(|error| named(&error))?;
    }
    let operator = artifact.operator.clone().map(Arc::new);
    let program = artifact.into_program();
    let machine = args.machine.as_deref().map(|path| machine(path, &program)).transpose()?;
    let machine_path = args.machine.clone();
    let reads = args.machine.iter().chain(&args.artifact).chain(&args.config);
    let reads = reads.chain(&args.run.part_program).cloned().collect();
    let recorded = args.run.record.as_ref().map(|_| Arc::new(RecordedProgram::Artifact(bytes)));
    let supervised = args.supervised;
    let wiring = check_wiring(&args.wiring, &program, &args.run.control)?;
    let input_rules = configuration::input_rules(&wiring);
    refuse(args.config.as_deref().unwrap_or(Path::new("")), wiring.mistakes)?;
    // That of the supervisor, where there is one: it is the process that somebody has started.
    let since = args.started_at.map(Duration::from_nanos);
    let since = since.map(|at| supervisor::monotonic().saturating_sub(at));
    let started = since.and_then(|since| Instant::now().checked_sub(since)).unwrap_or(started);
    let started = Some(started);
    let run = RunArgs {
        reads,
        machine_path,
        supervised,
        started,
        program: recorded,
        input_rules,
        operator,
        ..args.run.clone()
    };
    Ok(session::run(&program, &mut engine, &run, machine.as_ref()))
}

/// Writes to standard output. That its reader has closed it (`plcrt … | head`) is not an error.
fn print(bytes: &[u8]) -> Result<u8, String> {
    let mut out = io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(format!("standard output can't be written: {}", why_not_written(&error)))
        }
        _ => Ok(session::DONE),
    }
}

/// The machine file of this run.
///
/// # Errors
/// When it can't be read or is not valid, when it sets executive variables (those were fixed when the
/// program was compiled), or when the program's control uses no machine file while it runs.
fn machine(path: &Path, program: &Program) -> Result<Machine, String> {
    let named = |error: &dyn Display| format!("{}: {error}", path.display());
    let bytes = read_regular(path, MAX_SETTINGS).map_err(|error| named(&why_not_read(&error)))?;
    let text = String::from_utf8_lossy(&bytes);
    let machine = Machine::parse(text.strip_prefix('\u{feff}').unwrap_or(&text))
        .map_err(|error| named(&format!("it is not a valid machine file: {error}")))?;
    let is_used = plcc_control::takes_machine_file(program) || machine.simulator.is_some();
    if !machine.variables.is_empty() || !is_used {
        let fixed = "what it says was fixed when the program was compiled; when an artifact is run, \
                     a machine file can set only an NCT control's parameters and tables, and [simulator]";
        return Err(named(&fixed));
    }
    Ok(machine)
}
