//! The loader for the controller: runs an artifact that `plcc build` has made. No compiler is in
//! it, and none in what it depends on.

use std::fmt::Display;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use plcc_abi::Program;
use plcc_abi::machine::Machine;
use plcc_runtime::args::RunArgs;
use plcc_runtime::{Artifact, ArtifactError, NativeEngine, session};

/// Runs a compiled PLC program.
///
/// The artifact is what `plcc build` writes. Options that are fixed when a program is compiled
/// are not here.
#[derive(Parser)]
#[command(
    name = "plcrt",
    version,
    after_help = "Exit status: 0 done; 2 wrong usage, a file that can't be read or is not valid; \
                  3 the program was stopped by a run-time fault; 130 Ctrl-C.\n\n\
                  Examples:\n  \
                  plcrt lathe.plcx --realtime --retain lathe.retained\n  \
                  plcrt lathe.plcx --ticks 1000 --stimulus jog.csv --watch LS27,@FRO --trace jog.csv.out\n  \
                  plcrt mill.plcx --for 5s --dump - | jq .variables"
)]
struct Cli {
    /// The artifact, STEM.plcx
    artifact: PathBuf,

    /// NCT: a machine file (TOML) in place of the one that the program was compiled with
    #[arg(long, value_name = "FILE.toml")]
    machine: Option<PathBuf>,

    #[command(flatten)]
    run: RunArgs,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    ExitCode::from(run(&cli).unwrap_or_else(|message| {
        // Where nobody listens, the exit status says it.
        let _ = writeln!(io::stderr(), "error: {message}");
        session::USAGE
    }))
}

/// Reads the artifact, maps its code and runs it.
fn run(cli: &Cli) -> Result<u8, String> {
    let named = |error: &dyn Display| format!("{}: {error}", cli.artifact.display());
    let artifact = Artifact::open(&cli.artifact).map_err(|error| match error {
        ArtifactError::Read { .. } => error.to_string(),
        _ => named(&error),
    })?;
    let engine = NativeEngine::new(&artifact.code, &artifact.program);
    let mut engine = engine.map_err(|error| named(&error))?;
    let machine =
        cli.machine.as_deref().map(|path| machine(path, &artifact.program)).transpose()?;
    let reads = cli.machine.iter().chain([&cli.artifact]).cloned().collect();
    let run = RunArgs { reads, ..cli.run.clone() };
    Ok(session::run(&artifact.program, &mut engine, &run, machine.as_ref()))
}

/// What a machine file says of the control. What it says of variables was fixed when the program
/// was compiled.
fn machine(path: &Path, program: &Program) -> Result<Machine, String> {
    let named = |error: &dyn Display| format!("{}: {error}", path.display());
    let text = fs::read_to_string(path).map_err(|error| named(&error))?;
    let machine = Machine::parse(&text).map_err(|error| named(&error))?;
    if !machine.variables.is_empty() || !session::takes_machine_file(program) {
        let fixed = "what it says was fixed when the program was compiled; an artifact takes an \
                     NCT control's settings only";
        return Err(named(&fixed));
    }
    Ok(machine)
}
