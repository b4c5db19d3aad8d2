//! A cursor over the significant characters of the text (NCT 5), which are all but white space and
//! comments. White space and comments may be between any two of them. They mean nothing, except
//! that such a gap ends a number that is complete by then.

use plcc_diag::{FileId, Span};

/// A position in the text, always at a significant character or at the end.
#[derive(Clone)]
pub(crate) struct Cursor<'a> {
    text: &'a str,
    file: FileId,
    /// Offset of the next significant character, or the text's length.
    pos: usize,
    /// Whether white space or a comment is before [`Self::pos`].
    gap: bool,
    /// Offset after the last character taken.
    end: usize,
    /// Offset of a `/*` that nothing closes.
    open_comment: Option<usize>,
    /// How many significant characters have been taken.
    taken: usize,
}

/// Whether a character is white space. The end-of-file mark of DOS, byte order marks and NUL count
/// as such.
pub(crate) fn is_blank(c: char) -> bool {
    c.is_whitespace() || matches!(c, '\u{1a}' | '\u{feff}' | '\0')
}

impl<'a> Cursor<'a> {
    /// A cursor at the first significant character of `text`.
    pub(crate) fn new(file: FileId, text: &'a str) -> Self {
        let mut cursor =
            Self { text, file, pos: 0, gap: true, end: 0, open_comment: None, taken: 0 };
        cursor.skip();
        cursor.gap = true;
        cursor
    }

    fn rest(&self) -> &'a str {
        self.text.get(self.pos..).unwrap_or("")
    }

    /// Skips white space and comments.
    fn skip(&mut self) {
        let start = self.pos;
        while let Some(c) = self.rest().chars().next() {
            if is_blank(c) {
                self.pos += c.len_utf8();
            } else if !self.skip_comment() {
                break;
            }
        }
        self.gap = self.pos > start;
    }

    /// Skips a comment if one is here.
    fn skip_comment(&mut self) -> bool {
        let rest = self.rest();
        let len = if rest.starts_with(';') {
            rest.find(['\r', '\n'])
        } else if rest.starts_with("/*") {
            let close = rest.get(2..).and_then(|tail| tail.find("*/"));
            if close.is_none() {
                self.open_comment.get_or_insert(self.pos);
            }
            close.map(|at| at + 4)
        } else {
            return false;
        };
        self.pos += len.unwrap_or(rest.len());
        true
    }

    /// The next significant character.
    pub(crate) fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    /// Whether the next significant character is this one.
    pub(crate) fn at(&self, c: char) -> bool {
        self.peek() == Some(c)
    }

    /// Takes the next significant character.
    pub(crate) fn bump(&mut self) -> Option<char> {
        let c = self.peek()?;
        self.pos += c.len_utf8();
        self.end = self.pos;
        self.taken += 1;
        self.skip();
        Some(c)
    }

    /// Takes the next character if it is this one.
    pub(crate) fn eat(&mut self, c: char) -> bool {
        let found = self.at(c);
        if found {
            self.bump();
        }
        found
    }

    /// Whether white space or a comment is before the next significant character.
    pub(crate) fn gap(&self) -> bool {
        self.gap
    }

    /// Offset of the next significant character.
    pub(crate) fn pos(&self) -> usize {
        self.pos
    }

    /// Offset after the last character taken.
    pub(crate) fn end(&self) -> usize {
        self.end
    }

    /// How many significant characters have been taken.
    pub(crate) fn taken(&self) -> usize {
        self.taken
    }

    /// Where a comment begins that nothing closes.
    pub(crate) fn open_comment(&self) -> Option<usize> {
        self.open_comment
    }

    /// From `start` to after the last character taken, one character at least.
    pub(crate) fn span_from(&self, start: usize) -> Span {
        let least = self.text.get(start..).and_then(|t| t.chars().next()).map_or(0, char::len_utf8);
        Span::new(self.file, start, self.end.max(start + least))
    }

    /// The span of the next character.
    pub(crate) fn span_here(&self) -> Span {
        Span::new(self.file, self.pos, self.pos + self.peek().map_or(0, char::len_utf8))
    }

    /// Takes the next character of a text module, in which white space is significant. `None` at
    /// the end of the text, `Some(None)` for a comment, which is taken as a whole.
    pub(crate) fn bump_raw(&mut self) -> Option<Option<char>> {
        let c = self.peek()?;
        if self.skip_comment() {
            return Some(None);
        }
        self.pos += c.len_utf8();
        if !is_blank(c) {
            self.end = self.pos;
            self.taken += 1;
        }
        Some(Some(c))
    }

    /// Goes back to where the last significant character ended, so that the white space after it
    /// is read by [`Self::bump_raw`].
    pub(crate) fn enter_raw(&mut self) {
        self.pos = self.end;
    }

    /// Ends the reading of raw characters.
    pub(crate) fn leave_raw(&mut self) {
        self.skip();
        self.gap = true;
    }

    /// The text from here on, for a look ahead in a text module.
    pub(crate) fn raw_rest(&self) -> &'a str {
        self.rest()
    }
}

/// Where the comments of a text begin and end.
pub(crate) fn comments(text: &str) -> Vec<(usize, usize)> {
    let mut cursor =
        Cursor { text, file: FileId(0), pos: 0, gap: true, end: 0, open_comment: None, taken: 0 };
    let mut found = vec![];
    while let Some(c) = cursor.peek() {
        let start = cursor.pos;
        if cursor.skip_comment() {
            let comment = text.get(start..cursor.pos).unwrap_or_default().trim_end();
            found.push((start, start + comment.len()));
        } else {
            cursor.pos += c.len_utf8();
        }
    }
    found
}

/// The place of the last character that is not blank. An error about something that is missing
/// points there.
pub(crate) fn last_place(file: FileId, text: &str) -> Span {
    let end = text.trim_end_matches(is_blank).len();
    let start = text.get(..end).and_then(|t| t.char_indices().next_back()).map_or(0, |(at, _)| at);
    Span::new(file, start, end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_white_space_do_not_count() {
        let mut cursor = Cursor::new(FileId(0), "U /* a\nb */5;x\r4\n7\u{1a}");
        let mut all = String::new();
        while let Some(c) = cursor.bump() {
            all.push(c);
        }
        assert_eq!(all, "U547");
        assert_eq!(cursor.open_comment(), None);
    }

    #[test]
    fn the_place_of_an_unclosed_comment_is_known() {
        let mut cursor = Cursor::new(FileId(0), "U /*/");
        cursor.bump();
        assert_eq!(cursor.open_comment(), Some(2));
    }
}
