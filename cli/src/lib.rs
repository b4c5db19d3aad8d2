//! The command line of plcc, and [`compile`], the one place where the languages are told apart.

mod args;
mod commands;
pub mod compile;
pub mod detect;
pub mod disk;
mod failure;
mod input;
mod output;
mod report;

use std::process::ExitCode;

use clap::Parser;

/// Does what the command line says.
pub fn main() -> ExitCode {
    let cli = args::Cli::parse();
    let report = report::Report::new(cli.color);
    let result = match cli.command {
        args::Command::Check(args) => commands::check::check(&args, &report),
        args::Command::Build(args) => commands::build::build(&args, &report),
        args::Command::Run(args) => commands::run::run(&args, &report),
        args::Command::Bench(args) => commands::bench::bench(&args, &report),
        args::Command::Explain(args) => commands::explain::explain(&args),
        args::Command::Xref(args) => commands::xref::xref(&args, &report),
        args::Command::Completions { shell } => commands::completions::completions(shell),
    };
    ExitCode::from(match result {
        Ok(status) => status,
        Err(failure) => report.failure(&failure),
    })
}
