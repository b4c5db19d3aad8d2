//! The loader for the controller: runs an artifact that `plcc build` has made. Neither it nor what it
//! depends on contains a compiler.

mod info;

use std::fmt::Display;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{CommandFactory, Parser};
use plcc_abi::machine::Machine;
use plcc_abi::{Program, printable};
use plcc_runtime::args::RunArgs;
use plcc_runtime::artifact::Inspection;
use plcc_runtime::files::{MAX_SETTINGS, read_regular, why_not_read, why_not_written};
use plcc_runtime::{Artifact, ArtifactError, NativeEngine, session};

/// Runs a compiled PLC program.
///
/// The artifact is the file that `plcc build` writes.
#[derive(Parser)]
#[command(
    name = "plcrt",
    version,
    after_help = "Exit status: 0 done; 2 wrong usage, or a file that can't be read or written or is \
                  not valid; 3 the program was stopped by a run-time fault; 130 Ctrl-C or SIGTERM.\n\n\
                  Examples:\n  \
                  plcrt lathe.plcx --realtime --retain lathe.retained\n  \
                  plcrt lathe.plcx --ticks 1000 --stimulus lathe.csv --watch MCHON,@FRO --trace out.csv\n  \
                  plcrt mill.plcx --for 5s --dump - | jq .variables\n  \
                  plcrt --info mill.plcx"
)]
struct Cli {
    /// The artifact, STEM.plcx
    #[arg(required_unless_present_any = ["completions", "man"])]
    artifact: Option<PathBuf>,

    /// NCT: a machine file, used in place of the one that the program was compiled with
    #[arg(long, value_name = "FILE.toml")]
    machine: Option<PathBuf>,

    /// Prints what the artifact holds and whether this machine can run it, and runs nothing
    #[arg(long)]
    info: bool,

    /// Prints completions for a shell, and runs nothing
    #[arg(long, value_name = "SHELL", exclusive = true)]
    completions: Option<clap_complete::Shell>,

    /// Prints the manual page, and runs nothing
    #[arg(long, exclusive = true)]
    man: bool,

    #[command(flatten)]
    run: RunArgs,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    ExitCode::from(run(&cli).unwrap_or_else(|message| {
        // Where standard error can't be written either, the exit status still says it.
        let _ = writeln!(io::stderr(), "error: {}", printable(&message));
        session::USAGE
    }))
}

/// Reads the artifact, maps its code and runs it.
fn run(cli: &Cli) -> Result<u8, String> {
    if let Some(shell) = cli.completions {
        let mut script = Vec::new();
        clap_complete::generate(shell, &mut Cli::command(), "plcrt", &mut script);
        return print(&script);
    }
    if cli.man {
        let mut page = Vec::new();
        let rendered = clap_mangen::Man::new(Cli::command()).render(&mut page);
        rendered.map_err(|error| error.to_string())?;
        return print(&page);
    }
    let path = cli.artifact.as_deref().unwrap_or(Path::new(""));
    let named = |error: &dyn Display| format!("{}: {error}", path.display());
    let read = |error| match error {
        ArtifactError::Read { .. } => error.to_string(),
        _ => named(&error),
    };
    let key = cli.run.public_key()?;
    if cli.info {
        let artifact = Inspection::open(path, key.as_ref()).map_err(read)?;
        return print(info::info(&artifact, key.is_some()).as_bytes());
    }
    let artifact = Artifact::open(path, key.as_ref()).map_err(read)?;
    let engine = NativeEngine::new(&artifact.code, &artifact.program);
    let mut engine = engine.map_err(|error| named(&error))?;
    let machine =
        cli.machine.as_deref().map(|path| machine(path, &artifact.program)).transpose()?;
    let reads = cli.machine.iter().chain(&cli.artifact).cloned().collect();
    let run = RunArgs { reads, code: Some(artifact.code_number()), ..cli.run.clone() };
    Ok(session::run(&artifact.program, &mut engine, &run, machine.as_ref()))
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
