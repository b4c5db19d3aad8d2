//! The loader for the controller: runs an artifact that `plcc build` has made. No compiler is in
//! it, and none in what it depends on.

use std::fmt::Display;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use plcc_runtime::args::RunArgs;
use plcc_runtime::{Artifact, NativeEngine, session};

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

    #[command(flatten)]
    run: RunArgs,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    ExitCode::from(match load(&cli.artifact) {
        Ok((artifact, mut engine)) => session::run(&artifact.program, &mut engine, &cli.run, None),
        Err(message) => {
            // Where nobody listens, the exit status says it.
            let _ = writeln!(io::stderr(), "error: {message}");
            session::USAGE
        }
    })
}

/// Reads an artifact and maps its code.
fn load(path: &Path) -> Result<(Artifact, NativeEngine), String> {
    let named = |error: &dyn Display| format!("{}: {error}", path.display());
    let artifact = Artifact::open(path).map_err(|error| named(&error))?;
    let engine = NativeEngine::new(&artifact.code, &artifact.program);
    let engine = engine.map_err(|error| named(&error))?;
    Ok((artifact, engine))
}
