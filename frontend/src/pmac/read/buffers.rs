//! On-line commands that open, define and delete buffers.

use super::cursor::{Parsed, syntax_help};
use super::expr::Reader;
use super::online::OnlineCommand;
use super::words::{self, BUFFER, Keyword, ONLINE, OPENED};
use crate::pmac::ast::Action;
use plcc_abi::pmac::motion::MotionAction;

impl Reader<'_> {
    /// DEFINE, whose word is taken: the buffer's name, and the rest of the line. `table` is set to
    /// whether the entries of a compensation table may follow.
    pub(crate) fn define_buffer(&mut self, table: &mut bool) -> Parsed<OnlineCommand> {
        self.cur.blanks();
        let at = self.cur.next_word();
        let Some((word, after)) = words::find(self.cur, BUFFER) else {
            let what = format!("`{}` is not a buffer that can be defined", self.cur.text_at(at));
            return syntax_help(at, what, "GATHER, ROTARY, TBUF, UBUFFER, COMP…");
        };
        *table = word.spelling.ends_with("COMP");
        let start = self.cur.pos;
        if word.spelling == "TBUF" {
            self.cur = after;
            let count = self.cur.integer().unwrap_or(0).min(u64::from(u16::MAX)) as u16;
            self.cur.skip_line();
            return Ok(self.motion(start, MotionAction::Transformations(count)));
        }
        self.cur.skip_line();
        Ok(OnlineCommand::NOTHING)
    }

    /// OPEN, whose word is taken.
    pub(crate) fn open(&mut self) -> Parsed<OnlineCommand> {
        if self.cur.eat_word("PLC") {
            let compiled = matches!(self.cur.byte(), b'C' | b'c')
                && !self.cur.starts_with("CLEAR")
                && !self.cur.starts_with("CLR");
            self.cur.pos += usize::from(compiled);
            let number = self.plc_number()?;
            return Ok(OnlineCommand::OpenPlc { compiled, number });
        }
        match words::find(self.cur, OPENED) {
            Some((word, after)) => {
                self.cur = after;
                if self.is_turbo() && matches!(word.spelling, "FORWARD" | "FWD" | "INVERSE") {
                    return Ok(OnlineCommand::OpenKinematics(word.spelling == "INVERSE"));
                }
                let numbered = word.spelling == "PROGRAM";
                let clears = words::find(self.cur, ONLINE)
                    .is_some_and(|(word, _)| word.keyword == Keyword::Clear);
                let number = if numbered { self.cur.integer() } else { None };
                if numbered
                    && number.is_none()
                    && (self.cur.byte().is_ascii_alphabetic() || self.cur.byte() == b'_')
                    && !clears
                {
                    return self.cur.expected("a motion program's number");
                }
                let number = number.map(|number| u32::try_from(number).unwrap_or(u32::MAX));
                Ok(OnlineCommand::OpenMotion(number))
            }
            None => self.cur.expected("PLC, PLCC, PROG, ROTARY, FORWARD or INVERSE"),
        }
    }

    /// DELETE, whose word is taken.
    pub(crate) fn delete(&mut self) -> Parsed<OnlineCommand> {
        if self.cur.eat_word("PLCC") {
            let number = self.plc_number()?;
            return Ok(OnlineCommand::one(Action::DeletePlcc(number)));
        }
        if !self.cur.eat_word("PLC") {
            let all = self.cur.eat_abbreviated("ALL", 3);
            match words::find(self.cur, BUFFER.or(OPENED)) {
                Some((word, after)) => {
                    let start = self.cur.pos;
                    self.cur = after;
                    if word.spelling == "TBUF" {
                        return Ok(self.motion(start, MotionAction::Transformations(0)));
                    }
                }
                None if all => {}
                None => {
                    return self
                        .cur
                        .expected("GATHER, TRACE, ROTARY, COMP, PLCC or another buffer");
                }
            }
        }
        let _ = self.cur.integer();
        Ok(OnlineCommand::NOTHING)
    }
}
