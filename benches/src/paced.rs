//! Runs of an example in real time, with a clock of the caller's.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use clap::Parser;
use plcc::compile;
use plcc::disk::Disk;
use plcc_abi::Dialect;
use plcc_codegen::OptLevel;
use plcc_diag::SourceMap;
use plcc_frontend::common::Options;
use plcc_host::args::RunArgs;
use plcc_host::run::Clock;
use plcc_host::session::{self, Surroundings};

#[derive(Parser)]
struct Args {
    #[command(flatten)]
    run: RunArgs,
}

/// Runs an example in native code as `plcc run --realtime` does, with further `options` of that command. `supervised` says
/// that the process's standard input is the connection to a supervisor.
///
/// # Panics
/// When the options are wrong or the run does not come to its end.
pub fn run(dialect: Dialect, example: &str, options: &[&str], supervised: bool, clock: &dyn Clock) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(dialect.name());
    let path = folder.join(example);
    let mut sources = SourceMap::new();
    let file = sources.add(path.to_string_lossy(), &std::fs::read(&path).unwrap());
    let compile_options = Options::default();
    let (checked, _) = compile::check(&mut sources, &[file], dialect, &Disk, &compile_options);
    let lowered = checked.unwrap().optimized(OptLevel::Speed).unwrap();
    let (mut engine, _) = compile::jit(&lowered).unwrap();
    let args = Args::try_parse_from(["run", "--realtime"].iter().chain(options));
    let mut args = args.unwrap_or_else(|error| panic!("{error}")).run;
    args.supervised = supervised;
    let status = session::run_with(
        &lowered.program,
        &mut engine,
        &args,
        None,
        Surroundings { clock, ..Surroundings::default() },
    );
    assert_eq!(status, 0, "the run did not come to its end");
}
