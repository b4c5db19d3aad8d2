//! The structure of motion programs: IF, ELSE and WHILE, which end with their line where statements stand behind them
//! on it, and what is done when the buffer is closed.

use plcc_abi::pmac::motion::MotionKind;
use plcc_diag::Diagnostic;

use super::cursor::Parsed;
use super::download::DownloadReader;
use super::structure::{Frame, FrameKind, MAX_NESTING};
use crate::pmac::ast::{Buffer, Download, MotionStmt, StmtKind};
use crate::pmac::origin::TextRange;

impl DownloadReader<'_> {
    /// Whether statements stand behind the cursor on its line.
    fn has_more_on_line(&mut self) -> bool {
        self.reader.cur.blanks();
        !matches!(self.reader.cur.byte(), b'\n' | b'\r' | 0)
    }

    /// IF or WHILE, whose word is taken and begins at the offset `start`.
    pub(crate) fn motion_branch(&mut self, repeats: bool, start: usize) -> Parsed<()> {
        let at = self.reader.cur.since(start);
        let condition = self.reader.condition();
        let patch = self.next_index() as usize;
        let expr = *condition.as_ref().unwrap_or(&Default::default());
        let (kind, what) = match repeats {
            true => (FrameKind::While, StmtKind::While(expr, 0)),
            false => (FrameKind::If, StmtKind::If(expr, 0)),
        };
        self.push(what, start);
        let one_line = condition.is_ok() && self.has_more_on_line();
        if let Some(open) = &mut self.open {
            if open.frames.len() >= MAX_NESTING && open.structure_error.is_none() {
                open.structure_error = Some((at, "this is nested deeper than 256 levels".into()));
            }
            open.frames.push(Frame { at, patch, kind, one_line });
        }
        condition.map(|_| ())
    }

    /// ELSE, whose word is taken. It belongs to the nearest IF on its line, to a one-line IF that is the statement
    /// before it, or to the IF that is open.
    pub(crate) fn motion_else(&mut self, start: usize) -> Parsed<()> {
        let next = self.next_index();
        let one_line = self.has_more_on_line();
        let before =
            self.open.as_ref().and_then(|open| open.last_if).filter(|(_, end)| *end == next);
        let on_this_line = self
            .open
            .as_ref()
            .and_then(|open| open.frames.last())
            .is_some_and(|frame| frame.one_line && frame.kind == FrameKind::If);
        match before {
            Some((branch, _)) if !on_this_line => {
                let at = self.reader.cur.since(start);
                self.push(StmtKind::Jump(0), start);
                self.patch(branch, next + 1);
                if let Some(open) = &mut self.open {
                    let (patch, kind) = (next as usize, FrameKind::Else);
                    open.frames.push(Frame { at, patch, kind, one_line });
                    open.last_if = None;
                }
            }
            _ => {
                self.else_branch(start);
                let frame = self.open.as_mut().and_then(|open| open.frames.last_mut());
                if let Some(frame) = frame.filter(|frame| frame.kind == FrameKind::Else) {
                    frame.one_line |= one_line;
                }
            }
        }
        Ok(())
    }

    /// ENDWHILE, whose word is taken.
    pub(crate) fn motion_end_while(&mut self, start: usize) {
        let head = self.open.as_ref().and_then(|open| open.frames.last());
        match head.filter(|frame| frame.kind == FrameKind::While).map(|frame| frame.patch) {
            Some(head) => {
                if let Some(open) = &mut self.open {
                    open.frames.pop();
                }
                self.push_loop(head, start);
            }
            // Says what is wrong.
            None => self.end_while(start),
        }
    }

    fn push_loop(&mut self, head: usize, start: usize) {
        let motion = self.download.motion.len() as u32;
        let kind = MotionKind::EndWhile;
        self.download.motion.push(MotionStmt { kind, values: Vec::new(), words: Vec::new() });
        self.push(StmtKind::Loop(head as u32, motion), start);
        let next = self.next_index();
        self.patch(head, next);
    }

    /// The line ends, and with it the IF, ELSE and WHILE that have statements behind them on it.
    pub(crate) fn end_one_line_branches(&mut self) {
        let mut first = true;
        loop {
            let Some(open) = &mut self.open else { return };
            let Some(frame) = open.frames.pop_if(|frame| frame.one_line) else { return };
            if frame.kind == FrameKind::While {
                let start = self.reader.cur.pos;
                self.push_loop(frame.patch, start);
                continue;
            }
            let next = self.next_index();
            self.patch(frame.patch, next);
            if first
                && frame.kind == FrameKind::If
                && let Some(open) = &mut self.open
            {
                open.last_if = Some((frame.patch, next));
            }
            first = false;
        }
    }

    /// Closes the motion program. `at` is the place of its CLOSE.
    pub(crate) fn close_motion(&mut self, at: TextRange) {
        self.flush_move();
        let (start, after) = (at.start as usize, self.reader.cur.pos);
        self.reader.cur.pos = at.end as usize;
        self.push_motion(MotionKind::Return, Vec::new(), start);
        self.reader.cur.pos = after;
        let Some(program) = self.open.as_ref().and_then(|open| open.program) else { return };
        let first = self.open.as_ref().map_or(0, |open| open.first_diagnostic);
        self.close(at);
        self.leave_out(first, at, &format!("motion program {program}"), |download| {
            download.progs.get_mut(&program)
        });
    }

    /// Empties a buffer that is closed now, at `at`, if one of the diagnostics from `first` on is an error. Where motion
    /// is not simulated, a warning says so in the place of them all.
    pub(crate) fn leave_out(
        &mut self,
        first: usize,
        at: TextRange,
        name: &str,
        buffer: impl Fn(&mut Download) -> Option<&mut Buffer>,
    ) {
        let first_error = self.diagnostics.iter().skip(first).position(Diagnostic::is_error);
        let Some(error) = first_error else { return };
        let mut opened = None;
        if let Some(buffer) = buffer(&mut self.download) {
            buffer.code.clear();
            buffer.labels.clear();
            buffer.broken = true;
            opened = buffer.opened;
        }
        if self.simulates {
            return;
        }
        let found = self.diagnostics.split_off(first.min(self.diagnostics.len()));
        let Some(error) = found.into_iter().nth(error) else { return };
        let place = error.span;
        let message = error.message;
        self.tell(opened.unwrap_or(at), |span| {
            let what = format!("{name} has errors and is left out");
            Diagnostic::warning("PMAC-W19", span, what)
                .label(place, message.clone())
                .note(message)
                .note("nothing here runs it; with --simulate its errors are errors")
        });
    }
}
