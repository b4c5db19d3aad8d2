//! The options of `plcc diff`.

use std::path::PathBuf;

use clap::Args;

use super::SourceArgs;

#[derive(Args)]
pub(crate) struct DiffArgs {
    /// The old version: a source, or an artifact that holds the text of its sources
    #[arg(value_name = "OLD")]
    pub(crate) old: PathBuf,

    /// The new version, likewise
    #[arg(value_name = "NEW")]
    pub(crate) new: PathBuf,

    /// Writes a page for browsers, the two versions side by side (- is standard output)
    #[arg(long, value_name = "OUT.html")]
    pub(crate) html: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
}
