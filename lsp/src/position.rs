//! Lines and columns of the protocol: both from 0, columns in units of UTF-16, or in bytes if the editor takes those.

use gen_lsp_types::{Position, PositionEncodingKind, Range};
use plcc_diag::{FileId, SourceMap, Span};

/// What columns count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Encoding {
    /// Bytes of UTF-8.
    Utf8,
    /// Units of UTF-16, which every editor takes.
    #[default]
    Utf16,
}

impl Encoding {
    /// Bytes, if the editor offers them; they need no counting.
    pub(crate) fn chosen_of(offered: Option<&[PositionEncodingKind]>) -> Self {
        let has_bytes = offered.is_some_and(|it| it.contains(&PositionEncodingKind::UTF8));
        if has_bytes { Self::Utf8 } else { Self::Utf16 }
    }

    /// Its name in the protocol.
    pub(crate) fn kind(self) -> PositionEncodingKind {
        match self {
            Self::Utf8 => PositionEncodingKind::UTF8,
            Self::Utf16 => PositionEncodingKind::UTF16,
        }
    }

    /// The length of a text.
    pub(crate) fn length(self, text: &str) -> u32 {
        match self {
            Self::Utf8 => text.len() as u32,
            Self::Utf16 if text.is_ascii() => text.len() as u32,
            Self::Utf16 => text.chars().map(|c| c.len_utf16() as u32).sum(),
        }
    }

    /// The offset in a line at a column; its end for a column beyond it. A column inside a character is its beginning.
    fn offset_in(self, line: &str, column: u32) -> usize {
        let mut units = 0;
        for (at, c) in line.char_indices() {
            let width = match self {
                Self::Utf8 => c.len_utf8(),
                Self::Utf16 => c.len_utf16(),
            };
            units += width as u32;
            if units > column {
                return at;
            }
        }
        line.len()
    }

    /// The position of an offset.
    pub(crate) fn position(self, sources: &SourceMap, file: FileId, offset: u32) -> Position {
        let line = sources.line(file, offset);
        let start = sources.line_start(file, line);
        let before = sources.text(file).get(start as usize..offset as usize).unwrap_or_default();
        Position { line: line - 1, character: self.length(before) }
    }

    /// The range of a span.
    pub(crate) fn range(self, sources: &SourceMap, span: Span) -> Range {
        let at = |offset| self.position(sources, span.file, offset);
        Range { start: at(span.start), end: at(span.end.max(span.start)) }
    }

    /// The offset of a position; the text's end for a line beyond the last one.
    pub(crate) fn offset(self, sources: &SourceMap, file: FileId, at: Position) -> u32 {
        let line = at.line.saturating_add(1);
        if line > sources.line_count(file) {
            return sources.text(file).len() as u32;
        }
        let start = sources.line_start(file, line);
        let text = sources.line_text(file, line);
        start + self.offset_in(text, at.character) as u32
    }

    /// The offset of a position in a text of which nothing is known yet.
    pub(crate) fn offset_in_text(self, text: &str, at: Position) -> usize {
        let mut start = 0;
        for _ in 0..at.line {
            let rest = text.get(start..).unwrap_or_default();
            let Some(end) = rest.find(['\r', '\n']) else { return text.len() };
            let is_pair = rest.get(end..).is_some_and(|rest| rest.starts_with("\r\n"));
            start += end + 1 + usize::from(is_pair);
        }
        let rest = text.get(start..).unwrap_or_default();
        let line = rest.get(..rest.find(['\r', '\n']).unwrap_or(rest.len())).unwrap_or_default();
        start + self.offset_in(line, at.character)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_units_of_utf_16() {
        let mut sources = SourceMap::new();
        let file = sources.add("a", "é𝄞x\r\ny".as_bytes());
        let at = |line, character| Position { line, character };
        for (offset, position) in
            [(0, at(0, 0)), (2, at(0, 1)), (6, at(0, 3)), (7, at(0, 4)), (9, at(1, 0))]
        {
            assert_eq!(Encoding::Utf16.position(&sources, file, offset), position);
            assert_eq!(Encoding::Utf16.offset(&sources, file, position), offset);
            let text = sources.text(file);
            assert_eq!(Encoding::Utf16.offset_in_text(text, position), offset as usize);
        }
        // In the middle of a character, beyond the line, beyond the text.
        assert_eq!(Encoding::Utf16.offset(&sources, file, at(0, 2)), 2);
        assert_eq!(Encoding::Utf16.offset(&sources, file, at(0, 99)), 7);
        assert_eq!(Encoding::Utf16.offset(&sources, file, at(9, 9)), 10);
        assert_eq!(Encoding::Utf8.position(&sources, file, 6), at(0, 6));
    }
}
