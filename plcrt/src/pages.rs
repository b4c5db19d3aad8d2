//! The manual page and the completions for shells.
//!
//! They are made from the options when a test is run with `BLESS=1`, and kept in `pages.lz4`: what makes
//! them is larger than they are, and has no place on a controller.

use std::ops::Range;

/// The shells for which there are completions.
pub(crate) const SHELLS: [&str; 5] = ["bash", "elvish", "fish", "powershell", "zsh"];
/// The name of the manual page among the pages.
pub(crate) const MANUAL: &str = "man";

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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic)]

    use clap::CommandFactory;
    use clap_complete::Shell;

    use super::*;
    use crate::Cli;

    fn made() -> Vec<(&'static str, Vec<u8>)> {
        let mut pages = vec![];
        for shell in SHELLS {
            let mut script = vec![];
            let kind: Shell = shell.parse().unwrap();
            clap_complete::generate(kind, &mut Cli::command(), "plcrt", &mut script);
            pages.push((shell, script));
        }
        let mut manual = vec![];
        // The synopsis is that of --help: clap_mangen's own names options without their values.
        let mut command = Cli::command();
        let usage = command.render_usage().to_string();
        let command = command.override_usage(usage.trim_start_matches("Usage: ").to_owned());
        clap_mangen::Man::new(command).render(&mut manual).unwrap();
        pages.push((MANUAL, manual));
        pages
    }

    /// `BLESS=1 cargo test -p plcrt` makes them anew.
    #[test]
    fn the_pages_are_those_of_the_options() {
        let made = made();
        if std::env::var_os("BLESS").is_some() {
            let list: Vec<_> = made.iter().map(|(name, p)| format!("{name} {}", p.len())).collect();
            let mut all = format!("{}\n\n", list.join("\n")).into_bytes();
            made.iter().for_each(|(_, page)| all.extend(page));
            let path = concat!(env!("CARGO_MANIFEST_DIR"), "/src/pages.lz4");
            std::fs::write(path, lz4_flex::compress_prepend_size(&all)).unwrap();
            return;
        }
        for (name, text) in made {
            let same = page(name).is_some_and(|page| page == text);
            assert!(same, "{name}: the options have changed; BLESS=1 cargo test -p plcrt");
        }
        assert_eq!(page("none"), None);
    }
}
