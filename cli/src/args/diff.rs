//! The options of `plcc diff`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use plcc_abi::time::duration;
use plcc_control::ControlArgs;

use super::SourceArgs;

#[derive(Args)]
pub(crate) struct DiffArgs {
    /// The old version: a source, an artifact that holds the text of its sources, a record, or the socket of a control that
    /// keeps a record
    #[arg(value_name = "OLD")]
    pub(crate) old: PathBuf,

    /// The new version, likewise
    #[arg(value_name = "NEW")]
    pub(crate) new: PathBuf,

    /// Writes a page for browsers, the two versions side by side (- is standard output)
    #[arg(long, value_name = "OUT.html")]
    pub(crate) html: Option<PathBuf>,

    /// Decides for each output and retained variable whether it can differ, for all inputs
    #[arg(long, conflicts_with = "html")]
    pub(crate) prove: bool,

    /// How long --prove may search for the answer to each, as in 500ms, 10s or 2min
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = duration, requires = "prove")]
    pub(crate) timeout: Duration,

    /// The folder for the stimuli of --prove [default: the current folder]
    #[arg(short = 'o', long, value_name = "DIR", requires = "prove")]
    pub(crate) out: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) control: ControlArgs,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
}
