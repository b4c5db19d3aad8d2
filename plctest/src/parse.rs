//! Reads a script: each line by the [grammar](crate::grammar), then what stands where.

use std::collections::HashMap;
use std::ops::Range;

use chumsky::Parser;
use chumsky::error::{Rich, RichPattern, RichReason};
use plcc_abi::closest;
use plcc_diag::{Diagnostic, FileId, SourceMap, Span};

use crate::grammar::{self, KEYWORDS, Line, Part};
use crate::script::{Body, Expected, Piece, Script, Statement, Test};

/// The code of a line that is not a statement of a script.
pub(crate) const SYNTAX: &str = "TEST-1";
/// The code of a statement in a place where it can't stand.
pub(crate) const PLACE: &str = "TEST-2";

/// The longest line, in bytes.
const MAX_LINE: usize = 4000;

/// Reads a script. Every line with a mistake is told; the others are in the result.
pub fn parse(sources: &SourceMap, file: FileId) -> (Script, Vec<Diagnostic>) {
    let mut reader = Reader {
        sources,
        file,
        script: Script::default(),
        open: None,
        names: HashMap::new(),
        found: vec![],
    };
    let grammar = grammar::line();
    let text = sources.text(file);
    for (number, range) in (1..).zip(lines(text)) {
        let Some(line) = text.get(range.clone()) else { continue };
        let line = line.get(..comment(line)).unwrap_or(line).trim_end();
        if line.trim_start().is_empty() {
            continue;
        }
        let indent = line.len() - line.trim_start().len();
        let span = Span::new(file, range.start + indent, range.start + line.len());
        if line.len() > MAX_LINE {
            let text = format!("this line is longer than {MAX_LINE} bytes");
            reader.found.push(
                Diagnostic::error(SYNTAX, span, text).help("divide it into several statements"),
            );
            continue;
        }
        match grammar.parse(line).into_result() {
            Ok(parsed) => reader.line(parsed, line, range.start, span, number),
            Err(errors) => {
                let diagnostic = syntax_error(file, line, range.start, errors.first());
                reader.found.push(diagnostic);
                reader.mend(line.trim_start());
            }
        }
    }
    reader.finish(text.len())
}

/// The ranges of the lines of a text, without their ends: CR, LF and CR LF.
fn lines(text: &str) -> impl Iterator<Item = Range<usize>> + '_ {
    let mut next = Some(0);
    std::iter::from_fn(move || {
        let begin = next?;
        let rest = text.get(begin..)?;
        let Some(length) = rest.find(['\n', '\r']) else {
            next = None;
            return Some(begin..text.len());
        };
        let end = begin + length;
        next = Some(
            end + if text.get(end..).is_some_and(|rest| rest.starts_with("\r\n")) { 2 } else { 1 },
        );
        Some(begin..end)
    })
}

/// Where the comment of a line begins; the line's end without one. A `#` begins one, but in quotes, where it belongs to a
/// name (`TC#COUNT`), and where it begins one (`#1.CMD`).
fn comment(line: &str) -> usize {
    let bytes = line.as_bytes();
    let mut quoted = false;
    for (at, &byte) in bytes.iter().enumerate() {
        match byte {
            b'"' => quoted = !quoted,
            b'#' if !quoted && !in_name(line, at) => return at,
            _ => {}
        }
    }
    line.len()
}

/// Whether a `#` is a part of a variable's name.
fn in_name(line: &str, at: usize) -> bool {
    let (before, behind) = line.split_at_checked(at).unwrap_or((line, ""));
    let behind = behind.get(1..).unwrap_or_default();
    let attached = before.ends_with(|c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | ']'));
    if attached {
        return behind.starts_with(|c: char| c.is_ascii_uppercase());
    }
    let digits = behind.len() - behind.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let rest = behind.get(digits..).unwrap_or_default();
    let is_name = rest
        .strip_prefix('.')
        .is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_uppercase()));
    digits > 0 && is_name && !before.trim().is_empty()
}

/// What is wrong with a line.
fn syntax_error(
    file: FileId,
    line: &str,
    begin: usize,
    error: Option<&Rich<'_, char>>,
) -> Diagnostic {
    let indent = line.len() - line.trim_start().len();
    let statement = line.trim_start();
    let word_end =
        statement.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(statement.len());
    let word = statement.get(..word_end).unwrap_or_default();
    let Some(form) = grammar::form(word) else {
        let end = if word.is_empty() {
            statement.chars().next().map_or(0, char::len_utf8)
        } else {
            word_end
        };
        let span = Span::new(file, begin + indent, begin + indent + end);
        let shown = statement.get(..end).unwrap_or_default();
        let diagnostic =
            Diagnostic::error(SYNTAX, span, format!("no statement begins with `{shown}`"));
        let lower = word.to_lowercase();
        let near = KEYWORDS.iter().copied().find(|keyword| *keyword == lower);
        let near = near.or_else(|| closest(&lower, KEYWORDS.iter().copied()));
        return match near {
            Some(near) if near == lower => {
                diagnostic.help(format!("keywords are written in small letters: `{near}`"))
            }
            Some(near) => diagnostic.help(format!("did you mean `{near}`? It is written `{}`", grammar::form(near).unwrap_or(near))),
            None => diagnostic.help(
                "the statements of a test are set, pulse, force, release, wait until, expect, hold, run and power cycle",
            ),
        };
    };
    let range = error.map_or(0..line.len(), |error| error.span().into_range());
    let at = line.get(..range.start).map_or(0, |before| before.trim_end().len().max(indent));
    // At the end of the line its last character is shown.
    let start =
        if range.start >= line.trim_end().len() { at.saturating_sub(1) } else { range.start };
    let start = floor(line, start);
    let end = line
        .get(start..)
        .and_then(|rest| rest.chars().next())
        .map_or(start, |c| start + c.len_utf8());
    let span = Span::new(file, begin + start, begin + end.max(floor(line, range.end)));
    let message = error.map_or_else(String::new, message);
    Diagnostic::error(SYNTAX, span, message).help(format!("write it as in `{form}`"))
}

/// The mistake of an `expect message` or `expect stop` whose text is not in quotes.
fn unquoted(item: &Piece) -> Option<Diagnostic> {
    let (word, rest) = item.text.split_once([' ', '\t']).unwrap_or((&item.text, ""));
    let example = match word {
        "message" => "expect message \"TURRET\"",
        "stop" => "expect stop \"WATCHDOG\"",
        _ => return None,
    };
    let rest = rest.trim_start();
    // A condition could name a variable so.
    if !rest.is_empty() && !rest.starts_with(|first: char| first.is_alphanumeric()) {
        return None;
    }
    let end = item.span.range().end;
    let span = Span::new(item.span.file, end - rest.len(), end);
    let span = if rest.is_empty() { item.span } else { span };
    let text = format!("a text in quotes belongs after `{word}`");
    Some(Diagnostic::error(SYNTAX, span, text).help(format!("write it as in `{example}`")))
}

/// The beginning of the character at an offset.
fn floor(line: &str, offset: usize) -> usize {
    (0..=offset.min(line.len())).rev().find(|&at| line.is_char_boundary(at)).unwrap_or(0)
}

/// The message of an error of the grammar: `expected A or B, found C`.
fn message(error: &Rich<'_, char>) -> String {
    let (expected, found) = match error.reason() {
        RichReason::ExpectedFound { expected, found } => (expected, found),
        RichReason::Custom(message) => return message.clone(),
    };
    let mut expected: Vec<String> = expected
        .iter()
        .filter_map(|pattern| match pattern {
            RichPattern::Label(label) => Some(label.to_string()),
            RichPattern::Token(token) => Some(format!("`{}`", **token)),
            RichPattern::EndOfInput => Some("the end of the line".into()),
            _ => None,
        })
        .filter(|pattern| pattern != "` `" && pattern != "`\t`")
        .collect();
    expected.sort_unstable();
    expected.dedup();
    let found =
        found.as_ref().map_or("the end of the line".into(), |token| format!("`{}`", **token));
    match expected.split_last() {
        None => format!("{found} is not expected here"),
        Some((last, [])) => format!("{last} is expected here, not {found}"),
        Some((last, others)) => {
            format!("{} or {last} is expected here, not {found}", others.join(", "))
        }
    }
}

/// Reads line after line.
struct Reader<'s> {
    sources: &'s SourceMap,
    file: FileId,
    script: Script,
    /// The test that has no end yet.
    open: Option<Test>,
    /// The lines of the tests, by their names.
    names: HashMap<String, u32>,
    found: Vec<Diagnostic>,
}

impl Reader<'_> {
    fn piece(&self, span: Span) -> Piece {
        Piece { text: self.sources.slice(span).to_owned(), span }
    }

    /// A part of the line that begins at `begin`, without blanks around it.
    fn part(&self, line: &str, part: &Part, begin: usize) -> Piece {
        let text = line.get(part.clone()).unwrap_or_default();
        let start = part.start + (text.len() - text.trim_start().len());
        let end = start + text.trim().len();
        self.piece(Span::new(self.file, begin + start, begin + end))
    }

    /// The items of a list with commas.
    fn items(&mut self, line: &str, part: &Part, begin: usize) -> Vec<Piece> {
        let text = line.get(part.clone()).unwrap_or_default();
        let mut items = vec![];
        for range in list(text) {
            let item = self.part(line, &(part.start + range.start..part.start + range.end), begin);
            if item.text.is_empty() {
                let at = begin + part.start + range.start;
                let span = Span::new(self.file, at.saturating_sub(1), at);
                let text = "nothing stands beside this comma";
                self.found.push(Diagnostic::error(SYNTAX, span, text).help("leave the comma out"));
                return vec![];
            }
            items.push(item);
        }
        items
    }

    /// `NAME = VALUE`, several with commas.
    fn settings(&mut self, line: &str, part: &Part, begin: usize) -> Vec<(Piece, Piece)> {
        let mut settings = vec![];
        for item in self.items(line, part, begin) {
            let Some((name, value)) = item.text.split_once('=') else {
                let text = format!("`{}` has no `=` with a value after it", item.text);
                let diagnostic = Diagnostic::error(SYNTAX, item.span, text);
                self.found.push(diagnostic.help(format!("write `{} = VALUE`", item.text)));
                return vec![];
            };
            let start = item.span.range().start;
            let after = start + name.len() + 1;
            let value_start = after + (value.len() - value.trim_start().len());
            let name = Span::new(self.file, start, start + name.trim_end().len());
            let value = Span::new(self.file, value_start, item.span.range().end);
            settings.push((self.piece(name), self.piece(value)));
        }
        settings
    }

    /// What an `expect` looks at.
    fn expected(&mut self, line: &str, part: &Part, begin: usize) -> Vec<Expected> {
        let items = self.items(line, part, begin);
        let mut all = vec![];
        for item in items {
            let quoted = |word: &str| {
                let text = item.text.strip_prefix(word)?.trim_start();
                text.starts_with('"').then_some(text)
            };
            let (is_stop, text) = match (quoted("message"), quoted("stop")) {
                (Some(text), _) => (false, text),
                (None, Some(text)) => (true, text),
                (None, None) => {
                    if let Some(diagnostic) = unquoted(&item) {
                        self.found.push(diagnostic);
                        return vec![];
                    }
                    all.push(Expected::Condition(item));
                    continue;
                }
            };
            let inner = text.get(1..).and_then(|text| text.strip_suffix('"'));
            let Some(inner) = inner.filter(|inner| !inner.contains('"')) else {
                let diagnostic = Diagnostic::error(
                    SYNTAX,
                    item.span,
                    "this text in quotes is not closed, or something follows it",
                );
                self.found.push(diagnostic.help("write it as in `expect message \"TURRET\"`"));
                return vec![];
            };
            let start = item.span.range().end - 1 - inner.len();
            let piece = self.piece(Span::new(self.file, start, start + inner.len()));
            all.push(if is_stop { Expected::Stop(piece) } else { Expected::Message(piece) });
        }
        all
    }

    /// A line that was read.
    fn line(&mut self, parsed: Line, line: &str, begin: usize, span: Span, number: u32) {
        let before = self.found.len();
        let body = match &parsed {
            Line::Program(part) => Body::Program(self.part(line, part, begin)),
            Line::Machine(part) => Body::Machine(self.part(line, part, begin)),
            Line::Simulate => Body::Simulate,
            Line::Never(part) => {
                Body::Invariant { holds: false, conditions: self.items(line, part, begin) }
            }
            Line::Always(part) => {
                Body::Invariant { holds: true, conditions: self.items(line, part, begin) }
            }
            Line::After(part, (within, _)) => {
                let mut then = self.items(line, part, begin);
                if let [only] = then.as_slice() {
                    let text = "a second condition, which has to follow, belongs after a comma";
                    let diagnostic = Diagnostic::error(SYNTAX, only.span, text);
                    let form = grammar::form("after").unwrap_or_default();
                    self.found.push(diagnostic.help(format!("write it as in `{form}`")));
                }
                if then.len() < 2 {
                    return;
                }
                Body::Response { after: then.remove(0), then, within: *within }
            }
            Line::Test(part) => Body::Test(self.part(line, part, begin)),
            Line::End => Body::End,
            Line::Set(part) => Body::Set(self.settings(line, part, begin)),
            Line::Force(part) => Body::Force(self.settings(line, part, begin)),
            Line::Pulse(part, length) => Body::Pulse(
                self.items(line, part, begin),
                length.as_ref().map(|(length, _)| *length),
            ),
            Line::Release(part) => Body::Release(self.items(line, part, begin)),
            Line::Wait(part, (length, _)) => Body::Wait(self.items(line, part, begin), *length),
            Line::Hold(part, (length, _)) => Body::Hold(self.items(line, part, begin), *length),
            Line::Expect(part) => Body::Expect(self.expected(line, part, begin)),
            Line::Run(length, _) => Body::Run(*length),
            Line::PowerCycle => Body::PowerCycle,
        };
        if self.found.len() > before {
            return;
        }
        self.statement(Statement { body, span, line: number });
    }

    /// A statement, in the place where it stands.
    fn statement(&mut self, statement: Statement) {
        let span = statement.span;
        match (statement.body.clone(), &mut self.open) {
            (Body::Test(name), None) => {
                if name.text.trim().is_empty() {
                    let text = "a test needs a name";
                    let diagnostic = Diagnostic::error(SYNTAX, span, text);
                    self.found
                        .push(diagnostic.help("say what the test shows: test \"the pump starts\""));
                }
                if let Some(other) = self.names.insert(name.text.clone(), statement.line) {
                    let text = format!("the test in line {other} has this name, too");
                    let diagnostic = Diagnostic::error(PLACE, name.span, text);
                    self.found
                        .push(diagnostic.help("give each test of a script a name of its own"));
                }
                let (line, invariants) = (statement.line, self.script.invariants.len());
                self.open = Some(Test { name, line, statements: vec![], invariants });
            }
            (Body::Test(_), Some(open)) => {
                let text = format!("the test in line {} has no `end`", open.line);
                self.found
                    .push(Diagnostic::error(PLACE, span, text).help("write `end` above this line"));
                self.close();
                self.statement(statement);
            }
            (Body::End, Some(_)) => self.close(),
            (Body::End, None) => {
                let text = "no test begins above this `end`";
                self.found.push(
                    Diagnostic::error(PLACE, span, text)
                        .help("leave it out, or begin the test with `test \"NAME\"`"),
                );
            }
            (
                Body::Program(_)
                | Body::Machine(_)
                | Body::Simulate
                | Body::Invariant { .. }
                | Body::Response { .. },
                Some(open),
            ) => {
                let text = format!(
                    "this belongs above the tests, but is in the test of line {}",
                    open.line
                );
                self.found.push(Diagnostic::error(PLACE, span, text).help("move it above `test`"));
            }
            (Body::Program(file), None) => self.script.programs.push(file),
            (Body::Machine(file), None) => {
                if self.script.machine.is_some() {
                    let text = "the script names a machine file already";
                    self.found
                        .push(Diagnostic::error(PLACE, span, text).help("leave one of them out"));
                }
                self.script.machine = Some(file);
            }
            (Body::Simulate, None) => self.script.simulate = Some(span),
            (Body::Invariant { .. } | Body::Response { .. }, None) => {
                self.script.invariants.push(statement)
            }
            (_, Some(open)) => open.statements.push(statement),
            (_, None) => {
                let text = "this belongs in a test, but no test begins above it";
                self.found.push(
                    Diagnostic::error(PLACE, span, text)
                        .help("write `test \"NAME\"` above it, and `end` below"),
                );
            }
        }
    }

    /// Ends the open test.
    fn close(&mut self) {
        self.script.tests.extend(self.open.take());
    }

    /// Goes on behind a line that could not be read, so that it causes no further errors.
    fn mend(&mut self, line: &str) {
        let word = |word: &str| {
            line.strip_prefix(word).is_some_and(|rest| !rest.starts_with(char::is_alphanumeric))
        };
        if word("end") {
            self.close();
        } else if word("test") && self.open.is_none() {
            let name = Piece { text: String::new(), span: Span::new(self.file, 0, 0) };
            let invariants = self.script.invariants.len();
            self.open = Some(Test { name, line: 0, statements: vec![], invariants });
        }
    }

    fn finish(mut self, end: usize) -> (Script, Vec<Diagnostic>) {
        if let Some(open) = self.open.take() {
            let span = if open.line == 0 { Span::new(self.file, end, end) } else { open.name.span };
            let text = "this test has no `end`";
            self.found.push(
                Diagnostic::error(PLACE, span, text).help("write `end` after its last statement"),
            );
            self.script.tests.push(open);
        }
        if self.script.programs.is_empty() && self.found.is_empty() {
            let first = self.sources.text(self.file).lines().next().map_or(0, str::len);
            let text = "the script does not say which program it tests";
            let diagnostic = Diagnostic::error(PLACE, Span::new(self.file, 0, first), text);
            self.found.push(
                diagnostic
                    .help("begin it with `program \"FILE\"`, a path from the script's folder"),
            );
        }
        (self.script, self.found)
    }
}

/// The ranges of the items of a list. Commas in parentheses, brackets and quotes separate nothing.
fn list(text: &str) -> Vec<Range<usize>> {
    let (mut depth, mut quoted, mut begin) = (0u32, false, 0);
    let mut items = vec![];
    for (at, c) in text.char_indices() {
        match c {
            '"' => quoted = !quoted,
            '(' | '[' if !quoted => depth += 1,
            ')' | ']' if !quoted => depth = depth.saturating_sub(1),
            ',' if depth == 0 && !quoted => {
                items.push(begin..at);
                begin = at + 1;
            }
            _ => {}
        }
    }
    items.push(begin..text.len());
    items
}

#[cfg(test)]
mod tests;
