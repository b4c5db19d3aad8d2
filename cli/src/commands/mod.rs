//! The commands, a file each.

pub(crate) mod bench;
pub(crate) mod bound;
pub(crate) mod build;
pub(crate) mod check;
pub(crate) mod completions;
pub(crate) mod convert;
pub(crate) mod debug;
pub(crate) mod dev;
pub(crate) mod diff;
pub(crate) mod explain;
pub(crate) mod export;
pub(crate) mod hal;
pub(crate) mod io;
pub(crate) mod key;
pub(crate) mod lsp;
mod lsp_run;
pub(crate) mod man;
pub(crate) mod monitor;
pub(crate) mod plot;
pub(crate) mod prove;
pub(crate) mod replay;
pub(crate) mod run;
pub(crate) mod test;
mod validation;
pub(crate) mod why;
pub(crate) mod xref;
