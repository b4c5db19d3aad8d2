//! Diagnostics and failures, for people and for programs.

use std::cell::Cell;
use std::fmt::Write as _;
use std::io::{self, IsTerminal, Write};

use clap::ColorChoice;
use plcc_diag::{Diagnostic, Severity, SourceMap, json, render};

use crate::args::FormatArg;
use crate::failure::{Failure, USAGE};

/// So many diagnostics are drawn; the rest are counted.
const DRAWN: usize = 100;

/// How many of each kind there were.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Count {
    pub(crate) errors: usize,
    pub(crate) warnings: usize,
}

impl Count {
    pub(crate) fn of(diagnostics: &[Diagnostic]) -> Self {
        let count = |severity| diagnostics.iter().filter(|d| d.severity == severity).count();
        Self { errors: count(Severity::Error), warnings: count(Severity::Warning) }
    }

    pub(crate) fn add(&mut self, other: Self) {
        self.errors += other.errors;
        self.warnings += other.warnings;
    }
}

impl std::fmt::Display for Count {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let plural = |n: usize| if n == 1 { "" } else { "s" };
        let Self { errors, warnings } = *self;
        match (errors, warnings) {
            (0, 0) => f.write_str("no errors"),
            (0, w) => write!(f, "no errors, {w} warning{}", plural(w)),
            (e, 0) => write!(f, "{e} error{}", plural(e)),
            (e, w) => write!(f, "{e} error{}, {w} warning{}", plural(e), plural(w)),
        }
    }
}

/// Where and how things are said.
pub(crate) struct Report {
    color: bool,
    drawn: Cell<usize>,
}

impl Report {
    pub(crate) fn new(color: ColorChoice) -> Self {
        let color = match color {
            ColorChoice::Always => true,
            ColorChoice::Never => false,
            ColorChoice::Auto => {
                io::stderr().is_terminal()
                    && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
                    && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
            }
        };
        Self { color, drawn: Cell::new(0) }
    }

    /// Says why a command failed, and gives its exit status.
    pub(crate) fn failure(&self, failure: &Failure) -> u8 {
        match failure {
            Failure::Usage(message) => {
                self.tell(&format!("{}: {message}", self.paint("error", "31;1")));
                USAGE
            }
            Failure::Closed => 0,
        }
    }

    /// A line for people, on standard error. That nobody reads it changes nothing.
    pub(crate) fn tell(&self, line: &str) {
        let _ = writeln!(io::stderr(), "{line}");
    }

    /// A warning of the command's own.
    pub(crate) fn warn(&self, message: &str) {
        self.tell(&format!("{}: {message}", self.paint("warning", "33;1")));
    }

    fn paint(&self, word: &str, style: &str) -> String {
        if self.color { format!("\u{1b}[{style}m{word}\u{1b}[0m") } else { word.into() }
    }

    /// Shows diagnostics.
    pub(crate) fn show(
        &self,
        sources: &SourceMap,
        diagnostics: &[Diagnostic],
        format: FormatArg,
    ) -> Result<Count, Failure> {
        let count = Count::of(diagnostics);
        match format {
            FormatArg::Json => {
                let mut out = io::BufWriter::new(io::stdout().lock());
                for diagnostic in diagnostics {
                    writeln!(out, "{}", json::line(sources, diagnostic))?;
                }
                out.flush()?;
            }
            FormatArg::Human => {
                let room = DRAWN.saturating_sub(self.drawn.get());
                let mut text = String::new();
                for diagnostic in diagnostics.iter().take(room) {
                    text.push_str(&render::draw(sources, diagnostic, self.color));
                }
                let rest = diagnostics.len().saturating_sub(room);
                if rest > 0 {
                    let _ = writeln!(
                        text,
                        "… and {rest} more; `plcc check --message-format json` prints all"
                    );
                }
                self.drawn.set(self.drawn.get() + diagnostics.len().min(room));
                let _ = io::stderr().write_all(text.as_bytes());
            }
        }
        Ok(count)
    }
}
