//! The source files of one compilation, and where lines begin in them.
//!
//! Diagnostics carry byte offsets; people want lines and columns. Each file therefore has a table
//! of the offsets at which its lines begin, searched by bisection. A column is a number of
//! characters, and a line may be a megabyte long, so a second table has the number of characters
//! before every block of [`BLOCK`] bytes: only the characters of one block are ever counted.

use std::sync::Arc;

use crate::{FileId, Span, decode::decode};

/// The length of a block in bytes.
const BLOCK: usize = 1024;

/// A file and its tables.
#[derive(Debug)]
struct SourceFile {
    /// As it was given.
    path: String,
    /// Decoded.
    text: String,
    /// The offset of each line's first byte, rising. CR, LF and CR LF each end a line.
    line_starts: Vec<u32>,
    /// For each block of [`BLOCK`] bytes the number of characters that begin before it.
    characters_before_block: Vec<u32>,
    /// The statement that included the file; `None` for a file that the user named.
    included_from: Option<Span>,
}

impl SourceFile {
    /// The number of characters that begin before a byte offset. If the offset is inside a
    /// character, that character is counted too.
    fn characters_before(&self, offset: u32) -> u32 {
        let offset = offset as usize;
        let before = self.characters_before_block.get(offset / BLOCK).copied().unwrap_or(0);
        let rest = self.text.as_bytes().get(offset / BLOCK * BLOCK..offset).unwrap_or(&[]);
        before + count_characters(rest)
    }
}

/// Counts characters of UTF-8 by their first bytes: all bytes but those of the form 10xxxxxx.
fn count_characters(bytes: &[u8]) -> u32 {
    bytes.iter().filter(|&&byte| byte & 0xC0 != 0x80).count() as u32
}

/// For each block of [`BLOCK`] bytes the number of characters that begin before it, and the number
/// of all characters.
fn characters_before_blocks(text: &str) -> Vec<u32> {
    let mut counts = vec![0];
    let mut total = 0;
    for block in text.as_bytes().chunks(BLOCK) {
        total += count_characters(block);
        counts.push(total);
    }
    counts
}

/// The files of one compilation with their decoded texts. A file is known by its [`FileId`], its
/// number in the order in which files were added. A clone shares the texts.
#[derive(Clone, Debug, Default)]
pub struct SourceMap {
    files: Vec<Arc<SourceFile>>,
}

impl SourceMap {
    /// An empty map.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a file that the user named. `path` is kept as the user wrote it; `bytes` is decoded:
    /// UTF-8, UTF-16 with a byte order mark, or Windows-1252.
    pub fn add(&mut self, path: impl Into<String>, bytes: &[u8]) -> FileId {
        self.push(path.into(), bytes, None)
    }

    /// Adds a file that the statement at `at` includes, decoded in the same way.
    pub fn add_included(&mut self, path: impl Into<String>, bytes: &[u8], at: Span) -> FileId {
        self.push(path.into(), bytes, Some(at))
    }

    fn push(&mut self, path: String, bytes: &[u8], included_from: Option<Span>) -> FileId {
        let text = decode(bytes);
        let line_starts = line_starts(&text);
        let characters_before_block = characters_before_blocks(&text);
        let id = FileId(self.files.len() as u32);
        self.files.push(Arc::new(SourceFile {
            path,
            text,
            line_starts,
            characters_before_block,
            included_from,
        }));
        id
    }

    fn file(&self, id: FileId) -> Option<&SourceFile> {
        self.files.get(id.0 as usize).map(Arc::as_ref)
    }

    /// The number of files.
    pub fn len(&self) -> usize {
        self.files.len()
    }

    /// Whether no file has been added.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// A file's decoded text; empty for a file of another map.
    pub fn text(&self, id: FileId) -> &str {
        self.file(id).map_or("", |f| &f.text)
    }

    /// A file's path as it was given; empty for a file of another map.
    pub fn path(&self, id: FileId) -> &str {
        self.file(id).map_or("", |f| &f.path)
    }

    /// The statement that included the file; `None` for a file that the user named.
    pub fn included_from(&self, id: FileId) -> Option<Span> {
        self.file(id).and_then(|f| f.included_from)
    }

    /// The text of a span; empty if the span does not lie in the file's text.
    pub fn slice(&self, span: Span) -> &str {
        self.text(span.file).get(span.range()).unwrap_or("")
    }

    /// The line of a byte offset, as [`line_col`](Self::line_col) gives it, without counting the characters
    /// in front of it.
    pub fn line(&self, id: FileId, offset: u32) -> u32 {
        let Some(file) = self.file(id) else { return 1 };
        let offset = offset.min(file.text.len() as u32);
        file.line_starts.partition_point(|&start| start <= offset).max(1) as u32
    }

    /// Line and column of a byte offset. Both count from 1; a column is a number of characters. An
    /// offset beyond the end of the text is taken as the end. A file of another map gives (1, 1).
    pub fn line_col(&self, id: FileId, offset: u32) -> (u32, u32) {
        let Some(file) = self.file(id) else { return (1, 1) };
        let offset = offset.min(file.text.len() as u32);
        let line = file.line_starts.partition_point(|&start| start <= offset);
        let start = file.line_starts.get(line.wrapping_sub(1)).copied().unwrap_or(0);
        let column = file.characters_before(offset) - file.characters_before(start);
        (line.max(1) as u32, column + 1)
    }

    /// The offset at which a line (from 1) begins; that of the text's end for lines beyond the last one.
    pub fn line_start(&self, id: FileId, line: u32) -> u32 {
        let Some(file) = self.file(id) else { return 0 };
        let start = file.line_starts.get((line as usize).wrapping_sub(1));
        start.copied().unwrap_or(file.text.len() as u32)
    }

    /// The number of lines of a file; an empty file has one.
    pub fn line_count(&self, id: FileId) -> u32 {
        self.file(id).map_or(1, |f| f.line_starts.len() as u32)
    }

    /// The text of the line with this number, from 1, without its line end; empty if there is no
    /// such line.
    pub fn line_text(&self, id: FileId, line: u32) -> &str {
        let Some(file) = self.file(id) else { return "" };
        let start =
            file.line_starts.get((line as usize).wrapping_sub(1)).copied().unwrap_or(0) as usize;
        let end = file.line_starts.get(line as usize).map_or(file.text.len(), |&e| e as usize);
        file.text.get(start..end).unwrap_or("").trim_end_matches(['\r', '\n'])
    }
}

/// The offset of each line's first byte, rising.
fn line_starts(text: &str) -> Vec<u32> {
    let bytes = text.as_bytes();
    let mut lines = vec![0];
    for (i, &b) in bytes.iter().enumerate() {
        if b == b'\n' || (b == b'\r' && bytes.get(i + 1) != Some(&b'\n')) {
            lines.push(i as u32 + 1);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::SourceMap;

    #[test]
    fn every_kind_of_line_end_counts_once() {
        let mut map = SourceMap::new();
        let id = map.add("a", b"A\r\nB\nC\rD");
        assert_eq!(map.line_col(id, 0), (1, 1));
        assert_eq!(map.line_col(id, 3), (2, 1));
        assert_eq!(map.line_col(id, 5), (3, 1));
        assert_eq!(map.line_col(id, 7), (4, 1));
        assert_eq!(map.line_col(id, 99), (4, 2));
        assert_eq!(map.line_text(id, 2), "B");
        for offset in 0..12 {
            assert_eq!(map.line(id, offset), map.line_col(id, offset).0);
        }
    }

    #[test]
    fn columns_of_long_lines_are_characters() {
        let mut map = SourceMap::new();
        let id = map.add("a", format!("x\n{}\n{}", "é".repeat(3000), "a".repeat(5000)).as_bytes());
        for n in [0, 1, 511, 512, 1023, 2999] {
            assert_eq!(map.line_col(id, 2 + 2 * n), (2, n + 1));
        }
        assert_eq!(map.line_col(id, 6003 + 4999), (3, 5000));
        assert_eq!(map.line_col(id, 6003 + 5000), (3, 5001));
    }

    #[test]
    fn columns_are_characters() {
        let mut map = SourceMap::new();
        let id = map.add("a", "éé=1".as_bytes());
        assert_eq!(map.line_col(id, 4), (1, 3));
    }
}
