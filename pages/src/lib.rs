//! Manual pages and completions for shells, made from the options of a program.
//!
//! ```
//! let program = clap::Command::new("plcx").subcommand(clap::Command::new("run"));
//! let pages = plcc_pages::manuals(program.clone())?;
//! let names: Vec<&str> = pages.iter().map(|(name, _)| name.as_str()).collect();
//! assert_eq!(names, ["plcx", "plcx-run"]);
//! assert!(!plcc_pages::completions(program, plcc_pages::Shell::Bash).is_empty());
//! # Ok::<(), std::io::Error>(())
//! ```

use std::path::Path;
use std::{fs, io};

use clap::Command;
pub use clap_complete::Shell;

/// The script by which a shell completes the commands and options of a program.
#[must_use]
pub fn completions(mut program: Command, shell: Shell) -> Vec<u8> {
    let mut script = Vec::new();
    let name = program.get_name().to_owned();
    clap_complete::generate(shell, &mut program, name, &mut script);
    script
}

/// The manual pages of a program, its own first and then one for each of its commands, with their names
/// without the section: `plcc`, `plcc-run`. They are texts for roff.
///
/// # Errors
/// None in practice: a page is written to memory.
pub fn manuals(mut program: Command) -> io::Result<Vec<(String, Vec<u8>)>> {
    // Each command gets its full name and the common options only when the whole is built.
    program.build();
    let commands = program.get_subcommands();
    let commands =
        commands.filter(|command| command.get_name() != "help" && !command.is_hide_set());
    let named = |command: &Command| {
        let name = command.get_display_name().unwrap_or_else(|| command.get_name());
        Ok((name.replace(' ', "-"), manual(command)?))
    };
    std::iter::once(&program).chain(commands).map(named).collect()
}

/// The manual page of one command that has been built.
fn manual(command: &Command) -> io::Result<Vec<u8>> {
    let mut page = Vec::new();
    // The synopsis is that of --help: clap_mangen's own names options without their values.
    let mut command = command.clone();
    let usage = command.render_usage().to_string();
    let command = command.override_usage(usage.trim_start_matches("Usage: ").to_owned());
    clap_mangen::Man::new(command).render(&mut page)?;
    Ok(page)
}

/// Writes the pages that [`manuals`] has made into a folder, which is made if it is not there: `NAME.1` each.
///
/// # Errors
/// When the folder or a file can't be written.
pub fn write(folder: &Path, pages: &[(String, Vec<u8>)]) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    pages.iter().try_for_each(|(name, page)| fs::write(folder.join(format!("{name}.1")), page))
}
