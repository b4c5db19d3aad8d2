//! The options of `plcc export`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::SourceArgs;

/// The form in which a program is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExportFormat {
    /// Structured Text of IEC 61131-3, STEM.st
    St,
    /// PLCopen XML (TC6, version 2.01), STEM.xml
    Plcopen,
}

#[derive(Args)]
pub(crate) struct ExportArgs {
    /// The source; for PMAC the files of a download, in their order
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,

    /// The form in which it is written
    #[arg(long, value_name = "FORMAT")]
    pub(crate) to: ExportFormat,

    /// The folder for the file, which is made where it does not exist [default: the current folder]
    #[arg(short = 'o', long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
}
