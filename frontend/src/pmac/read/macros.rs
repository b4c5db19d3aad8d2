//! The replacement of names that `#define` defined.

use plcc_diag::Span;

use super::preprocess::{MAX_DIGITS, MAX_NESTING, Preprocessor, is_word, word_at};
use crate::pmac::origin::TextRange;

/// What `#define` gave a name.
pub(super) struct Macro {
    /// The text that replaces the name.
    pub(super) body: std::rc::Rc<str>,
    /// Where that text is.
    pub(super) defined: Span,
    /// Whether it is being replaced just now. The same name in its replacement is left alone then.
    pub(super) expanding: bool,
    /// Whether a template without value and default is in it.
    pub(super) has_undefined_template: bool,
}

impl Preprocessor<'_> {
    /// How many bytes of a word are to be looked up as one name. That is the whole word, with two
    /// exceptions for words that are not names themselves: the number of a name that follows a
    /// number (2 for `20MSEC`, then 4 for `MSEC`), and a name in front of the last digits of an
    /// address (4 for `PAGE00` after `$`). `before` is the byte in front of the word.
    pub(super) fn name_length(&self, word: &str, before: Option<&u8>) -> usize {
        let is_name = |part: Option<&str>| part.is_some_and(|p| self.macros.contains_key(p));
        let hex = |part: &str| part.bytes().all(|b| b.is_ascii_hexdigit());
        if is_name(Some(word)) {
            return word.len();
        }
        let split = match before.map_or('\n', |&b| char::from(b)) {
            '$' if hex(word) => None,
            '$' => (1..word.len())
                .rev()
                .take(MAX_DIGITS)
                .take_while(|&at| word.get(at..).is_none_or(hex))
                .find(|&at| is_name(word.get(..at))),
            c if is_word(c) => None,
            _ => word
                .find(|c: char| !c.is_ascii_digit())
                .filter(|&at| at > 0 && is_name(word.get(at..))),
        };
        split.unwrap_or(word.len())
    }

    /// Appends what replaces the name that is at `used`. Names in it are replaced in turn, with a stack
    /// of levels instead of recursion.
    pub(super) fn expand_macro(&mut self, name: &str, used: Span) {
        struct Level {
            body: std::rc::Rc<str>,
            pos: usize,
            quoted: bool,
            defined: Span,
            name: String,
        }
        // When the text may not grow any more, the replacement is not even read: it may be one very
        // long word.
        let mut next = (self.budget > 0).then(|| name.to_owned());
        let mut levels: Vec<Level> = Vec::new();
        loop {
            if let Some(name) = next.take()
                && let Some(entry) = self.macros.get_mut(&name)
            {
                let start = self.preprocessed.text.len();
                entry.expanding = true;
                if entry.has_undefined_template {
                    self.preprocessed.undefined_templates.push(TextRange::new(start, start + 1));
                }
                let (body, defined) = (entry.body.clone(), entry.defined);
                self.preprocessed.origins.expanded(start, used, defined);
                levels.push(Level { body, pos: 0, quoted: false, defined, name });
            }
            let Some(level) = levels.last_mut() else { return };
            let Some(c) = level.body.get(level.pos..).and_then(|t| t.chars().next()) else {
                if let Some(entry) = self.macros.get_mut(&level.name) {
                    entry.expanding = false;
                }
                levels.pop();
                if let Some(outer) = levels.last() {
                    let outer = outer.defined;
                    self.preprocessed.origins.expanded(self.preprocessed.text.len(), used, outer);
                }
                continue;
            };
            let body = level.body.clone();
            let length = match is_word(c) {
                true => {
                    let before = self.preprocessed.text.as_bytes().last();
                    self.name_length(word_at(&body, level.pos), before)
                }
                false => c.len_utf8(),
            };
            let piece = body.get(level.pos..level.pos + length).unwrap_or("");
            level.quoted ^= c == '"';
            let quoted = level.quoted;
            level.pos += length;
            if !self.spend(length, used) {
                for level in levels {
                    if let Some(entry) = self.macros.get_mut(&level.name) {
                        entry.expanding = false;
                    }
                }
                return;
            }
            if is_word(c)
                && !quoted
                && let Some(entry) = self.macros.get(piece)
                && !entry.expanding
            {
                if levels.len() >= MAX_NESTING {
                    self.error(used, "PMAC-6", "definitions nest too deep: 256 levels at most");
                } else {
                    next = Some(piece.to_owned());
                }
            } else {
                self.preprocessed.text.push_str(piece);
            }
        }
    }
}
