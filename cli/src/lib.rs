//! The command line of plcc.
//!
//! [`compile`] makes an engine of source text, for any language; the commands are in `commands`, a
//! file each. A command that can't do its work returns a `Failure`, which decides the exit status.
//!
//! ```
//! use plcc::compile::{check, jit};
//! use plcc::disk::Disk;
//! use plcc_abi::Dialect;
//! use plcc_codegen::OptLevel;
//! use plcc_diag::SourceMap;
//! use plcc_frontend::common::Options;
//!
//! let mut sources = SourceMap::new();
//! let file = sources.add("count.pmi", b"$INTEGER\nN\n$END\nN = N + 1\n");
//! let (checked, diagnostics) =
//!     check(&mut sources, &[file], Dialect::Pmi, &Disk, &Options::default());
//! assert!(diagnostics.is_empty());
//! let lowered = checked.and_then(|program| program.optimized(OptLevel::Speed).ok());
//! let (_engine, bytes_of_code) = lowered.and_then(|lowered| jit(&lowered).ok()).unwrap();
//! assert!(bytes_of_code > 0);
//! ```

mod args;
#[allow(
    clippy::indexing_slicing,
    reason = "nodes index tables made for them, blocks those of verified functions"
)]
pub mod bound;
mod changed_number;
mod commands;
pub mod compile;
mod debug_session;
pub mod disk;
mod failure;
mod fallback;
mod hal;
mod input;
pub mod later_code;
mod names;
mod object_args;
mod output;
mod plot;
mod proof;
pub mod recorded;
mod replay_input;
mod report;
mod running_program;
mod signing;

use std::panic::{self, AssertUnwindSafe};
use std::process::ExitCode;
use std::sync::Mutex;

use clap::Parser;

use failure::Failure;

/// Runs the command that the process's arguments name, and gives the exit status.
pub fn main() -> ExitCode {
    let cli = args::Cli::parse();
    let report = report::Report::new(cli.color);
    let result = catch_panics(|| run(cli.command, &report));
    ExitCode::from(match result {
        Ok(status) => status,
        Err(failure) => report.failure(&failure),
    })
}

/// Runs a command and gives its exit status.
fn run(command: args::Command, report: &report::Report) -> Result<u8, Failure> {
    let passes = args::PassArgs::default();
    match command {
        args::Command::Check(args) => commands::check::check(&args, report),
        args::Command::Build(args) => commands::build::build(&args, &passes, report),
        args::Command::Hal(args) => commands::hal::hal(&args, report),
        args::Command::Key { command } => commands::key::key(&command),
        args::Command::Run(args) => commands::run::run(&args, &passes, report),
        args::Command::Replay(args) => commands::replay::replay(&args, report),
        args::Command::Convert(args) => commands::convert::convert(&args, report),
        args::Command::Test(args) => commands::test::test(&args, report),
        args::Command::Plot(args) => commands::plot::plot(&args, report),
        args::Command::Bench(args) => commands::bench::bench(&args, &passes, report),
        args::Command::Dev { command } => commands::dev::dev(command, report),
        args::Command::Monitor(args) => commands::monitor::monitor(&args, report),
        args::Command::Debug => commands::debug::debug(),
        args::Command::Diff(args) => commands::diff::diff(&args, report),
        args::Command::Lsp => commands::lsp::lsp(report),
        args::Command::Explain(args) => commands::explain::explain(&args),
        args::Command::Export(args) => commands::export::export(&args, report),
        args::Command::Io(args) => commands::io::io(&args, report),
        args::Command::Why(args) => commands::why::why(&args, report),
        args::Command::Prove(args) => commands::prove::prove(&args, report),
        args::Command::Xref(args) => commands::xref::xref(&args, report),
        args::Command::Completions { shell } => commands::completions::completions(shell),
        args::Command::Man { dir } => commands::man::man(dir.as_deref()),
    }
}

/// Does the work and makes an internal error of a panic in it, since every panic is a mistake of the
/// compiler. The text that Rust prints for a panic is not shown.
fn catch_panics(work: impl FnOnce() -> Result<u8, Failure>) -> Result<u8, Failure> {
    static MESSAGE: Mutex<Option<String>> = Mutex::new(None);
    panic::set_hook(Box::new(|about| {
        let what = about.payload_as_str().unwrap_or("a panic without a message");
        let place = about.location().map(|place| format!(" (at {place})")).unwrap_or_default();
        if let Ok(mut message) = MESSAGE.lock() {
            message.get_or_insert(format!("{what}{place}"));
        }
    }));
    let result = panic::catch_unwind(AssertUnwindSafe(work));
    // Panics after this are reported as Rust does it.
    drop(panic::take_hook());
    result.unwrap_or_else(|_| {
        let message = MESSAGE.lock().ok().and_then(|mut message| message.take());
        Err(Failure::internal(message.unwrap_or_else(|| "a panic".into())))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_internal_error() {
        let result = catch_panics(|| panic!("index {} is missing", 7));
        let Err(Failure::Internal(message)) = result else { panic!("{result:?}") };
        assert!(message.starts_with("index 7 is missing (at cli/src/lib.rs:"), "{message}");
    }
}
