//! `plcc completions`: prints completions for a shell.

use clap::CommandFactory;
use clap_complete::Shell;

use crate::args::Cli;
use crate::failure::{DONE, Failure};
use crate::output;

pub(crate) fn completions(shell: Shell) -> Result<u8, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "plcc", &mut script);
    output::print(&script)?;
    Ok(DONE)
}
