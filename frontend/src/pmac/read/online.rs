//! On-line commands (guide, appendix C): those between buffers and those in the texts of COMMAND.
//!
//! What concerns variables, memory, PLCs, motors and coordinate systems becomes an [`Action`]; what concerns the
//! card is only checked for its form.

use plcc_abi::pmac::motion::{Axis, MotionAction, MotionCommand, Query};
use plcc_abi::pmac::{Definition, Kind, PlcOp};

use super::assign::VariableCommand;
use super::cursor::{ParseError, Parsed, syntax_help};
use super::expr::Reader;
use super::motion_command::control_character_motion;
use super::words::{self, Keyword, LETTER, MOTION, ONLINE, PLC, Tail};
use crate::pmac::ast::{Action, Expr, Op, PlcSet, Target, WriteKind};
use crate::pmac::origin::TextRange;

/// The help for a word that is similar to no other.
pub(crate) const PERHAPS_A_NAME: &str = "if it is a name, its #define must come before";

/// What an on-line command does.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum OnlineCommand {
    /// These actions. There are none for what concerns motors and the card alone.
    Do(Vec<Action>),
    /// A PLC's or PLCC's buffer is opened.
    OpenPlc {
        /// Whether it is a PLCC.
        compiled: bool,
        /// Its number, 0 to 31.
        number: u8,
    },
    /// The buffer of a motion program is opened, with its number; without one another buffer of motion.
    OpenMotion(Option<u32>),
    /// The buffer of a kinematic program of the addressed coordinate system is opened: of the inverse one or not.
    OpenKinematics(bool),
    /// L-variables are defined: the first one's number, and how many there are.
    DefineL(u16, u16, Definition),
}

impl OnlineCommand {
    /// A command that has nothing to do.
    pub(crate) const NOTHING: Self = Self::Do(Vec::new());

    /// A command that does one thing.
    pub(crate) fn one(action: Action) -> Self {
        Self::Do(vec![action])
    }
}

impl Reader<'_> {
    /// Reads one on-line command. Entries of a compensation table are commands of their own:
    /// `table` says whether they may be here, and is set to whether they may follow.
    pub(crate) fn online(&mut self, table: &mut bool) -> Parsed<OnlineCommand> {
        let byte = self.cur.peek().to_ascii_uppercase();
        let in_table = std::mem::take(table);
        let next = self.cur.byte_at(1);
        match byte {
            b'0'..=b'9' | b'.' | b'-' => return self.lone_number(in_table, table),
            b'$' if next.is_ascii_hexdigit() => return self.lone_number(in_table, table),
            b',' if in_table => {
                self.cur.pos += 1;
                *table = true;
            }
            b'#' => return self.motor(),
            b'&' => {
                let start = self.cur.pos;
                self.cur.pos += 1;
                if self.cur.peek().is_ascii_digit() {
                    let system = self.addressed("coordinate system", 8, 16)?;
                    return Ok(OnlineCommand::one(Action::System(system)));
                }
                return Ok(self.motion(start, MotionAction::Query(Query::System)));
            }
            b'$' => {
                while matches!(self.cur.byte(), b'$' | b'*') {
                    self.cur.pos += 1;
                }
            }
            b'%' => return self.percentage(),
            b'@' => {
                self.cur.pos += 1;
                while self.cur.byte().is_ascii_hexdigit() || matches!(self.cur.byte(), b'*' | b'.')
                {
                    self.cur.pos += 1;
                }
            }
            b'?' => {
                let start = self.cur.pos;
                while self.cur.byte() == b'?' && self.cur.pos < start + 3 {
                    self.cur.pos += 1;
                }
                let query = match self.cur.pos - start {
                    1 => Query::MotorStatus,
                    2 => Query::SystemStatus,
                    _ => Query::GlobalStatus,
                };
                return Ok(self.motion(start, MotionAction::Query(query)));
            }
            b'/' | b'\\' => {
                let start = self.cur.pos;
                self.cur.pos += 1;
                let hold = byte == b'\\';
                let action = if hold { MotionAction::ProgramHold } else { MotionAction::Halt };
                return Ok(self.motion(start, action));
            }
            b'!' if is_axis(next) => {
                let start = self.cur.pos;
                self.altered_destination()?;
                return Ok(self.motion(start, MotionAction::Refused("PMAC-X9".to_owned())));
            }
            b'^' if next.is_ascii_alphabetic() => {
                self.cur.pos += 2;
                return Ok(OnlineCommand::Do(control_character(next)));
            }
            _ => {
                return match self.variable_kind() {
                    Some(kind) => self.online_variable(kind),
                    None => self.online_word(byte, table),
                };
            }
        }
        Ok(OnlineCommand::NOTHING)
    }

    /// A number by itself: an entry of a compensation table, or else a value for P0.
    fn lone_number(&mut self, in_table: bool, table: &mut bool) -> Parsed<OnlineCommand> {
        let value = self.signed()?;
        *table = in_table;
        if in_table {
            return Ok(OnlineCommand::NOTHING);
        }
        let action = Action::Assign(Target::Var(Kind::P, 0), self.constant(value));
        Ok(OnlineCommand::one(action))
    }

    fn online_variable(&mut self, kind: Kind) -> Parsed<OnlineCommand> {
        match self.variable_command(kind)? {
            VariableCommand::Assign(target, expr) => {
                if let Some(at) = self.double_equals.take() {
                    return syntax_help(at, "`==` is for motion programs", "write `=` here");
                }
                Ok(OnlineCommand::one(Action::Assign(target, expr)))
            }
            VariableCommand::Defaults(first, count, step) => {
                Ok(OnlineCommand::one(Action::Defaults(first, count, step)))
            }
            VariableCommand::Define(kind, first, count) => self.definition_of(kind, first, count),
            VariableCommand::Query => Ok(OnlineCommand::NOTHING),
        }
    }

    /// The definition, after `->`, of the `count` M- or L-variables from `first` on.
    pub(crate) fn definition_of(
        &mut self,
        kind: Kind,
        first: u16,
        count: u16,
    ) -> Parsed<OnlineCommand> {
        self.cur.blanks();
        let start = self.cur.pos;
        let definition = self.definition()?;
        if kind != Kind::L {
            return Ok(OnlineCommand::one(Action::Define(first, count, definition)));
        }
        if !matches!(definition, Definition::X { .. } | Definition::Y { .. }) {
            let at = self.cur.since(start);
            let help = "an L-variable is a part of an X or Y word";
            return syntax_help(at, "L-variables are defined as X: or Y: only", help);
        }
        Ok(OnlineCommand::DefineL(first, count, definition))
    }

    fn online_word(&mut self, byte: u8, table: &mut bool) -> Parsed<OnlineCommand> {
        if byte == b'J' {
            return self.jog();
        }
        if matches!(byte, b'W' | b'R')
            && let Some(command) = self.memory_command(byte)?
        {
            return Ok(command);
        }
        if let Some((word, after)) = words::find(self.cur, ONLINE.or(PLC).or(MOTION)) {
            if !word.is_in(ONLINE) {
                // WHICH=1 is not a shortened WHILE but a name without #define. Nothing that begins
                // with a letter follows these three.
                let unglued =
                    matches!(word.keyword, Keyword::While | Keyword::Address | Keyword::Command);
                let name = unglued
                    && after.pos - self.cur.pos < word.spelling.len()
                    && after.byte().is_ascii_alphabetic();
                return if name { self.unknown_word_error() } else { self.needs_buffer_error() };
            }
            if word.keyword == Keyword::Clear {
                return self.needs_buffer_error();
            }
            let start = self.cur.pos;
            self.cur = after;
            if let Some(action) = self.motion_word(word) {
                return Ok(self.motion(start, action));
            }
            let tail = match word.keyword {
                Keyword::Open => return self.open(),
                Keyword::Define => return self.define_buffer(table),
                Keyword::Delete => return self.delete(),
                Keyword::Switch(op) => {
                    return Ok(OnlineCommand::one(Action::Plc(op, self.switched(op)?)));
                }
                Keyword::Save => return Ok(OnlineCommand::one(Action::Save)),
                Keyword::Close | Keyword::Undefine => Tail::All,
                Keyword::Ring | Keyword::RingRead | Keyword::Lock => Tail::Line,
                Keyword::Unlock => Tail::Number,
                Keyword::SetPhase => Tail::Numbers,
                Keyword::Accepted(tail) => tail,
                _ => Tail::Nothing,
            };
            self.tail(tail);
            return Ok(OnlineCommand::NOTHING);
        }
        if self.is_move(byte) {
            return self.needs_buffer_error();
        }
        if let Some(axis) = Axis::from_letter(byte)
            && self.cur.byte_at(1) == b'='
        {
            let start = self.cur.pos;
            self.cur.pos += 2;
            let value = self.signed()?;
            return Ok(self.motion(start, MotionAction::SetAxis(axis, value)));
        }
        let single =
            (!self.cur.byte_at(1).is_ascii_alphabetic() || self.glued()) && !self.is_after_word();
        if single
            && let Some((word, after)) = words::find(self.cur, LETTER)
            && let Keyword::Accepted(tail) = word.keyword
        {
            let start = self.cur.pos;
            self.cur = after;
            if let Some(action) = self.motion_word(word) {
                return Ok(self.motion(start, action));
            }
            self.tail(tail);
            return Ok(OnlineCommand::NOTHING);
        }
        self.unknown_word_error()
    }

    /// The error for a statement outside any buffer.
    fn needs_buffer_error<T>(&mut self) -> Parsed<T> {
        let at = self.cur.next_word();
        let what = self.cur.text_at(at);
        Err(ParseError {
            code: "PMAC-5",
            at,
            message: format!("`{what}` is for programs, and no buffer is open").into(),
            help: Some("open one with OPEN PLC n CLEAR; a CLOSE may come too early".into()),
        })
    }

    /// Whether a one-letter command is followed by one other.
    fn glued(&self) -> bool {
        self.cur.rest().bytes().take(3).take_while(u8::is_ascii_alphabetic).count() <= 2
    }

    /// Whether two or more letters are directly in front of the cursor, so that a further letter
    /// is a mistake in their word and no command: CLSE, DELETE GATHR. The words for homing are
    /// exceptions: #1HMZK.
    fn is_after_word(&self) -> bool {
        let before = self.cur.glued_word(TextRange::new(self.cur.pos, self.cur.pos));
        before.len() > 1
            && !["HM", "HMZ", "HOME", "HOMEZ"].iter().any(|w| before.eq_ignore_ascii_case(w))
    }

    /// The error for a word that is neither in the table nor defined. Its help is
    /// [`PERHAPS_A_NAME`].
    pub(crate) fn unknown_word_error<T>(&mut self) -> Parsed<T> {
        let at = self.cur.next_word();
        let what = self.cur.text_at(at).to_owned();
        if !what.is_ascii() || !what.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
            return self.cur.expected_at_once("a command or statement");
        }
        // Words that are similar are looked for where the error is reported.
        let message = format!("`{what}` is neither a statement nor defined");
        syntax_help(at, message, PERHAPS_A_NAME)
    }

    /// `!X10Y20`: the destination of the move under way is altered.
    fn altered_destination(&mut self) -> Parsed<()> {
        self.cur.pos += 1;
        while is_axis(self.cur.peek()) {
            self.cur.pos += 1;
            self.expression()?;
        }
        Ok(())
    }

    /// Whether an axis with a position begins here.
    fn is_move(&mut self, byte: u8) -> bool {
        matches!(byte, b'A' | b'C' | b'U'..=b'Z' | b'G' | b'N' | b'T' | b'D')
            && (self.cur.byte_at(1).is_ascii_digit() || matches!(self.cur.byte_at(1), b'(' | b'-'))
    }

    /// Takes what may follow the word of a command.
    fn tail(&mut self, tail: Tail) {
        match tail {
            Tail::Nothing => {}
            Tail::All => {
                let _ = self.cur.eat_word("ALL");
            }
            Tail::Number => {
                let _ = self.cur.number();
            }
            Tail::Numbers => self.numbers(),
            Tail::List => {
                if self.cur.peek() == b'(' {
                    let rest = self.cur.rest();
                    let line = rest.find('\n').unwrap_or(rest.len());
                    self.cur.pos += rest.find(')').map_or(line, |end| (end + 1).min(line));
                }
            }
            Tail::Line => self.cur.skip_line(),
        }
    }

    /// Takes numbers with `,` or `..` between, as far as they go.
    pub(crate) fn numbers(&mut self) {
        while self.cur.number().is_some()
            && (self.cur.eat(b',') || (self.cur.eat(b'.') && self.cur.eat(b'.')))
        {}
    }

    /// A number with a sign or none.
    pub(crate) fn signed(&mut self) -> Parsed<f64> {
        let negative = self.cur.eat(b'-');
        let _ = !negative && self.cur.eat(b'+');
        match self.cur.number() {
            Some(value) => Ok(if negative && value != 0.0 { -value } else { value }),
            None if self.cur.byte() == b'.' => self.cur.expected_at_once("a number"),
            None => self.cur.expected("a number"),
        }
    }

    /// Writes an expression that consists of a number.
    pub(crate) fn constant(&mut self, value: f64) -> Expr {
        let start = self.ops.len();
        self.ops.push(Op::Const(value));
        self.since(start)
    }

    /// `WX:$700,5` and `RHX:$700`: memory written and read.
    fn memory_command(&mut self, byte: u8) -> Parsed<Option<OnlineCommand>> {
        let mut ahead = self.cur;
        ahead.pos += 1;
        if byte == b'R' {
            let _ = ahead.eat(b'H');
        }
        let kind = match ahead.peek().to_ascii_uppercase() {
            b'X' => WriteKind::X,
            b'Y' => WriteKind::Y,
            b'L' => WriteKind::Long,
            b'D' => WriteKind::Double,
            b'P' => WriteKind::Program,
            _ => return Ok(None),
        };
        ahead.pos += 1;
        if kind == WriteKind::Double {
            let _ = ahead.eat(b'P');
        }
        let program = kind == WriteKind::Program;
        if !matches!(ahead.peek(), b':' | b'$') && (program || !ahead.peek().is_ascii_digit()) {
            return Ok(None);
        }
        self.cur = ahead;
        let address = if program {
            let _ = self.cur.eat(b':');
            self.cur.integer().unwrap_or(0) as u32
        } else {
            self.address()?
        };
        let mut values = Vec::new();
        while self.cur.eat(b',') {
            values.push(self.expression()?);
        }
        if byte == b'R' {
            return Ok(Some(OnlineCommand::NOTHING));
        }
        if values.is_empty() {
            return self.cur.expected("`,` and a value");
        }
        Ok(Some(OnlineCommand::one(Action::Write(kind, address, values))))
    }
}

/// Whether a letter names an axis.
fn is_axis(letter: u8) -> bool {
    matches!(letter.to_ascii_uppercase(), b'A'..=b'C' | b'U'..=b'Z')
}

/// What a control character does: `^D` disables all PLCs, others are for motors and coordinate systems.
pub(crate) fn control_character(letter: u8) -> Vec<Action> {
    let disable = |compiled| Action::Plc(PlcOp::Disable, PlcSet { compiled, bits: u32::MAX });
    if letter.eq_ignore_ascii_case(&b'D') {
        return vec![disable(false), disable(true)];
    }
    let text = format!("^{}", letter.to_ascii_uppercase() as char);
    let motion = control_character_motion(letter);
    motion.map(|action| Action::Motion(MotionCommand { text, action })).into_iter().collect()
}
