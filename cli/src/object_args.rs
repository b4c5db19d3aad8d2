//! The options of `plcc build` that concern linkers and debuggers.

use clap::Args;

/// How an object is made, and what debuggers are told of an artifact.
#[derive(Args)]
pub(crate) struct ObjectArgs {
    /// --emit obj: what the names of its symbols begin with, so that several objects can be linked
    /// together [default: plcc]
    #[arg(long, value_name = "NAME")]
    pub(crate) prefix: Option<String>,

    /// Paths for debuggers that begin with the folder OLD begin with NEW instead (repeatable)
    #[arg(long, value_name = "OLD=NEW")]
    pub(crate) debug_prefix_map: Vec<String>,

    /// Leaves out of the artifact what --gdb needs: the lines, types and folder of the sources
    #[arg(long)]
    pub(crate) no_debug: bool,

    /// Leaves the text of the sources out of the artifact, which the monitor, the debugger and replays need
    #[arg(long)]
    pub(crate) no_source: bool,
}
