//! A text that is not a program, but belongs to one: a test script or a machine file.

use std::path::Path;

use gen_lsp_types::{Position, Range};
use plcc_diag::{FileId, SourceMap, Span};

use crate::position::Encoding;

/// Such a text.
pub(super) struct OpenText {
    pub(super) sources: SourceMap,
    pub(super) file: FileId,
    pub(super) encoding: Encoding,
}

impl OpenText {
    /// A text with the path that it has on disk.
    pub(super) fn new(path: &Path, text: &str, encoding: Encoding) -> Self {
        let mut sources = SourceMap::new();
        let file = sources.add(path.to_string_lossy(), text.as_bytes());
        Self { sources, file, encoding }
    }

    /// Its path.
    pub(super) fn path(&self) -> &Path {
        Path::new(self.sources.path(self.file))
    }

    /// The text.
    pub(super) fn text(&self) -> &str {
        self.sources.text(self.file)
    }

    /// A part of it.
    pub(super) fn slice(&self, span: Span) -> &str {
        self.sources.slice(span)
    }

    /// The range of a part in the protocol's terms.
    pub(super) fn range(&self, span: Span) -> Range {
        self.encoding.range(&self.sources, span)
    }

    /// The word at a place, of characters that are part of a word.
    pub(super) fn word(&self, at: Position, is_part: fn(char) -> bool) -> Span {
        let offset = self.encoding.offset(&self.sources, self.file, at) as usize;
        let (before, after) = self.text().split_at_checked(offset).unwrap_or((self.text(), ""));
        let start = before.trim_end_matches(is_part).len();
        let end = self.text().len() - after.trim_start_matches(is_part).len();
        Span::new(self.file, start, end)
    }

    /// What is written already of the word at a place.
    pub(super) fn beginning(&self, at: Position, is_part: fn(char) -> bool) -> Span {
        let end = self.encoding.offset(&self.sources, self.file, at);
        Span { end, ..self.word(at, is_part) }
    }

    /// The line in front of a place.
    pub(super) fn line_before(&self, offset: u32) -> &str {
        let before = self.text().get(..offset as usize).unwrap_or_default();
        before.rsplit(['\n', '\r']).next().unwrap_or_default()
    }
}
