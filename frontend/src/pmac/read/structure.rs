//! The structure of PLCs: IF, ELSE and WHILE with their ends, and the conditions of branches.
//!
//! When IF, ELSE or WHILE is read, the target of its branch is not known yet. It is patched when
//! the statement's end is read. Errors of the structure are kept until the buffer is closed, since
//! the controller reports them there.

use super::cursor::{Cursor, Parsed};
use super::download::{DownloadReader, Open};
use super::words::{self, Keyword, PLC};
use crate::pmac::ast::{Expr, Op, StmtKind};
use crate::pmac::origin::TextRange;

/// Deepest nesting of IF and WHILE.
pub(crate) const MAX_NESTING: usize = 256;

/// An IF or WHILE that is open.
pub(crate) struct Frame {
    /// Where it is.
    pub(crate) at: TextRange,
    /// The index of the statement whose branch target is not known yet.
    pub(crate) patch: usize,
    pub(crate) kind: FrameKind,
    /// Whether it ends with its line, in a motion program.
    pub(crate) one_line: bool,
}

/// Which part of an IF or WHILE is open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FrameKind {
    If,
    Else,
    While,
}

impl Open {
    /// The first error of the structure: its place and what is wrong.
    pub(crate) fn structure_error(&self) -> Option<(TextRange, String)> {
        let unclosed = || {
            let frame = self.frames.last()?;
            let (what, end) = match frame.kind {
                FrameKind::While => ("WHILE", "ENDWHILE"),
                FrameKind::If | FrameKind::Else => ("IF", "ENDIF"),
            };
            Some((frame.at, format!("this {what} has no {end}")))
        };
        self.structure_error.clone().or_else(unclosed)
    }
}

impl DownloadReader<'_> {
    /// IF or WHILE, whose word is taken and begins at the offset `start`.
    pub(crate) fn branch(&mut self, kind: FrameKind, start: usize) -> Parsed<()> {
        let at = self.reader.cur.since(start);
        let byte = self.reader.cur.byte();
        let condition = if byte.is_ascii_alphanumeric() || byte == b'_' {
            // The word goes on, so it is another one. If a parenthesis follows it is a misspelt IF
            // or WHILE: WHIEL (P1=1).
            self.reader.cur.pos = start;
            let mut ahead = self.reader.cur;
            ahead.pos = ahead.next_word().end as usize;
            let error = self.reader.unknown_word_error();
            if ahead.peek() != b'(' {
                return error;
            }
            error.map(|()| Expr::default())
        } else {
            self.whole_condition()
        };
        let expr = *condition.as_ref().unwrap_or(&Expr::default());
        let patch = self.next_index() as usize;
        let what = if kind == FrameKind::While { StmtKind::While } else { StmtKind::If };
        self.push(what(expr, 0), start);
        let before =
            self.preprocessed.text.get(..start).unwrap_or("").trim_end_matches([' ', '\t']);
        let is_after_else = before.len().checked_sub(4).and_then(|from| before.get(from..));
        let is_after_else = is_after_else.is_some_and(|word| word.eq_ignore_ascii_case("ELSE"));
        if let Some(open) = &mut self.open {
            if kind == FrameKind::If && is_after_else {
                open.else_if.get_or_insert(at);
            }
            if open.frames.len() >= MAX_NESTING && open.structure_error.is_none() {
                open.structure_error = Some((at, "this is nested deeper than 256 levels".into()));
            }
            open.frames.push(Frame { at, patch, kind, one_line: false });
        }
        match condition {
            Ok(_) => Ok(()),
            Err(error) => {
                self.skip_condition_lines();
                Err(error)
            }
        }
    }

    /// Skips the lines with AND and OR that belong to a wrong condition.
    fn skip_condition_lines(&mut self) {
        let mut ahead = self.reader.cur;
        loop {
            ahead.skip_line();
            if let Some((_, after)) = joining(ahead) {
                ahead = after;
                if ahead.peek() != b'(' {
                    return;
                }
                // The rest of the line goes with the error.
                self.reader.cur = ahead;
            } else {
                return;
            }
        }
    }

    /// Records an error of the structure, unless the buffer has one.
    fn misplaced(&mut self, start: usize, message: &str) {
        let at = self.reader.cur.since(start);
        if let Some(open) = &mut self.open
            && open.structure_error.is_none()
        {
            open.structure_error = Some((at, message.into()));
        }
    }

    /// ELSE, whose word is taken and begins at the offset `start`.
    pub(crate) fn else_branch(&mut self, start: usize) {
        let next = self.next_index();
        let frame = match self.open.as_mut().and_then(|open| open.frames.last_mut()) {
            Some(frame) if frame.kind == FrameKind::If => frame,
            _ => return self.misplaced(start, "this ELSE has no IF"),
        };
        let patch = frame.patch;
        frame.kind = FrameKind::Else;
        frame.patch = next as usize;
        self.push(StmtKind::Jump(0), start);
        self.patch(patch, next + 1);
    }

    /// Sets the branch target of the statement at `index`.
    pub(crate) fn patch(&mut self, index: usize, to: u32) {
        if let Some(stmt) = self.buffer().and_then(|buffer| buffer.code.get_mut(index)) {
            match &mut stmt.kind {
                StmtKind::If(_, target) | StmtKind::While(_, target) | StmtKind::Jump(target) => {
                    *target = to
                }
                _ => {}
            }
        }
    }

    /// ENDIF, whose word is taken and begins at the offset `start`.
    pub(crate) fn end_if(&mut self, start: usize) {
        let next = self.next_index();
        match self.open.as_mut().and_then(|open| open.frames.pop()) {
            Some(frame) if frame.kind != FrameKind::While => self.patch(frame.patch, next),
            Some(frame) => {
                if let Some(open) = &mut self.open {
                    open.frames.push(frame);
                }
                self.misplaced(start, "this ENDIF is in a WHILE whose ENDWHILE is missing");
            }
            None => self.misplaced(start, "this ENDIF has no IF"),
        }
    }

    /// ENDWHILE, whose word is taken and begins at the offset `start`.
    pub(crate) fn end_while(&mut self, start: usize) {
        let next = self.next_index();
        match self.open.as_mut().and_then(|open| open.frames.pop()) {
            Some(frame) if frame.kind == FrameKind::While => {
                self.push(StmtKind::EndWhile(frame.patch as u32), start);
                self.patch(frame.patch, next + 1);
            }
            Some(frame) => {
                if let Some(open) = &mut self.open {
                    open.frames.push(frame);
                }
                self.misplaced(start, "this ENDWHILE is in an IF whose ENDIF is missing");
            }
            None => self.misplaced(start, "this ENDWHILE has no WHILE"),
        }
    }

    /// A condition with the further ones that AND and OR join to it, on the same line or the next
    /// ones.
    pub(crate) fn whole_condition(&mut self) -> Parsed<Expr> {
        let start = self.reader.ops.len();
        self.reader.condition()?;
        let mut pending = false;
        while let Some((both, after)) = joining(self.reader.cur) {
            self.reader.cur = after;
            if !both && pending {
                self.reader.ops.push(Op::Either);
            }
            self.reader.condition()?;
            if both {
                self.reader.ops.push(Op::Both);
            } else {
                pending = true;
            }
        }
        if pending {
            self.reader.ops.push(Op::Either);
        }
        Ok(self.reader.since(start))
    }
}

/// Whether AND (true) or OR (false) is at `cur` and joins a further condition, and a cursor
/// after it.
fn joining(cur: Cursor<'_>) -> Option<(bool, Cursor<'_>)> {
    let (word, after) = words::find(cur, PLC)?;
    match word.keyword {
        Keyword::And => Some((true, after)),
        Keyword::Or => Some((false, after)),
        _ => None,
    }
}
