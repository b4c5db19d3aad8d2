//! The options of the commands that connect a program with its machine: `plcc io` and `plcc hal`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::SourceArgs;
use crate::hal::pins::Wanted;

#[derive(Args)]
pub(crate) struct IoArgs {
    /// The source, - is standard input; several files are one PMAC download, in their order
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,

    /// What is written: entries [[io]] to fill in, or a list of the terminals, as a table or as a page to print and tick off
    #[arg(long, value_name = "FORMAT", default_value = "toml")]
    pub(crate) to: IoFormat,

    /// The configuration of the control, whose entries [[io]] say the new point of each line in the list
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) config: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
}

/// What `plcc io` writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum IoFormat {
    /// Entries [[io]] of a configuration
    #[default]
    Toml,
    /// A list of the terminals for a spreadsheet
    Csv,
    /// A list of the terminals as a page to print
    Html,
}

#[derive(Args)]
pub(crate) struct HalArgs {
    /// The source, - is standard input; several files are one PMAC download, in their order
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,

    /// The folder for the component [default: NAME-hal in the current folder]
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,

    /// The component's name [default: the first source's name without its ending]
    #[arg(long, value_name = "NAME")]
    pub(crate) name: Option<String>,

    /// Makes a pin of a variable that has none by itself, or changes its direction (repeatable)
    #[arg(long, value_name = "VARIABLE[=in|out|io]", value_parser = crate::commands::hal::wanted_pin)]
    pub(crate) pin: Vec<Wanted>,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
}
