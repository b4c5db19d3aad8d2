//! The loader for the controller: runs an artifact that `plcc build` has made. Neither it nor what it
//! depends on contains a compiler.

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
use plcc_configuration::{Checked, Configuration, Entry, Mistake, Mistakes, Warning};
use plcc_files::{MAX_SETTINGS, read_regular, why_not_read, why_not_written};
use plcc_host::args::{ControlArgs, RunArgs};
use plcc_host::configuration;
use plcc_host::session;
use plcc_host::session::PathConflict;
use plcc_host::supervisor::{self, Supervision};
use plcc_load::Artifact;
use plcc_load::Inspection;
use plcc_load::signature::PublicKey;
use plcc_record::RecordedProgram;
use plcc_runtime::NativeEngine;

/// Runs a compiled PLC program.
///
/// The artifact is the file that `plcc build` writes.
#[derive(Parser)]
#[command(
    name = "plcrt",
    version,
    args_override_self = true,
    after_help = "Exit status: 0 done; 2 wrong usage, or a file that can't be read or written or is \
                  not valid; 3 the program was stopped by a run-time fault; 130 Ctrl-C or SIGTERM.\n\n\
                  Examples:\n  \
                  plcrt lathe.plcx --realtime --retain lathe.retained\n  \
                  plcrt lathe.plcx --ticks 1000 --stimulus lathe.csv --watch MCHON,@FRO --trace out.csv\n  \
                  plcrt mill.plcx --for 5s --dump - | jq .variables\n  \
                  plcrt --info mill.plcx\n  \
                  plcrt lathe.plcx --dump-image /run/lathe.dead\n  \
                  plcrt --config lathe.toml"
)]
struct Cli {
    /// The artifact, STEM.plcx
    #[arg(required_unless_present_any = ["completions", "man", "config", "check_config", "dump_image"])]
    artifact: Option<PathBuf>,

    /// NCT: a machine file, used in place of the one that the program was compiled with
    #[arg(long, value_name = "FILE.toml")]
    machine: Option<PathBuf>,

    /// Prints what the artifact holds and whether this machine can run it, and runs nothing
    #[arg(long)]
    info: bool,

    /// Prints the variables and outputs in an image file (--image) as a dump, and runs nothing:
    /// those of a control that was killed. With the artifact of its program the dump is that of a run
    #[arg(long, value_name = "FILE", conflicts_with_all = ["realtime", "config"])]
    dump_image: Option<PathBuf>,

    /// Prints completions for a shell, and runs nothing
    #[arg(long, value_name = "SHELL", exclusive = true, value_parser = pages::SHELLS)]
    completions: Option<String>,

    /// Prints the manual page, and runs nothing
    #[arg(long, exclusive = true)]
    man: bool,

    /// Takes the artifact and the options of a controller from a file, and runs in real time; an option
    /// on the command line takes precedence
    #[arg(long, value_name = "FILE.toml", groups = ["paced", "served", "retained"])]
    config: Option<PathBuf>,

    /// Finds every mistake in such a file, and runs nothing
    #[arg(long, value_name = "FILE.toml", exclusive = true)]
    check_config: Option<PathBuf>,

    /// With --realtime, runs the control in this process, without another one that watches it, as --gdb
    /// does; for strace
    #[arg(long)]
    no_supervisor: bool,

    /// How often a control that has died is started again by its supervisor [default: 0]
    #[arg(long, value_name = "N")]
    restart: Option<u32>,

    /// A hardware watchdog that the supervisor keeps from restarting the computer for as long as the
    /// control is well, usually /dev/watchdog
    #[arg(long, value_name = "DEVICE")]
    watchdog_device: Option<PathBuf>,

    /// When the supervisor began, in nanoseconds of CLOCK_MONOTONIC
    #[arg(long, hide = true)]
    started_at: Option<u64>,

    /// Says that this process is the control, and standard input the connection to its supervisor
    #[arg(long, hide = true)]
    supervised: bool,

    /// The entries `[[io]]` of the configuration.
    #[arg(skip)]
    wiring: Vec<Entry>,

    #[command(flatten)]
    run: RunArgs,
}

fn main() -> ExitCode {
    let started = Instant::now();
    let words: Vec<OsString> = std::env::args_os().collect();
    let cli = Cli::parse_from(&words);
    ExitCode::from(run(cli, &words, started).unwrap_or_else(|message| {
        // Where standard error can't be written either, the exit status still says it.
        let _ = writeln!(io::stderr(), "error: {}", printable(&message));
        session::USAGE
    }))
}

/// Does what the words of the command line say. The process began at `started`.
fn run(cli: Cli, words: &[OsString], started: Instant) -> Result<u8, String> {
    if let Some(path) = &cli.check_config {
        return check_config(path);
    }
    let cli = match &cli.config {
        Some(path) => configured(&path.clone(), cli)?,
        None => cli,
    };
    if !cli.run.realtime || cli.no_supervisor || cli.run.gdb || cli.supervised || cli.info {
        return run_here(&cli, started);
    }
    let mut words: Vec<OsString> = words.iter().skip(1).cloned().collect();
    let began = supervisor::monotonic().saturating_sub(started.elapsed());
    words.push(format!("--started-at={}", began.as_nanos()).into());
    supervisor::supervise(&Supervision {
        words,
        image: cli.run.image.clone(),
        log: cli.run.log.clone().filter(|path| path.as_os_str() != "-"),
        restart: cli.restart.unwrap_or(0),
        device: cli.watchdog_device,
    })
}

/// The command line `cli` with what a configuration says besides.
///
/// # Errors
/// When the file can't be read or has mistakes, or an option needs another one that neither has.
fn configured(path: &Path, mut cli: Cli) -> Result<Cli, String> {
    let (configuration, findings) = Configuration::open(path)?;
    let mut mistakes = findings.for_control();
    mistakes.extend(configuration::apply(&configuration, &mut cli.run));
    refuse(path, mistakes)?;
    cli.run.realtime = true;
    cli.run.record.get_or_insert_with(|| configuration.record_path());
    let Configuration { artifact, restart, watchdog_device, entries, .. } = configuration;
    cli.artifact = cli.artifact.or(artifact);
    cli.restart = cli.restart.or(restart);
    cli.watchdog_device = cli.watchdog_device.or(watchdog_device);
    cli.wiring = entries;
    // Any of these is taken beside --config, as long as the file is not read.
    let missing = |option: &str, key: &str| {
        let file = path.display();
        Err(format!("{option} needs --{key}, or the key `{key}` in {file}"))
    };
    let run = &cli.run;
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
    Ok(cli)
}

/// That a configuration has mistakes, if it has some.
fn refuse(path: &Path, mut mistakes: Vec<Mistake>) -> Result<(), String> {
    mistakes.sort();
    if mistakes.is_empty() { Ok(()) } else { Err(Mistakes(path, &mistakes).to_string()) }
}

/// Finds the mistakes of a configuration, also those that only the program's control or `plcio` knows.
///
/// # Errors
/// All of them.
fn check_config(path: &Path) -> Result<u8, String> {
    let (configuration, findings) = Configuration::open(path)?;
    let mut mistakes = match configuration.is_wired() {
        true => findings.all(),
        false => findings.for_control(),
    };
    let reads = configuration.artifact.iter().cloned().chain([path.to_owned()]).collect();
    let mut run = RunArgs { realtime: true, reads, ..RunArgs::default() };
    mistakes.extend(configuration::apply(&configuration, &mut run));
    let mut warnings: Vec<Warning> = vec![];
    for (option, folder) in session::missing_folders(&run) {
        let key = option.trim_start_matches('-');
        let what = "does not exist: the control could not write there";
        let message = format!("`{key}`: the folder {} {what}", folder.display());
        warnings.push(Warning { line: Some(configuration.line_of(key)), message });
    }
    if let Some(artifact) = &configuration.artifact {
        match run.public_key().and_then(|key| open(artifact, key.as_ref())) {
            Err(message) => {
                mistakes.push(Mistake { line: configuration.line_of("artifact"), message });
            }
            Ok(Artifact { program, .. }) => {
                check_program(&configuration, &program, &run, &mut mistakes, &mut warnings)?;
            }
        }
    }
    // An output that no entry takes to the outside may be that of an entry with a mistake.
    refuse(path, mistakes)?;
    warnings.extend(configuration.warnings());
    for warning in &warnings {
        let _ = writeln!(io::stderr(), "warning: {}", printable(&warning.of(path)));
    }
    Ok(session::DONE)
}

/// Finds what does not fit the program of a configuration, which says `run` of a run.
///
/// # Errors
/// When the program's control can't be made.
fn check_program(
    configuration: &Configuration,
    program: &Program,
    run: &RunArgs,
    mistakes: &mut Vec<Mistake>,
    warnings: &mut Vec<Warning>,
) -> Result<(), String> {
    for PathConflict { option, message } in session::path_conflicts(program, run) {
        let line = configuration.line_of(option.trim_start_matches('-'));
        mistakes.push(Mistake { line, message });
    }
    let executive = |control: &ControlArgs| session::executive(program, control, true, None);
    // The only key that is an option of a control.
    let mut control = run.control.clone();
    if let Err(error) = executive(&control) {
        let line = configuration.line_of("period");
        mistakes.push(Mistake { line, message: error.to_string() });
        control = ControlArgs::default();
    }
    let own = executive(&control).map_err(|error| error.to_string())?;
    let names = own.names();
    for entry in &configuration.safe {
        let refused = names.safe_lines(&[configuration::safe_output(entry)]);
        let messages = refused.err().into_iter().flatten().map(|error| error.to_string());
        mistakes.extend(messages.map(|message| Mistake { line: entry.line, message }));
    }
    let checked = check_wiring(&configuration.entries, program, &control)?;
    warnings.extend(checked.warnings);
    mistakes.extend(checked.mistakes);
    Ok(())
}

/// Compares entries `[[io]]` with a program.
///
/// # Errors
/// When the program's control can't be made.
fn check_wiring(
    entries: &[Entry],
    program: &Program,
    control: &ControlArgs,
) -> Result<Checked, String> {
    if entries.is_empty() {
        return Ok(Checked::default());
    }
    let executive = session::executive(program, control, true, None);
    let executive = executive.map_err(|error| error.to_string())?;
    Ok(configuration::check_wiring(entries, program, &*executive.names()))
}

/// Reads the artifact, maps its code and runs it in this process.
fn run_here(cli: &Cli, started: Instant) -> Result<u8, String> {
    let page = if cli.man { Some(pages::MANUAL) } else { cli.completions.as_deref() };
    if let Some(name) = page {
        let page = pages::page(name);
        return print(&page.ok_or_else(|| format!("the page `{name}` is missing from plcrt"))?);
    }
    if let Some(image) = &cli.dump_image {
        let key = cli.run.public_key()?;
        let open = |path: &PathBuf| {
            Inspection::open(path, key.as_ref()).map_err(|error| error.with_path(path))
        };
        let artifact = cli.artifact.as_ref().map(open).transpose()?;
        return print(&dump_image::dump(image, artifact.as_ref(), &cli.run)?);
    }
    let path = cli.artifact.as_deref().unwrap_or(Path::new(""));
    let named = |error: &dyn Display| format!("{}: {error}", path.display());
    let key = cli.run.public_key()?;
    if cli.info {
        let artifact =
            Inspection::open(path, key.as_ref()).map_err(|error| error.with_path(path))?;
        return print(info::info(&artifact, key.is_some()).as_bytes());
    }
    let (artifact, bytes) =
        Artifact::open_with_bytes(path, key.as_ref()).map_err(|error| error.with_path(path))?;
    let engine = NativeEngine::new(&artifact.code, &artifact.program);
    let mut engine = engine.map_err(|error| named(&error))?;
    if cli.run.gdb {
        artifact.show_to_gdb(&mut engine).map_err(|error| named(&error))?;
    }
    let program = artifact.into_program();
    let machine = cli.machine.as_deref().map(|path| machine(path, &program)).transpose()?;
    let reads = cli.machine.iter().chain(&cli.artifact).chain(&cli.config).cloned().collect();
    let recorded = cli.run.record.as_ref().map(|_| Arc::new(RecordedProgram::Artifact(bytes)));
    let supervised = cli.supervised;
    let wiring = check_wiring(&cli.wiring, &program, &cli.run.control)?;
    let input_rules = configuration::input_rules(&wiring);
    refuse(cli.config.as_deref().unwrap_or(Path::new("")), wiring.mistakes)?;
    // That of the supervisor, where there is one: it is the process that somebody has started.
    let since = cli.started_at.map(Duration::from_nanos);
    let since = since.map(|at| supervisor::monotonic().saturating_sub(at));
    let started = since.and_then(|since| Instant::now().checked_sub(since)).unwrap_or(started);
    let started = Some(started);
    let run =
        RunArgs { reads, supervised, started, program: recorded, input_rules, ..cli.run.clone() };
    Ok(session::run(&program, &mut engine, &run, machine.as_ref()))
}

/// Reads an artifact; with a key it must be signed.
fn open(path: &Path, key: Option<&PublicKey>) -> Result<Artifact, String> {
    Artifact::open(path, key).map_err(|error| error.with_path(path))
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
    if !machine.variables.is_empty() || !session::takes_machine_file(program) {
        let fixed = "what it says was fixed when the program was compiled; when an artifact is run, \
                     a machine file can set only an NCT control's parameters and tables";
        return Err(named(&fixed));
    }
    Ok(machine)
}
