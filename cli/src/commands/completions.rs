//! `plcc completions`: prints completions for a shell.

use clap::CommandFactory;
use plcc_pages::Shell;

use crate::args::Cli;
use crate::failure::{DONE, Failure};
use crate::output;

pub(crate) fn completions(shell: Shell) -> Result<u8, Failure> {
    output::print(&plcc_pages::completions(Cli::command(), shell))?;
    Ok(DONE)
}
