//! The contacts of PMAC's conditions: what AND and OR join.

use std::ops::Range;

use plcc_diag::{SourceMap, Span};

use super::ast::{Stmt, StmtKind};
use super::tasks::tasks;
use super::{COMMENT_MARKS, Program};
use crate::common::{Gate, Logic, LogicBuilder};

/// How deep parentheses may nest.
const MAX_DEPTH: usize = 256;

impl Program {
    /// As [`logic`](crate::CheckedProgram::logic).
    pub(super) fn contacts(&self, sources: &SourceMap) -> Vec<Option<Logic>> {
        let tasks = tasks(&self.download, &self.loaded);
        let all = tasks.iter().flat_map(|(_, code)| code.iter());
        all.map(|stmt| self.contacts_of(stmt, sources)).collect()
    }

    fn contacts_of(&self, stmt: &Stmt, sources: &SourceMap) -> Option<Logic> {
        if !matches!(stmt.kind, StmtKind::If(..) | StmtKind::While(..)) {
            return None;
        }
        let span = self.download.origins.place(stmt.at).0;
        let text = without_comments(sources.slice(span));
        let begin = text.find('(')?;
        let mut split =
            Split { program: self, text: &text, span, builder: LogicBuilder::default() };
        split.condition(begin..text.len(), 0)?;
        split.builder.finish()
    }
}

/// A text with blanks in the place of comments.
fn without_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        let end =
            COMMENT_MARKS.iter().filter_map(|mark| line.find(mark)).min().unwrap_or(line.len());
        out.push_str(line.get(..end).unwrap_or_default());
        let rest = line.get(end..).unwrap_or_default().bytes();
        out.extend(rest.map(|byte| if byte == b'\n' { '\n' } else { ' ' }));
    }
    out
}

/// Splits a condition at its gates.
struct Split<'s> {
    program: &'s Program,
    text: &'s str,
    span: Span,
    builder: LogicBuilder,
}

impl Split<'_> {
    /// A condition; OR binds less than AND.
    fn condition(&mut self, range: Range<usize>, depth: usize) -> Option<()> {
        if depth > MAX_DEPTH {
            return None;
        }
        let range = trimmed(self.text, range);
        for (word, gate) in [("OR", Gate::Or), ("AND", Gate::And)] {
            let operands = operands(self.text, range.clone(), word);
            if operands.len() < 2 {
                continue;
            }
            for (number, operand) in operands.into_iter().enumerate() {
                self.condition(operand, depth + 1)?;
                if number > 0 {
                    self.builder.gate(gate);
                }
            }
            return Some(());
        }
        let text = self.text.get(range.clone())?;
        if closes_at_its_end(text) {
            return self.condition(range.start + 1..range.end - 1, depth + 1);
        }
        let value = self.program.expression_of(text)?;
        let start = self.span.start + range.start as u32;
        let span = Span { file: self.span.file, start, end: start + text.len() as u32 };
        let name: String = text.split_whitespace().collect();
        self.builder.contact(&name, span, value);
        Some(())
    }
}

impl Program {
    /// A condition of a PLC or PLCC.
    fn expression_of(&self, text: &str) -> Option<crate::common::Expression> {
        use crate::language::CheckedProgram;
        self.expression(text).ok()
    }
}

/// A range without blanks at its ends.
fn trimmed(text: &str, range: Range<usize>) -> Range<usize> {
    let part = text.get(range.clone()).unwrap_or_default();
    let start = range.start + (part.len() - part.trim_start().len());
    start..start + part.trim().len()
}

/// What a word joins outside of parentheses.
fn operands(text: &str, range: Range<usize>, word: &str) -> Vec<Range<usize>> {
    let bytes = text.as_bytes();
    let (mut depth, mut begin, mut at) = (0usize, range.start, range.start);
    let mut all = vec![];
    while at < range.end {
        match bytes.get(at) {
            Some(b'(') => depth += 1,
            Some(b')') => depth = depth.saturating_sub(1),
            _ => {}
        }
        let here = bytes.get(at..at + word.len());
        let before = at.checked_sub(1).and_then(|before| bytes.get(before));
        let is_word = here.is_some_and(|here| here.eq_ignore_ascii_case(word.as_bytes()))
            && !before.is_some_and(u8::is_ascii_alphabetic);
        if depth == 0 && is_word {
            all.push(begin..at);
            begin = at + word.len();
            at = begin;
            continue;
        }
        at += 1;
    }
    all.push(begin..range.end);
    all
}

/// Whether the parenthesis at the beginning of a text is closed by the one at its end.
fn closes_at_its_end(text: &str) -> bool {
    let mut depth = 0usize;
    for (at, c) in text.char_indices() {
        match c {
            '(' => depth += 1,
            ')' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth == 0 {
            return at > 0 && at + 1 == text.len();
        }
    }
    false
}
