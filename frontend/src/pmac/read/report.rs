//! Errors of statements: which are reported, with which help, and where reading goes on after one.

use plcc_diag::{Diagnostic, MessageText, Span};

use super::cursor::ParseError;
use super::download::DownloadReader;
use super::online::PERHAPS_A_NAME;
use super::other_languages::{self, Explained};
use super::recover::next_statement;
use super::words;
use crate::common::{EXPLAINED_ERRORS, closest};
use crate::pmac::origin::TextRange;

/// For how many errors similar words and names are looked for. Each search compares with all of them.
const SEARCHED_ERRORS: usize = 100;

/// The end of the help for a name that differs from a defined one in its capitals alone.
const CAPITALS_COUNT: &str = "capitals count in names";

/// A word or name that was probably meant.
struct Similar {
    help: MessageText,
    /// What is to be written in the place of the error, if it is the word at the error alone that is wrong.
    replacement: Option<String>,
}

impl Similar {
    /// Nothing but a text of help.
    fn told(help: impl Into<MessageText>) -> Self {
        Self { help: help.into(), replacement: None }
    }
}

impl DownloadReader<'_> {
    /// Adds the diagnostic that `make` makes for the place in the sources of `at`.
    pub(crate) fn tell(&mut self, at: TextRange, make: impl FnOnce(Span) -> Diagnostic) {
        self.diagnostics.push(self.preprocessed.origins.diagnose(at, make));
    }

    /// Reports an error. It is left out where the cause may be a template without a value on the
    /// same line, or a missing file that may define the name at the error. Returns false in the
    /// latter case.
    pub(crate) fn report(&mut self, mut error: ParseError) -> bool {
        let at = error.at;
        let line = self.line_of(at);
        let blamed = self.preprocessed.undefined_templates.partition_point(|p| p.end <= line.start);
        if self.preprocessed.undefined_templates.get(blamed).is_some_and(|p| p.start < line.end) {
            return true;
        }
        if self.preprocessed.incomplete && self.may_be_missing_name(at) {
            self.suppressed_errors += 1;
            if let Some(open) = &mut self.open {
                open.has_unknown_names = true;
            }
            return false;
        }
        let controller = self.reader.controller;
        let word = self.reader.cur.text_at(at);
        let differs = self.differs_in_case(word, &error);
        let explained = match &differs {
            Some(_) => Explained::Yes,
            None if self.diagnostics.len() >= EXPLAINED_ERRORS => Explained::No,
            None => other_languages::explain(&self.preprocessed.text, controller, &mut error),
        };
        let similar = match explained {
            Explained::No => self.similar_word(&error).or_else(|| self.similar_name(word, &error)),
            Explained::Yes => differs,
            Explained::UndefinedName(name) => self.defined_name_near(&name),
        };
        let (help, replacement) = match similar {
            Some(similar) => (Some(similar.help), similar.replacement),
            None => (error.help, None),
        };
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let is_at_word = !word.is_empty() && word.chars().all(is_word);
        let closed = (error.code == "PMAC-5").then_some(self.closed_by_name).flatten();
        let closed = closed.map(|name| self.preprocessed.origins.place(name).0);
        self.tell(at, |span| {
            let mut diagnostic = Diagnostic::error(error.code, span, error.message);
            if let Some(place) = closed {
                diagnostic =
                    diagnostic.label(place, "the beginning of this name closed the buffer: CLOSE");
            }
            if let Some(replacement) = replacement.filter(|_| is_at_word) {
                diagnostic = diagnostic.replace(replacement);
            }
            match help {
                Some(help) => diagnostic.help(help),
                None => diagnostic,
            }
        });
        true
    }

    /// The help that names the word of the language which is similar to the unknown word at the
    /// error. Only the first errors are worth the search.
    fn similar_word(&self, error: &ParseError) -> Option<Similar> {
        let unknown = error.help.as_ref().is_some_and(|help| help == PERHAPS_A_NAME);
        if !unknown || self.diagnostics.len() >= SEARCHED_ERRORS {
            return None;
        }
        let what = self.reader.cur.text_at(error.at);
        // Of ENDWHLE the short form ENDWH was taken already.
        let whole = self.reader.cur.glued_word(error.at);
        let near = |word: &str| closest(word, words::suggested());
        let (word, wrong) =
            near(what).map(|word| (word, what)).or_else(|| Some((near(whole)?, whole)))?;
        if word.eq_ignore_ascii_case(what) {
            return Some(Similar::told(format!(
                "{word} is not allowed here: statements belong in buffers, and there COMMAND\"…\" gives \
                 on-line commands"
            )));
        }
        let replacement = (wrong == what).then(|| word.to_owned());
        Some(Similar { help: format!("did you mean {word}?").into(), replacement })
    }

    /// The help that names a defined name which is similar to the word at the error, if the error
    /// has no other help.
    fn similar_name(&self, word: &str, error: &ParseError) -> Option<Similar> {
        let is_word = word.starts_with(|c: char| c.is_alphabetic() || c == '_');
        let unhelped = error.help.as_ref().is_none_or(|help| help == PERHAPS_A_NAME);
        if is_word && unhelped { self.defined_name_near(word) } else { None }
    }

    /// The help that names a defined name which differs from the word at the error in its capitals
    /// alone, if the error has no other help.
    fn differs_in_case(&self, word: &str, error: &ParseError) -> Option<Similar> {
        let similar = self.similar_name(word, error)?;
        similar.help.ends_with(CAPITALS_COUNT).then_some(similar)
    }

    /// The help that names a defined name which is similar to an undefined one. Only the first
    /// errors are worth the search.
    fn defined_name_near(&self, word: &str) -> Option<Similar> {
        if self.diagnostics.len() >= SEARCHED_ERRORS {
            return None;
        }
        let name =
            closest(word, self.preprocessed.names.iter().map(|defined| defined.name.as_str()))?;
        if name == word {
            let help = format!("{name} is defined further down: its #define must come before");
            return Some(Similar::told(help));
        }
        let capitals = if name.eq_ignore_ascii_case(word) { CAPITALS_COUNT } else { "" };
        let help = format!("did you mean {name}? {capitals}").trim_end().to_owned();
        Some(Similar { help: help.into(), replacement: Some(name.to_owned()) })
    }

    /// Whether the text at a place, or the word in front of it on the same line, may be a name that
    /// a missing file defines.
    fn may_be_missing_name(&self, at: TextRange) -> bool {
        let word = |c: char| c.is_alphanumeric() || c == '_';
        let start = at.start as usize;
        // m1MOVE is a name, though m1 alone would be a variable.
        let rest = self.preprocessed.text.get(at.end as usize..).unwrap_or("");
        let end = at.end as usize + rest.find(|c| !word(c)).unwrap_or(rest.len());
        let line = self.preprocessed.text.get(..end).unwrap_or("");
        let line = line.get(line.rfind('\n').map_or(0, |n| n + 1)..).unwrap_or("");
        let here = self.preprocessed.text.get(start..end).unwrap_or("").trim();
        let before = line.get(..line.len().saturating_sub(end - start)).unwrap_or("").trim_end();
        let before = before.rsplit(|c| !word(c)).next().unwrap_or("");
        [here, before].into_iter().any(|name| {
            let name = name.trim_end_matches(|c| !word(c));
            let letters = name.chars().filter(|c| c.is_alphabetic() || *c == '_').count();
            letters > 1 && name.chars().all(word)
        })
    }

    /// The line around a place. Where no template lacks a value only the place itself is needed.
    fn line_of(&self, at: TextRange) -> TextRange {
        if self.preprocessed.undefined_templates.is_empty() {
            return at;
        }
        let start = at.start as usize;
        let before = self.preprocessed.text.get(..start).unwrap_or("");
        let after = self.preprocessed.text.get(start..).unwrap_or("");
        let from = before.rfind('\n').map_or(0, |line| line + 1);
        TextRange::new(from, start + after.find('\n').unwrap_or(after.len()))
    }

    /// Moves after an error of the statement that begins at the offset `start`: to the next
    /// statement, or to the line's end.
    pub(crate) fn recover(&mut self, start: usize) {
        let cur = &mut self.reader.cur;
        let blank = |c: char| c.is_whitespace() || c.is_control();
        // Where there are only blanks before the place, it is on the line after them.
        let rest = self.preprocessed.text.get(start..).unwrap_or("");
        let start = start + (rest.len() - rest.trim_start_matches(blank).len());
        cur.pos = cur.pos.max(start);
        // Blanks that were skipped may have led into the next line.
        let read = self.preprocessed.text.get(start..cur.pos).unwrap_or("");
        let solid = read.trim_end_matches(blank);
        if read.get(solid.len()..).is_some_and(|gap| gap.contains('\n')) {
            cur.pos = start + solid.len();
        }
        if cur.pos == start {
            while cur.byte().is_ascii_alphanumeric() {
                cur.pos += 1;
            }
        }
        cur.pos = next_statement(&self.preprocessed.text, start, cur.pos, self.open.is_none());
    }
}
