//! `plcc man`: prints the manual page, or writes a page for each command into a folder.

use std::path::Path;

use clap::CommandFactory;

use crate::args::Cli;
use crate::failure::{DONE, Failure};
use crate::output;

/// Prints the manual page of plcc, or writes the pages of all commands into a folder.
pub(crate) fn man(dir: Option<&Path>) -> Result<u8, Failure> {
    let pages = plcc_pages::manuals(Cli::command());
    let pages = pages.map_err(|error| Failure::usage(error.to_string()))?;
    match dir {
        None => output::print(pages.first().map_or(&[][..], |(_, page)| page))?,
        Some(dir) => plcc_pages::write(dir, &pages)
            .map_err(|error| Failure::file(dir, format!("the pages can't be written: {error}")))?,
    }
    Ok(DONE)
}
