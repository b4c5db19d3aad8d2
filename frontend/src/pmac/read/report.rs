//! Errors of statements: which are reported, with which help, and where reading goes on behind one.

use plcc_diag::Diagnostic;

use super::cursor::ParseError;
use super::download::DownloadReader;
use super::online::PERHAPS_A_NAME;
use super::recover::next_statement;
use crate::common::closest;
use crate::pmac::origin::TextRange;

impl DownloadReader<'_> {
    /// Reports an error. It is left out where the cause may be a template without a value on the
    /// same line, or a missing file that may define the name at the error. Gives false in the
    /// latter case.
    pub(crate) fn report(&mut self, error: ParseError) -> bool {
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
        let help = self.similar_name(&error).or(error.help);
        let diagnostic = self.preprocessed.origins.diagnose(at, |span| {
            let diagnostic = Diagnostic::error(error.code, span, error.message);
            match help {
                Some(help) => diagnostic.help(help),
                None => diagnostic,
            }
        });
        self.diagnostics.push(diagnostic);
        true
    }

    /// The help that names a defined name which is similar to the word at the error, if the error
    /// has no other help. Only the first 100 errors are worth the search.
    fn similar_name(&self, error: &ParseError) -> Option<String> {
        let at = error.at;
        let word = self.preprocessed.text.get(at.start as usize..at.end as usize)?.trim();
        let is_word = word.starts_with(|c: char| c.is_alphabetic() || c == '_');
        let unhelped = error.help.as_ref().is_none_or(|help| help == PERHAPS_A_NAME);
        if !is_word || !unhelped || self.diagnostics.len() >= 100 {
            return None;
        }
        let name =
            closest(word, self.preprocessed.names.iter().map(|defined| defined.name.as_str()))?;
        Some(if name.eq_ignore_ascii_case(word) && name != word {
            format!("did you mean {name}? capitals count in names")
        } else if name == word {
            format!("{name} is defined further down: its #define must come before")
        } else {
            format!("did you mean {name}?")
        })
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

    /// Moves behind an error of the statement that begins at the offset `start`: to the next
    /// statement, or to the line's end.
    pub(crate) fn recover(&mut self, start: usize) {
        let cur = &mut self.reader.cur;
        let blank = |c: char| c.is_whitespace() || c.is_control();
        // Where there are only blanks before the place, it is on the line behind them.
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
