//! A program that is written in another language: that of IEC 61131-3.

use plcc_diag::{Diagnostic, FileId, SourceMap, Span};
use plcc_iec::Project;

use super::split_comment;

/// A program in IEC 61131-3.
#[derive(Debug)]
pub struct Exported {
    /// The program itself.
    pub project: Project,
    /// Where each variable of the source is in it. Variables that it does not have are not listed.
    pub names: Vec<(String, Held)>,
    /// What is not in it, and has no statement of its own that would be wrong without it.
    pub notes: Vec<Diagnostic>,
}

/// Where a variable of the source is in the program in IEC 61131-3.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Held {
    /// A variable, or an array as a whole.
    Variable(String),
    /// A bit of a number, by its weight.
    Bit(String, u32),
    /// Two bytes: the low one and, if there is one, the high one.
    Bytes(String, Option<String>),
}

/// The comments of a source, line by line.
#[derive(Debug)]
pub(crate) struct Comments {
    /// The number of each line with a comment, from 1, and its text.
    lines: Vec<(u32, String)>,
}

impl Comments {
    /// The comments of a text; `signs` are what begins one.
    pub(crate) fn of(text: &str, signs: &[&str]) -> Self {
        let lines = text.lines().zip(1..).filter_map(|(line, number)| {
            let (_, comment) = split_comment(line, signs);
            (!comment.is_empty()).then(|| (number, comment.to_owned()))
        });
        Self { lines: lines.collect() }
    }

    /// The comments of the lines from one to another; the latter is not among them.
    pub(crate) fn between(&self, from: u32, to: u32) -> impl Iterator<Item = &str> {
        let begin = self.lines.partition_point(|(line, _)| *line < from);
        let lines = self.lines.iter().skip(begin).take_while(move |(line, _)| *line < to);
        lines.map(|(_, text)| text.as_str())
    }

    /// The comment in a line; empty where there is none.
    pub(crate) fn at(&self, line: u32) -> &str {
        self.between(line, line + 1).next().unwrap_or("")
    }
}

/// Hands out the comments of statements in the order of the text, each once: those of the lines in front of a statement, and that
/// of its own line.
#[derive(Debug)]
pub(crate) struct CommentsInOrder {
    /// For each file its comments, and the line that is next.
    files: Vec<(Comments, u32)>,
}

impl CommentsInOrder {
    pub(crate) fn new(sources: &SourceMap, signs: &[&str]) -> Self {
        let ids = (0..sources.len() as u32).map(FileId);
        let files = ids.map(|id| (Comments::of(sources.text(id), signs), 1)).collect();
        Self { files }
    }

    /// What stands in a file before this line is not the comment of a statement.
    pub(crate) fn skip_to(&mut self, file: FileId, line: u32) {
        if let Some((_, next)) = self.files.get_mut(file.0 as usize) {
            *next = line.max(*next);
        }
    }

    /// The comments in front of a statement and after it.
    pub(crate) fn of_statement(&mut self, span: Span, line: u32) -> (Vec<String>, String) {
        let Some((comments, next)) = self.files.get_mut(span.file.0 as usize) else {
            return Default::default();
        };
        if line < *next {
            return Default::default();
        }
        let front = comments.between(*next, line).map(str::to_owned).collect();
        *next = line + 1;
        (front, comments.at(line).to_owned())
    }

    /// The comments after the last statement of a file.
    pub(crate) fn rest(&mut self, span: Span) -> Vec<String> {
        let Some((comments, next)) = self.files.get_mut(span.file.0 as usize) else {
            return vec![];
        };
        comments.between(std::mem::replace(next, u32::MAX), u32::MAX).map(str::to_owned).collect()
    }
}
