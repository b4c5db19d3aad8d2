//! The options of `plcc plot`.

use std::path::PathBuf;

use clap::Args;

#[derive(Args)]
pub(crate) struct PlotArgs {
    /// The trace, a table that `--trace` has written; - is standard input
    #[arg(value_name = "TRACE.csv")]
    pub(crate) trace: PathBuf,

    /// The picture (- is standard output)
    #[arg(short, long, value_name = "OUT.svg")]
    pub(crate) output: PathBuf,
}
