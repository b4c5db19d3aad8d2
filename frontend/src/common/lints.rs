//! Which lints are shown: the levels that the user chose, and the comments in a source that silence
//! a lint for one statement.

use std::collections::HashMap;

use plcc_diag::{
    Diagnostic, FileId, Severity, SourceMap, Span,
    lints::{LINTS, Level, Lint, find_lint, lint_of_code},
};

use super::{Machine, closest};

/// The levels of lints that the user chose. A lint for which nothing was chosen has its
/// [default](Lint::default).
#[derive(Clone, Debug, Default)]
pub struct LintLevels {
    chosen: HashMap<&'static str, Level>,
    /// Whether every warning is an error (`--deny warnings`).
    pub deny_warnings: bool,
}

impl LintLevels {
    /// No lint at all.
    pub fn none() -> Self {
        let chosen = LINTS.iter().map(|lint| (lint.name, Level::Allow)).collect();
        Self { chosen, deny_warnings: false }
    }

    /// The levels that a machine file chooses under `[lints]`.
    ///
    /// # Errors
    /// When it names a lint or a level that does not exist; the message says what does.
    pub fn of_machine(machine: &Machine) -> Result<Self, String> {
        let mut levels = Self::default();
        for (name, level) in &machine.lints {
            let lint = find_lint(name).ok_or_else(|| {
                let near = closest(name, LINTS.iter().map(|lint| lint.name));
                let near =
                    near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
                format!("[lints]: there is no lint `{name}`{near}")
            })?;
            let level = Level::from_name(level).ok_or_else(|| {
                format!("[lints]: {name} is \"allow\", \"warn\" or \"deny\", not \"{level}\"")
            })?;
            levels.set(lint, level);
        }
        Ok(levels)
    }

    /// Chooses the level of a lint. A later choice takes the place of an earlier one.
    pub fn set(&mut self, lint: &Lint, level: Level) {
        self.chosen.insert(lint.name, level);
    }

    fn level(&self, lint: &Lint) -> Level {
        self.chosen.get(lint.name).copied().unwrap_or(lint.default)
    }

    /// Takes out the diagnostics of lints that are allowed, or that a comment silences, and makes
    /// errors of those that are denied.
    ///
    /// `comment_marks` are the signs with which a comment begins that goes on to the end of its line;
    /// `continuation` is the sign at the end of a line whose statement goes on in the next one.
    pub(crate) fn apply(
        &self,
        sources: &SourceMap,
        diagnostics: &mut Vec<Diagnostic>,
        comment_marks: &[&str],
        continuation: Option<char>,
    ) {
        let mut silenced: HashMap<FileId, Silenced> = HashMap::new();
        diagnostics.retain_mut(|diagnostic| {
            if diagnostic.severity != Severity::Warning {
                return true;
            }
            if let Some(lint) = lint_of_code(diagnostic.code) {
                let level = self.level(lint);
                let Span { file, start, .. } = diagnostic.span;
                let places = silenced
                    .entry(file)
                    .or_insert_with(|| silenced_in(sources, file, comment_marks, continuation));
                let line = sources.line(file, start);
                if level == Level::Allow || places.contains(lint.name, line) {
                    return false;
                }
                if level == Level::Deny {
                    diagnostic.severity = Severity::Error;
                }
            }
            if self.deny_warnings {
                diagnostic.severity = Severity::Error;
            }
            true
        });
    }
}

/// The lines of a file in which comments silence lints.
#[derive(Default)]
struct Silenced {
    /// For each lint, by its name in lower case: the first and the last line that a comment is for,
    /// in the order of the comments. The last lines do not fall either.
    ranges: HashMap<String, Vec<(u32, u32)>>,
}

impl Silenced {
    /// Whether a lint, by its name, is silenced in a line.
    fn contains(&self, lint: &str, line: u32) -> bool {
        let Some(ranges) = self.ranges.get(lint) else { return false };
        let after = ranges.partition_point(|(first, _)| *first <= line);
        let before = after.checked_sub(1).and_then(|at| ranges.get(at));
        before.is_some_and(|(_, last)| line <= *last)
    }
}

/// The comments of a file that silence lints: `? plcc: allow NAME, NAME`. Such a comment is for the
/// statement that it follows, and for the next one.
fn silenced_in(
    sources: &SourceMap,
    file: FileId,
    comment_marks: &[&str],
    continuation: Option<char>,
) -> Silenced {
    let mut silenced = Silenced::default();
    if !sources.text(file).contains("plcc:") {
        return silenced;
    }
    let split = |line| split_comment(sources.line_text(file, line), comment_marks);
    // From the end of the file to its beginning, since what a comment is for comes after it. The
    // next statement ends in the next line that has more than a comment, and goes on where a line ends
    // with the sign of continuation.
    let mut next_end = sources.line_count(file);
    for line in (1..=next_end).rev() {
        let (code, comment) = split(line);
        let code = code.trim_end();
        let first = if code.trim_start().is_empty() { line + 1 } else { line };
        for name in allowed_names(comment).into_iter().flatten() {
            let ranges = silenced.ranges.entry(name.to_ascii_lowercase()).or_default();
            ranges.push((first, next_end.max(line)));
        }
        let goes_on = continuation.is_some_and(|sign| code.ends_with(sign));
        if !code.is_empty() && !goes_on {
            next_end = line;
        }
    }
    for ranges in silenced.ranges.values_mut() {
        ranges.reverse();
    }
    silenced
}

/// A line's part before its comment, and the comment after its mark. A mark inside a text in quotes
/// counts too. That matters only for a text that contains `plcc: allow` after such a mark.
fn split_comment<'a>(line: &'a str, marks: &[&str]) -> (&'a str, &'a str) {
    let first = marks.iter().filter_map(|mark| Some((line.find(mark)?, mark.len()))).min();
    match first {
        Some((at, len)) => (line.get(..at).unwrap_or(""), line.get(at + len..).unwrap_or("")),
        None => (line, ""),
    }
}

/// The names of lints after `plcc: allow` in a comment.
fn allowed_names(comment: &str) -> Option<impl Iterator<Item = &str>> {
    let rest = comment.trim_start().strip_prefix("plcc:")?.trim_start();
    let names = rest.strip_prefix("allow")?;
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '-';
    Some(names.split(move |c| !is_name(c)).filter(|name| !name.is_empty()))
}

#[cfg(test)]
mod tests {
    use plcc_diag::lints::find_lint;

    use super::*;

    /// The lines of the warnings that remain in a PMI text with a warning in each line.
    fn lines(text: &str, levels: &LintLevels) -> Vec<(u32, Severity)> {
        let mut sources = SourceMap::new();
        let file = sources.add("a.pmi", text.as_bytes());
        let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1));
        let span = |at: usize| Span::new(file, at, at);
        let mut diagnostics: Vec<_> =
            starts.map(|at| Diagnostic::warning("PMI-W5", span(at), "a name")).collect();
        levels.apply(&sources, &mut diagnostics, &["?"], Some('#'));
        let line = |d: &Diagnostic| (sources.line_col(file, d.span.start).0, d.severity);
        diagnostics.iter().map(line).collect()
    }

    #[test]
    fn a_comment_silences_the_next_statement() {
        let text = "A=B\n? plcc: allow near-name\n\n? more\nC=#\nD\nE=F\n\
                    G=H ?plcc:allow other NEAR-NAME\nI=J\nK=L";
        let left = lines(text, &LintLevels::default());
        let left: Vec<u32> = left.into_iter().map(|(line, _)| line).collect();
        assert_eq!(left, [1, 2, 7, 10]);
    }

    #[test]
    fn levels_take_out_findings_or_make_them_errors() {
        let lint = find_lint("near-name").unwrap();
        let mut levels = LintLevels::default();
        assert_eq!(lines("A", &levels), [(1, Severity::Warning)]);
        levels.set(lint, Level::Deny);
        assert_eq!(lines("A", &levels), [(1, Severity::Error)]);
        levels.set(lint, Level::Allow);
        assert_eq!(lines("A", &levels), []);
        levels.set(lint, Level::Warn);
        levels.deny_warnings = true;
        assert_eq!(lines("A", &levels), [(1, Severity::Error)]);
    }
}
