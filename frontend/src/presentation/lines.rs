//! The lines of sources as they are shown: without comments, included files in their place, each cut into its words.

use plcc_diag::{FileId, SourceMap, Span};

use super::text::{Piece, Role};
use crate::common::words::{Appearance, Word, WordKind, Words};

/// How deep files are included in one another at most.
const MAX_INCLUDES: usize = 16;

/// A line to be shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// The file that it stands in.
    pub file: FileId,
    /// Its first line in the file.
    pub line: u32,
    /// Its last line in the file.
    pub end_line: u32,
    /// Its number as it is shown: `12`, or `7.3` for line 3 of the file that line 7 includes.
    pub number: String,
    /// Its tokens, without those at its end that are blank.
    pub pieces: Vec<Piece>,
    /// Of each token, the column at which it begins, from 1.
    pub columns: Vec<u32>,
    /// The text of its comment, without the signs around it; empty without one.
    pub comment: String,
    /// Whether a directive begins it.
    pub is_directive: bool,
    /// Whether its statement goes on in the next line.
    pub(super) goes_on: bool,
}

/// The lines of all files, with the words that were found in them. A line that includes a file is replaced by that file.
pub(super) fn lines(sources: &SourceMap, words: &Words) -> Vec<Line> {
    let mut reader = Reader { sources, words, found: vec![] };
    for file in (0..sources.len() as u32).map(FileId) {
        // A file that another one includes is shown there.
        if !words.includes.iter().any(|&(_, included)| included == file) {
            reader.file(file, None, 0);
        }
    }
    reader.found
}

struct Reader<'a> {
    sources: &'a SourceMap,
    words: &'a Words,
    found: Vec<Line>,
}

impl Reader<'_> {
    /// Takes in a file. `from` is the line of the file that includes it.
    fn file(&mut self, file: FileId, from: Option<u32>, depth: usize) {
        let mut words = self.words.of_file(file);
        for line in 1..=self.sources.line_count(file) {
            let start = self.sources.line_start(file, line);
            let end = start + self.sources.line_text(file, line).len() as u32;
            let here = Span { file, start, end };
            let included = self
                .words
                .includes
                .iter()
                .find(|(at, _)| at.file == file && (start..=end).contains(&at.start));
            if let Some(&(_, inner)) = included.filter(|_| depth < MAX_INCLUDES) {
                self.file(inner, Some(line), depth + 1);
                continue;
            }
            let number = match from {
                Some(outer) => format!("{outer}.{line}"),
                None => line.to_string(),
            };
            while let [first, rest @ ..] = words
                && first.span.end <= start
            {
                words = rest;
            }
            let next = words.partition_point(|word| word.span.start < end);
            let own = words.get(..next).unwrap_or_default();
            self.found.push(self.line(here, (line, number), own));
        }
    }

    /// A line, of which these are the words.
    fn line(&self, at: Span, (line, number): (u32, String), words: &[Word]) -> Line {
        let mut cut = Cut { text: self.sources.slice(at), ..Cut::default() };
        let mut comments = vec![];
        for word in words {
            let from = word.span.start.max(at.start) - at.start;
            let to = word.span.end.min(at.end).saturating_sub(at.start);
            if word.kind == WordKind::Comment {
                let comment = cut.text.get(from as usize..to as usize).unwrap_or_default();
                comments
                    .push(comment.trim_matches(|c: char| c.is_whitespace() || ";?/*".contains(c)));
                cut.comment(from, to);
            } else {
                cut.word(word, from, to);
            }
        }
        cut.up_to(cut.text.len() as u32);
        while cut.pieces.last().is_some_and(|piece| piece.role == Role::Blank) {
            cut.pieces.pop();
            cut.columns.pop();
        }
        let is_directive = words.first().is_some_and(|word| word.kind == WordKind::Directive);
        Line {
            file: at.file,
            line,
            end_line: line,
            number,
            pieces: cut.pieces,
            columns: cut.columns,
            comment: comments.join(" "),
            is_directive,
            goes_on: false,
        }
    }
}

/// A line that is cut into tokens, from left to right.
#[derive(Default)]
struct Cut<'t> {
    text: &'t str,
    /// The offset up to which it is cut.
    at: u32,
    /// The column there, from 0.
    column: u32,
    pieces: Vec<Piece>,
    columns: Vec<u32>,
}

impl Cut<'_> {
    fn push(&mut self, piece: Piece, width: usize) {
        self.pieces.push(piece);
        self.columns.push(self.column + 1);
        self.column += width as u32;
    }

    /// Adds the text between words, up to an offset: white space, and characters that mean nothing to the language.
    fn up_to(&mut self, to: u32) {
        let text = self.text.get(self.at as usize..to as usize).unwrap_or_default();
        for part in text.split_inclusive(|c: char| !c.is_whitespace()) {
            let blank = part.trim_end_matches(|c: char| !c.is_whitespace());
            if !blank.is_empty() {
                self.push(Piece::new(blank, Role::Blank), blank.chars().count());
            }
            let sign = part.get(blank.len()..).unwrap_or_default();
            if !sign.is_empty() {
                self.push(Piece::new(sign, Role::Operator), 1);
            }
        }
        self.at = self.at.max(to);
    }

    /// Puts blanks in the place of a comment, so that columns stay what they were.
    fn comment(&mut self, from: u32, to: u32) {
        self.up_to(from);
        let width =
            self.text.get(from as usize..to as usize).map_or(0, |text| text.chars().count());
        match self.pieces.last_mut() {
            Some(last) if last.role == Role::Blank => {
                last.text.push_str(&" ".repeat(width));
                self.column += width as u32;
            }
            _ => self.push(Piece::new(" ".repeat(width), Role::Blank), width),
        }
        self.at = to;
    }

    fn word(&mut self, word: &Word, from: u32, to: u32) {
        self.up_to(from);
        let text = self.text.get(from as usize..to as usize).unwrap_or_default();
        let role = match word.kind {
            WordKind::Comment => Role::Blank,
            WordKind::Keyword | WordKind::Directive => Role::Keyword,
            WordKind::Variable => Role::Variable,
            WordKind::Constant | WordKind::Number => Role::Constant,
            WordKind::Label => Role::Label,
            WordKind::Text => Role::Text,
            WordKind::Operator => Role::Operator,
        };
        let name = word.name.clone().filter(|_| role == Role::Variable);
        let target = role == Role::Variable && word.appearance == Some(Appearance::Written);
        self.push(Piece { name, target, ..Piece::new(text, role) }, text.chars().count());
        self.at = to;
    }
}
