//! Diagnostics and failures, for people and for programs.

use std::io::{self, IsTerminal, Write};

use clap::ColorChoice;
use plcc_abi::printable;
use plcc_diag::{Diagnostic, Severity, SourceMap, json, render};

use crate::args::FormatArg;
use crate::compile::CompileError;
use crate::failure::{ERRORS, Failure, command_line};
use crate::output::unless_closed;

/// At most this many diagnostics are drawn; the rest are counted.
const MAX_DRAWN: usize = 100;

/// How many errors and warnings there were.
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
        let Self { errors, warnings } = *self;
        match (errors, warnings) {
            (0, 0) => f.write_str("no errors"),
            (0, w) => write!(f, "no errors, {}", count_of(w, "warning")),
            (e, 0) => f.write_str(&count_of(e, "error")),
            (e, w) => write!(f, "{}, {}", count_of(e, "error"), count_of(w, "warning")),
        }
    }
}

/// Writes diagnostics, messages and failures for the user.
pub(crate) struct Report {
    color: bool,
    /// Whether results on standard output are coloured.
    colored_results: bool,
}

impl Report {
    pub(crate) fn new(color: ColorChoice) -> Self {
        let is_colored = |is_terminal: bool| match color {
            ColorChoice::Always => true,
            ColorChoice::Never => false,
            ColorChoice::Auto => {
                is_terminal
                    && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
                    && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
            }
        };
        let color = is_colored(io::stderr().is_terminal());
        Self { color, colored_results: is_colored(io::stdout().is_terminal()) }
    }

    /// Writes why a command failed, and gives its exit status.
    pub(crate) fn failure(&self, failure: &Failure) -> u8 {
        let message = failure.text(&command_line());
        self.line("error", "31;1", &message);
        failure.status()
    }

    /// Writes a line for people to standard error. That it can't be written changes nothing.
    pub(crate) fn message(&self, line: &str) {
        let _ = writeln!(io::stderr(), "{}", printable(line));
    }

    /// Writes a line that begins with a word in colour, in the style of an escape sequence.
    fn line(&self, word: &str, style: &str, message: &str) {
        let word = self.paint(word, style);
        let _ = writeln!(io::stderr(), "{word}: {}", printable(message));
    }

    /// A note of the command's own.
    pub(crate) fn note(&self, message: &str) {
        self.line("note", "36;1", message);
    }

    /// A warning of the command's own.
    pub(crate) fn warn(&self, message: &str) {
        self.line("warning", "33;1", message);
    }

    /// A word of a result for standard output, in colour in the style of an escape sequence.
    pub(crate) fn paint_result(&self, word: &str, style: &str) -> String {
        if self.colored_results { format!("\u{1b}[{style}m{word}\u{1b}[0m") } else { word.into() }
    }

    fn paint(&self, word: &str, style: &str) -> String {
        if self.color { format!("\u{1b}[{style}m{word}\u{1b}[0m") } else { word.into() }
    }

    /// Shows a program's diagnostics and counts them.
    ///
    /// # Errors
    /// When they are to be written to standard output and can't be.
    pub(crate) fn show(
        &self,
        sources: &SourceMap,
        diagnostics: &[Diagnostic],
        to: Destination,
    ) -> Result<Count, Failure> {
        self.show_all(&[(sources, diagnostics)], to)
    }

    /// Deals with a checked program that could not be compiled: if it is too long, shows the diagnostic
    /// that says where, and gives the exit status.
    ///
    /// # Errors
    /// When there is another reason, as that.
    pub(crate) fn not_compiled(
        &self,
        error: CompileError,
        sources: &SourceMap,
        to: Destination,
    ) -> Result<u8, Failure> {
        match error {
            CompileError::TooLong(diagnostic) => {
                self.show(sources, &[*diagnostic], to)?;
                Ok(ERRORS)
            }
            other => Err(other.into()),
        }
    }

    /// Shows the diagnostics of several programs and counts them. As JSON all are written; for people
    /// the first hundred are drawn and the rest is counted. If there are more than a hundred, errors
    /// are chosen before warnings, and warnings before notes.
    ///
    /// # Errors
    /// When they are to be written to standard output and can't be.
    pub(crate) fn show_all(&self, all: &[Findings<'_>], to: Destination) -> Result<Count, Failure> {
        let mut count = Count::default();
        all.iter().for_each(|(_, diagnostics)| count.add(Count::of(diagnostics)));
        match (to.format, to.stdout_taken) {
            (FormatArg::Json, false) => unless_closed(lines(all, io::stdout().lock()))?,
            // Where standard error can't be written, the exit status says it all.
            (FormatArg::Json, true) => drop(lines(all, io::stderr().lock())),
            (FormatArg::Human, _) => drop(self.draw(all, io::stderr().lock())),
        }
        Ok(count)
    }

    fn draw(&self, all: &[Findings<'_>], out: impl Write) -> io::Result<()> {
        let mut out = io::BufWriter::new(out);
        let each =
            || all.iter().flat_map(|(sources, found)| found.iter().map(move |d| (sources, d)));
        // How many of each severity are drawn.
        let mut room = [Severity::Error, Severity::Warning, Severity::Note]
            .map(|severity| (severity, each().filter(|(_, d)| d.severity == severity).count()));
        let mut left = MAX_DRAWN;
        for (_, room) in &mut room {
            *room = left.min(*room);
            left -= *room;
        }
        // The others: for each file the numbers of its errors, warnings and notes.
        let mut rest: Vec<(&str, [usize; 3])> = Vec::new();
        for (sources, diagnostic) in each() {
            let kind = room.iter().position(|(of, _)| *of == diagnostic.severity).unwrap_or(0);
            if let Some((_, room)) = room.get_mut(kind).filter(|(_, room)| *room > 0) {
                *room -= 1;
                out.write_all(render::draw(sources, diagnostic, self.color).as_bytes())?;
                continue;
            }
            let path = sources.path(diagnostic.span.file);
            if rest.last().is_none_or(|(last, _)| *last != path) {
                rest.push((path, [0; 3]));
            }
            if let Some(n) = rest.last_mut().and_then(|(_, counts)| counts.get_mut(kind)) {
                *n += 1;
            }
        }
        if !rest.is_empty() {
            writeln!(out, "Only {MAX_DRAWN} are shown. There are further ones:")?;
            for (path, counts) in rest {
                let kinds = ["error", "warning", "note"];
                let parts = counts.iter().zip(kinds).filter(|(n, _)| **n > 0);
                let parts: Vec<String> = parts.map(|(n, kind)| count_of(*n, kind)).collect();
                writeln!(out, "  {path}: {}", parts.join(", "))?;
            }
            writeln!(out, "`plcc check --message-format json` prints them all.")?;
        }
        out.flush()
    }
}

/// The source texts of a program, and the diagnostics for them.
pub(crate) type Findings<'a> = (&'a SourceMap, &'a [Diagnostic]);

/// How diagnostics are written, and where.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Destination {
    /// For people or for programs.
    pub(crate) format: FormatArg,
    /// Whether the results of the command go to standard output, so that lines of JSON have to go to
    /// standard error.
    pub(crate) stdout_taken: bool,
}

impl From<FormatArg> for Destination {
    fn from(format: FormatArg) -> Self {
        Self { format, stdout_taken: false }
    }
}

/// The command line as it was given, its words divided by blanks.
/// `1 error`, `2 errors`.
pub(crate) fn count_of(n: usize, word: &str) -> String {
    format!("{n} {word}{}", if n == 1 { "" } else { "s" })
}

/// Every diagnostic as a line of JSON.
fn lines(all: &[Findings<'_>], out: impl Write) -> io::Result<()> {
    let mut out = io::BufWriter::with_capacity(1 << 16, out);
    for (sources, diagnostics) in all {
        for diagnostic in *diagnostics {
            writeln!(out, "{}", json::line(sources, diagnostic))?;
        }
    }
    out.flush()
}

#[cfg(test)]
mod tests {
    use plcc_diag::Span;

    use super::*;

    #[test]
    fn the_first_hundred_are_drawn_errors_before_warnings() {
        let mut sources = SourceMap::new();
        let file = sources.add("a.pmi", b"A = B\n");
        let span = Span::new(file, 0, 1);
        let mut found = vec![Diagnostic::warning("PMI-W1", span, "long line"); 150];
        found.push(Diagnostic::error("PMI-31", span, "what is it"));
        let mut text = Vec::new();
        Report { color: false, colored_results: false }
            .draw(&[(&sources, &found)], &mut text)
            .unwrap();
        let text = String::from_utf8(text).unwrap();
        assert_eq!(text.matches("[PMI-W1]").count(), 99);
        assert_eq!(text.matches("[PMI-31]").count(), 1);
        assert!(text.contains("a.pmi: 51 warnings"), "{text}");
    }
}
