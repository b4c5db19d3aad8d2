//! The options of the commands that connect a program with its machine: `plcc io` and `plcc hal`.

use std::path::PathBuf;

use clap::Args;

use super::SourceArgs;
use crate::hal::pins::Wanted;

#[derive(Args)]
pub(crate) struct IoArgs {
    /// The source, - is standard input; several files are one PMAC download, in their order
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
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
