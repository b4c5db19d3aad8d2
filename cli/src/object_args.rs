//! The options of `plcc build --emit obj`.

use clap::Args;

/// How an object is made.
#[derive(Args)]
pub(crate) struct ObjectArgs {
    /// --emit obj: what the names of its symbols begin with, so that several objects can be linked
    /// together [default: plcc]
    #[arg(long, value_name = "NAME")]
    pub(crate) prefix: Option<String>,

    /// --emit obj: paths for debuggers that begin with the folder OLD begin with NEW instead
    /// (repeatable)
    #[arg(long, value_name = "OLD=NEW")]
    pub(crate) debug_prefix_map: Vec<String>,
}
