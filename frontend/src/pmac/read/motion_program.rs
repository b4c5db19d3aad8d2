//! The statements of motion programs (guide, Writing a Motion Program; appendix D). Unlike in PLCs lines count: the
//! axis words of a line are one move, and IF and WHILE with statements behind them end with their line.

use plcc_abi::pmac::Kind;
use plcc_abi::pmac::motion::{
    Axis, AxisSet, LineWord, Mode, MotionKind, MoveWord, SyncOp, TimeWord, TransformationWord,
};
use plcc_diag::Diagnostic;

use super::cursor::{Parsed, syntax, syntax_help};
use super::download::DownloadReader;
use super::skip::names_buffer;
use super::words::{self, Keyword, MOTION, PLC};
use crate::pmac::ast::{Expr, MotionStmt, StmtKind};
use crate::pmac::origin::TextRange;

/// The axis words of a line so far.
#[derive(Debug, Default)]
pub(crate) struct PendingMove {
    pub(super) words: Vec<MoveWord>,
    pub(super) values: Vec<Expr>,
    pub(super) line_words: Vec<LineWord>,
    /// Where it begins and ends in the text.
    pub(super) start: usize,
    pub(super) end: usize,
}

impl DownloadReader<'_> {
    /// A line of the motion program that is open.
    pub(crate) fn motion_line(&mut self) {
        self.reader.cur.crosses_lines = false;
        self.end_calls();
        loop {
            self.reader.cur.blanks();
            if matches!(self.reader.cur.byte(), b'\n' | b'\r' | 0) || self.open.is_none() {
                break;
            }
            let start = self.reader.cur.pos;
            if let Err(error) = self.motion_statement() {
                self.report(error);
                self.reader.cur.pos = self.reader.cur.pos.max(start);
                if let Some(open) = &mut self.open {
                    open.pending = None;
                }
                self.reader.cur.skip_line();
            } else if self.reader.cur.pos == start {
                self.reader.cur.skip_line();
            }
        }
        if self.open.is_some() {
            self.flush_move();
            self.end_one_line_branches();
        }
    }

    /// One statement of a motion program.
    fn motion_statement(&mut self) -> Parsed<()> {
        let start = self.reader.cur.pos;
        let byte = self.reader.cur.byte().to_ascii_uppercase();
        let kind = self.reader.variable_kind();
        if let Some(kind) = kind
            && self.is_assignment(kind)
        {
            self.flush_move();
            return self.motion_assignment(kind, start);
        }
        // Q5 and P1 alone do nothing, but READ can take them; M3 and I5 are words.
        if let Some(Kind::P | Kind::Q | Kind::L) = kind
            && self.is_behind_call()
        {
            self.reader.cur.pos += 1;
            return self.letter_word(byte, start);
        }
        if let Some(Kind::P | Kind::Q | Kind::L) = kind {
            self.flush_move();
            self.reader.cur.pos += 1;
            let at = self.reader.cur.next_word();
            let at = TextRange::new(start, at.end as usize);
            return syntax_help(at, "a variable alone does nothing", "assign to it: P1=…");
        }
        if kind.is_none()
            && let Some((word, after)) = words::find(self.reader.cur, PLC.or(MOTION))
        {
            let before = std::mem::replace(&mut self.reader.cur, after);
            return self.motion_keyword(word.keyword, word.spelling, before.pos);
        }
        let next = self.reader.cur.byte_at(1);
        let has_data = next.is_ascii_digit()
            || matches!(next, b'(' | b'-' | b'+' | b'.' | b'$' | b' ' | b'\t');
        if !byte.is_ascii_alphabetic() || !has_data {
            self.flush_move();
            return self.reader.unknown_word_error();
        }
        self.reader.cur.pos += 1;
        self.letter_word(byte, start)
    }

    /// Whether a variable at the cursor is assigned to or defined, so that it is not a word.
    pub(super) fn is_assignment(&self, kind: Kind) -> bool {
        let mut ahead = self.reader.cur;
        ahead.pos += 1;
        if ahead.peek() == b'(' {
            let mut depth = 0;
            loop {
                match ahead.byte() {
                    b'(' => depth += 1,
                    b')' => depth -= 1,
                    b'\n' | 0 => return false,
                    _ => {}
                }
                ahead.pos += 1;
                if depth == 0 {
                    break;
                }
            }
        } else if ahead.integer().is_none() {
            return false;
        }
        match ahead.peek() {
            b'=' => true,
            b'&' | b'|' | b'^' => ahead.byte_at(1) == b'=',
            b'-' => matches!(kind, Kind::M | Kind::L) && ahead.byte_at(1) == b'>',
            b'.' => ahead.byte_at(1) == b'.',
            b',' => true,
            _ => false,
        }
    }

    /// An assignment, a synchronous one, or a definition.
    fn motion_assignment(&mut self, kind: Kind, start: usize) -> Parsed<()> {
        let mut ahead = self.reader.cur;
        ahead.pos += 1;
        let number = if ahead.peek() == b'(' { None } else { ahead.integer() };
        ahead.blanks();
        let op = match (ahead.byte(), ahead.byte_at(1)) {
            (b'=', b'=') => Some(SyncOp::Set),
            (b'&', b'=') => Some(SyncOp::And),
            (b'|', b'=') => Some(SyncOp::Or),
            (b'^', b'=') => Some(SyncOp::Xor),
            _ => None,
        };
        match (op, kind, number) {
            (Some(op), Kind::M, Some(number)) => {
                let last = u64::from(self.reader.last_variable());
                if number > last {
                    let at = TextRange::new(start, ahead.pos);
                    let message = format!("there are variables 0 to {last}, not {number}");
                    return Err(self.reader.beyond_controller(at, message));
                }
                ahead.pos += 2;
                self.reader.cur.pos = ahead.pos;
                let value = self.reader.expression()?;
                self.push_motion(MotionKind::Sync(op, number as u32), vec![value], start);
                Ok(())
            }
            (Some(SyncOp::Set), _, _) => {
                let at = TextRange::new(ahead.pos, ahead.pos + 2);
                let help = "only M-variables by their numbers wait for a move; write `=`";
                syntax_help(at, "`==` is for M-variables", help)
            }
            _ => self.assignment(kind, start),
        }
    }

    /// A statement that begins with a word of the language, which is taken.
    fn motion_keyword(&mut self, keyword: Keyword, spelling: &str, start: usize) -> Parsed<()> {
        if !matches!(spelling, "TA" | "TS" | "TM") {
            self.flush_move();
        }
        match keyword {
            Keyword::If => self.motion_branch(false, start),
            Keyword::While => self.motion_branch(true, start),
            Keyword::Else => self.motion_else(start),
            Keyword::EndIf => {
                self.warn_of_needless_end(start, "ENDIF");
                self.end_if(start);
                Ok(())
            }
            Keyword::EndWhile => {
                self.motion_end_while(start);
                Ok(())
            }
            Keyword::Command => self.command(start),
            Keyword::Send => self.send(start),
            Keyword::Display => self.display(start),
            Keyword::Switch(op) => {
                let plcs = self.reader.switched(op)?;
                self.push(StmtKind::Plc(op, plcs), start);
                Ok(())
            }
            Keyword::Close => self.motion_close(start),
            Keyword::Clear => self.clear(),
            Keyword::Return => self.plain(MotionKind::Return, start),
            Keyword::Open if !names_buffer(self.reader.cur) => {
                self.reader.cur.pos = start;
                self.reader.unknown_word_error()
            }
            Keyword::Open | Keyword::Define | Keyword::Delete | Keyword::Undefine => {
                self.reader.cur.pos = start;
                if keyword == Keyword::Open {
                    self.open_in_buffer()
                } else {
                    self.online_in_buffer(start)
                }
            }
            Keyword::Lock => self.lock(start),
            Keyword::Unlock => {
                let _ = self.reader.cur.integer();
                Ok(())
            }
            Keyword::SetPhase => {
                self.reader.numbers();
                Ok(())
            }
            Keyword::Ring | Keyword::RingRead => {
                self.reader.cur.pos = start;
                self.macro_ring(keyword == Keyword::RingRead, start)
            }
            Keyword::And | Keyword::Or => {
                let at = TextRange::new(start, self.reader.cur.pos);
                let message = format!(
                    "in a motion program {spelling} is written inside the parentheses of a condition"
                );
                syntax_help(at, message, "IF (P1=1 AND P2=1)")
            }
            Keyword::Address => {
                let at = TextRange::new(start, self.reader.cur.pos);
                syntax_help(
                    at,
                    "ADDRESS is for PLCs",
                    "a motion program's commands are for its own system",
                )
            }
            _ => self.motion_word(spelling, start),
        }
    }

    fn motion_word(&mut self, spelling: &str, start: usize) -> Parsed<()> {
        // Without axes the vectors of arcs stay as they are (guide, Circular Interpolation).
        let all = AxisSet::AXES;
        match spelling {
            "LINEAR" => self.plain(MotionKind::Mode(Mode::Linear), start),
            "RAPID" | "RPD" => self.plain(MotionKind::Mode(Mode::Rapid), start),
            "CIRCLE" => self.numbered_mode([Mode::Circle1, Mode::Circle2], start),
            "SPLINE" => self.numbered_mode([Mode::Spline1, Mode::Spline2], start),
            "PVT" => self.with_data(MotionKind::Mode(Mode::Pvt), start),
            "TA" => self.with_data(MotionKind::Time(TimeWord::Ta), start),
            "TS" => self.with_data(MotionKind::Time(TimeWord::Ts), start),
            "TM" => self.with_data(MotionKind::Time(TimeWord::Tm), start),
            "DWELL" => self.with_data(MotionKind::Dwell, start),
            "DELAY" | "DLY" => self.with_data(MotionKind::Delay, start),
            "GOTO" => self.with_data(MotionKind::Goto, start),
            "GOSUB" => self.call_with_words(MotionKind::Gosub, 0, start),
            "CALL" => self.call_with_words(MotionKind::Call, 0, start),
            "WAIT" => self.plain(MotionKind::Wait, start),
            "STOP" => self.plain(MotionKind::Stop, start),
            "BLOCKSTART" | "BSTART" => self.plain(MotionKind::BlockStart, start),
            "BLOCKSTOP" | "BSTOP" => self.plain(MotionKind::BlockStop, start),
            "ABS" | "INC" => {
                let axes = self.reader.axis_list().unwrap_or(all);
                self.plain(MotionKind::Incremental(spelling == "INC", axes), start)
            }
            "FRAX" | "FRAX2" => {
                let axes = self.reader.axis_list().unwrap_or(AxisSet::AXES);
                self.plain(MotionKind::FeedrateAxes(axes.without(AxisSet::R)), start)
            }
            "NOFRAX" => self.plain(MotionKind::FeedrateAxes(AxisSet::NONE), start),
            "NORMAL" | "NRM" => self.normal(start),
            "HOME" | "HM" | "HOMEZ" | "HMZ" => {
                let motors = self.motor_list()?;
                let kind = match spelling {
                    "HOME" | "HM" => MotionKind::Home(motors),
                    _ => MotionKind::HomeZero(motors),
                };
                self.plain(kind, start)
            }
            "PSET" => self.pset(start),
            "CC0" => Ok(()),
            "TSELECT" | "TINIT" | "ADIS" | "AROT" | "IDIS" | "IROT" => {
                let word = match spelling {
                    "TSELECT" => TransformationWord::Select,
                    "TINIT" => TransformationWord::Init,
                    "ADIS" => TransformationWord::Displace,
                    "IDIS" => TransformationWord::DisplaceMore,
                    "AROT" => TransformationWord::Rotate,
                    _ => TransformationWord::RotateMore,
                };
                let kind = MotionKind::Transformation(word);
                if word == TransformationWord::Init {
                    return self.plain(kind, start);
                }
                self.reader.cur.pos += self.letters_left();
                self.with_data(kind, start)
            }
            "READ" => self.read_words(start),
            "PRELUDE" => self.prelude(start),
            "CC1" | "CC2" | "CC3" | "LEARN" | "LRN" => {
                self.reader.cur.skip_line();
                self.plain(MotionKind::Unsupported, start)
            }
            "CCR" => {
                let value = self.data()?;
                if self.constant_of(value) == Some(0.0) {
                    return Ok(());
                }
                self.plain(MotionKind::Unsupported, start)
            }
            _ => {
                self.reader.cur.pos = start;
                self.reader.unknown_word_error()
            }
        }
    }

    /// How many letters follow directly: the rest of a long form such as ADISPLACE.
    fn letters_left(&self) -> usize {
        self.reader.cur.rest().bytes().take_while(u8::is_ascii_alphabetic).count()
    }

    /// Appends a statement of motion.
    pub(crate) fn push_motion(&mut self, kind: MotionKind, values: Vec<Expr>, start: usize) {
        self.push_words(kind, values, Vec::new(), start);
    }

    /// Appends a statement of motion whose values belong to words of a line with a call.
    pub(super) fn push_words(
        &mut self,
        kind: MotionKind,
        values: Vec<Expr>,
        words: Vec<LineWord>,
        start: usize,
    ) {
        let first = values.iter().map(|value| value.start).min().unwrap_or(0);
        let end = values.iter().map(|value| value.start + value.len).max().unwrap_or(first);
        let all = Expr { start: first, len: end - first };
        let index = self.download.motion.len() as u32;
        self.download.motion.push(MotionStmt { kind, values, words });
        self.push(StmtKind::Motion(index, all), start);
    }

    fn plain(&mut self, kind: MotionKind, start: usize) -> Parsed<()> {
        self.push_motion(kind, Vec::new(), start);
        Ok(())
    }

    pub(super) fn with_data(&mut self, kind: MotionKind, start: usize) -> Parsed<()> {
        let value = self.data()?;
        self.push_motion(kind, vec![value], start);
        Ok(())
    }

    /// CIRCLE1 and 2, SPLINE1 and 2.
    fn numbered_mode(&mut self, [first, second]: [Mode; 2], start: usize) -> Parsed<()> {
        self.reader.cur.blanks();
        let at = self.reader.cur.next_word();
        let mode = match self.reader.cur.integer() {
            Some(1) => first,
            Some(2) => second,
            None if first == Mode::Spline1 => first,
            _ => return syntax(at, "this is followed by 1 or 2"),
        };
        self.plain(MotionKind::Mode(mode), start)
    }

    /// NORMAL and its vector.
    fn normal(&mut self, start: usize) -> Parsed<()> {
        let (mut components, mut values) = (Vec::new(), Vec::new());
        while let letter @ (b'I' | b'J' | b'K') = self.reader.cur.peek().to_ascii_uppercase() {
            self.reader.cur.pos += 1;
            values.push(self.data()?);
            components.push(letter - b'I');
        }
        if components.is_empty() {
            return self.reader.cur.expected("I, J or K and a number");
        }
        self.push_motion(MotionKind::Normal(components), values, start);
        Ok(())
    }

    /// The motors of HOME and HOMEZ: numbers and ranges with commas between.
    fn motor_list(&mut self) -> Parsed<u32> {
        let mut set = 0u32;
        loop {
            let first = self.reader.addressed("motor", 8, 32)?;
            let mut last = first;
            if self.reader.cur.peek() == b'.' && self.reader.cur.byte_at(1) == b'.' {
                self.reader.cur.pos += 2;
                last = self.reader.addressed("motor", 8, 32)?;
            }
            for motor in first.max(1)..=last {
                set |= 1 << (motor - 1);
            }
            if !self.reader.cur.eat(b',') {
                return Ok(set);
            }
        }
    }

    /// PSET and its axes.
    fn pset(&mut self, start: usize) -> Parsed<()> {
        let (mut axes, mut values) = (Vec::new(), Vec::new());
        while let Some(axis) = Axis::from_letter(self.reader.cur.peek()) {
            let next = self.reader.cur.byte_at(1);
            if next.is_ascii_alphabetic() {
                break;
            }
            self.reader.cur.pos += 1;
            values.push(self.data()?);
            axes.push(axis);
        }
        if axes.is_empty() {
            return self.reader.cur.expected("an axis and its position");
        }
        self.push_motion(MotionKind::Set(axes), values, start);
        Ok(())
    }

    /// CLOSE, at which the control appends a RETURN.
    fn motion_close(&mut self, start: usize) -> Parsed<()> {
        let at = self.reader.cur.since(start);
        let mut ahead = self.reader.cur;
        if ahead.eat_word("ALL") {
            self.reader.cur.pos = ahead.pos;
        }
        self.end_one_line_branches();
        self.close_motion(at);
        Ok(())
    }

    fn warn_of_needless_end(&mut self, start: usize, word: &str) {
        let one_line = self
            .open
            .as_ref()
            .and_then(|open| open.frames.last())
            .is_some_and(|frame| frame.one_line);
        if one_line {
            let at = self.reader.cur.since(start);
            self.tell(at, |span| {
                let message = format!("{word} on the line of its IF is not needed");
                Diagnostic::warning("PMAC-W21", span, message)
                    .note("an IF with a statement after it on its line ends with that line")
                    .help("leave it out, or write the statements on lines of their own")
            });
        }
    }
}
