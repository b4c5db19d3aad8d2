//! The manual page and the completions for shells.
//!
//! They are made from the options when a test is run with `BLESS=1`, and kept in `pages.lz4`: what makes
//! them is larger than they are, and has no place on a controller.

use std::ops::Range;
use std::path::Path;
use std::{fs, io};

/// The shells for which there are completions.
pub(crate) const SHELLS: [&str; 5] = ["bash", "elvish", "fish", "powershell", "zsh"];
/// The name of the manual page among the pages.
pub(crate) const MANUAL: &str = "man";
/// The names of all manual pages, the program's own and those of its commands.
const MANUALS: [&str; 7] = [
    MANUAL,
    "man-run",
    "man-check-config",
    "man-info",
    "man-dump-image",
    "man-man",
    "man-completions",
];

/// For each page a line `NAME LENGTH`, an empty line, and then the pages; all compressed.
static PAGES: &[u8] = include_bytes!("pages.lz4");

/// A page by its name: `man` or a shell.
pub(crate) fn page(name: &str) -> Option<Vec<u8>> {
    let all = lz4_flex::decompress_size_prepended(PAGES).ok()?;
    let head = all.windows(2).position(|two| two == b"\n\n")?;
    let (list, pages) = (all.get(..head)?, all.get(head + 2..)?);
    let mut at = 0_usize;
    for line in std::str::from_utf8(list).ok()?.lines() {
        let (known, length) = line.split_once(' ')?;
        let place: Range<usize> = at..at + length.parse::<usize>().ok()?;
        if known == name {
            return pages.get(place).map(<[u8]>::to_vec);
        }
        at = place.end;
    }
    None
}

/// Writes the manual pages of all commands into a folder, which is made if it is not there: `NAME.1` each.
///
/// # Errors
/// When the folder or a file can't be written.
pub(crate) fn write(folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    MANUALS.iter().try_for_each(|name| {
        let file = name.replacen(MANUAL, "plcrt", 1);
        fs::write(folder.join(format!("{file}.1")), page(name).unwrap_or_default())
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic)]

    use clap::CommandFactory;
    use plcc_pages::Shell;

    use super::*;
    use crate::args::Cli;

    /// The options of `run` stand in the program's own page, since `plcrt ARTIFACT` is short for it.
    fn made() -> Vec<(String, Vec<u8>)> {
        let mut pages = vec![];
        for shell in SHELLS {
            let kind: Shell = shell.parse().unwrap();
            pages.push((shell.to_owned(), plcc_pages::completions(Cli::command(), kind)));
        }
        let cli = Cli::command();
        let run = cli.find_subcommand("run").unwrap().clone();
        let usage = "plcrt [OPTIONS] [ARTIFACT]\n       plcrt COMMAND …";
        let own = cli.args(run.get_arguments()).override_usage(usage);
        for (name, page) in plcc_pages::manuals(own).unwrap() {
            pages.push((name.replacen("plcrt", MANUAL, 1), page));
        }
        pages
    }

    /// `BLESS=1 cargo test -p plcrt --bin plcrt` makes them anew.
    #[test]
    fn the_pages_are_those_of_the_options() {
        let made = made();
        let manuals = made.iter().skip(SHELLS.len()).map(|(name, _)| name.as_str());
        assert!(manuals.eq(MANUALS));
        if std::env::var_os("BLESS").is_some() {
            let list: Vec<_> = made.iter().map(|(name, p)| format!("{name} {}", p.len())).collect();
            let mut all = format!("{}\n\n", list.join("\n")).into_bytes();
            made.iter().for_each(|(_, page)| all.extend(page));
            let path = concat!(env!("CARGO_MANIFEST_DIR"), "/src/pages.lz4");
            std::fs::write(path, lz4_flex::compress_prepend_size(&all)).unwrap();
            return;
        }
        for (name, text) in made {
            let same = page(&name).is_some_and(|page| page == text);
            assert!(
                same,
                "{name}: the options have changed; BLESS=1 cargo test -p plcrt --bin plcrt"
            );
        }
        assert_eq!(page("none"), None);
    }
}
