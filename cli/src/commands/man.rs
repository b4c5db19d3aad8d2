//! `plcc man`: prints the manual page, or writes a page for each command into a folder.

use std::path::Path;
use std::{fs, io};

use clap::CommandFactory;

use crate::args::Cli;
use crate::failure::{DONE, Failure};
use crate::output;

/// Prints the manual page of plcc, or writes the pages of all commands into a folder.
pub(crate) fn man(dir: Option<&Path>) -> Result<u8, Failure> {
    // Clap gives each command its full name and the common options only when it builds the whole.
    let mut command = Cli::command();
    command.build();
    let Some(dir) = dir else {
        output::print(&page(&command).map_err(|error| Failure::usage(error.to_string()))?)?;
        return Ok(DONE);
    };
    let write = |command: &clap::Command| {
        let name = command.get_display_name().unwrap_or_else(|| command.get_name());
        fs::write(dir.join(format!("{}.1", name.replace(' ', "-"))), page(command)?)
    };
    let mut commands = command.get_subcommands().filter(|command| command.get_name() != "help");
    let written = fs::create_dir_all(dir)
        .and_then(|()| write(&command))
        .and_then(|()| commands.try_for_each(write));
    written.map_err(|error| Failure::file(dir, format!("the pages can't be written: {error}")))?;
    Ok(DONE)
}

fn page(command: &clap::Command) -> io::Result<Vec<u8>> {
    let mut page = Vec::new();
    // The synopsis is that of --help: clap_mangen's own names options without their values.
    let mut command = command.clone();
    let usage = command.render_usage().to_string();
    let command = command.override_usage(usage.trim_start_matches("Usage: ").to_owned());
    clap_mangen::Man::new(command).render(&mut page)?;
    Ok(page)
}
