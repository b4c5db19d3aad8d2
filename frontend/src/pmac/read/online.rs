//! On-line commands (guide, appendix C): those between buffers and those in the texts of COMMAND.
//!
//! What concerns variables, memory and PLCs becomes an [`Action`]; what concerns motors, coordinate
//! systems and the card is only checked for its form.

use plcc_abi::pmac::{Kind, PlcOp};

use super::assign::VariableCommand;
use super::cursor::{ParseError, Parsed, syntax_help};
use super::expr::Reader;
use super::words::{self, Keyword, LETTER, MOTION, ONLINE, PLC, Tail};
use crate::pmac::ast::{Action, Expr, Op, PlcSet, Target, WriteKind};
use crate::pmac::origin::TextRange;

/// The help for a word that is similar to no other.
pub(crate) const PERHAPS_A_NAME: &str = "if it is a name, its #define must come before";

/// What an on-line command changes for the reading of the text after it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum OnlineEffect {
    /// Nothing: reading goes on with the next command.
    Continue,
    /// A PLC's or PLCC's buffer is opened.
    OpenPlc {
        /// Whether it is a PLCC.
        compiled: bool,
        /// Its number, 0 to 31.
        number: u8,
    },
    /// The buffer of a motion program is opened.
    OpenMotion,
    /// CLOSE.
    Close,
    /// L-variables are defined: the first one's number, and how many there are.
    DefineL(u16, u16, plcc_abi::pmac::Definition),
}

impl Reader<'_> {
    /// Reads one on-line command, and appends to `out` what it does. Entries of a compensation
    /// table are commands of their own: `table` says whether they may be here, and is set to
    /// whether they may follow.
    pub(crate) fn online(
        &mut self,
        out: &mut Vec<Action>,
        table: &mut bool,
    ) -> Parsed<OnlineEffect> {
        let byte = self.cur.peek().to_ascii_uppercase();
        let in_table = std::mem::take(table);
        match byte {
            b'0'..=b'9' | b'.' | b'-' => {
                let value = self.signed()?;
                if in_table {
                    *table = true;
                } else {
                    out.push(Action::Assign(Target::Var(Kind::P, 0), self.constant(value)));
                }
                return Ok(OnlineEffect::Continue);
            }
            b',' if in_table => {
                self.cur.pos += 1;
                *table = true;
                return Ok(OnlineEffect::Continue);
            }
            b'#' => {
                self.motor(out)?;
                // #1 DEFINE COMP is one command.
                return Ok(OnlineEffect::Continue);
            }
            b'&' => {
                self.cur.pos += 1;
                if self.cur.peek().is_ascii_digit() {
                    let system = self.addressed("coordinate system", 8, 16)?;
                    out.push(Action::System(system));
                }
                return Ok(OnlineEffect::Continue);
            }
            b'$' => {
                if self.cur.byte_at(1).is_ascii_hexdigit() {
                    let value = self.signed()?;
                    if in_table {
                        *table = true;
                    } else {
                        out.push(Action::Assign(Target::Var(Kind::P, 0), self.constant(value)));
                    }
                } else {
                    while matches!(self.cur.byte(), b'$' | b'*') {
                        self.cur.pos += 1;
                    }
                    out.push(Action::Reset);
                }
                return Ok(OnlineEffect::Continue);
            }
            b'%' | b'@' => {
                self.cur.pos += 1;
                while self.cur.byte().is_ascii_hexdigit() || matches!(self.cur.byte(), b'*' | b'.')
                {
                    self.cur.pos += 1;
                }
                return Ok(OnlineEffect::Continue);
            }
            b'?' | b'/' | b'\\' => {
                self.cur.pos += 1;
                return Ok(OnlineEffect::Continue);
            }
            b'!' if is_axis(self.cur.byte_at(1)) => {
                self.altered_destination()?;
                out.push(Action::Motion);
                return Ok(OnlineEffect::Continue);
            }
            b'^' if self.cur.byte_at(1).is_ascii_alphabetic() => {
                let letter = self.cur.byte_at(1);
                self.cur.pos += 2;
                control_character(letter, out);
                return Ok(OnlineEffect::Continue);
            }
            _ => {}
        }
        if let Some(kind) = self.variable_kind() {
            return self.online_variable(kind, out);
        }
        self.online_word(byte, out, table)
    }

    fn online_variable(&mut self, kind: Kind, out: &mut Vec<Action>) -> Parsed<OnlineEffect> {
        match self.variable_command(kind)? {
            VariableCommand::Assign(target, expr) => {
                if let Some(at) = self.double_equals.take() {
                    return syntax_help(at, "`==` is for motion programs", "write `=` here");
                }
                out.push(Action::Assign(target, expr));
            }
            VariableCommand::Defaults(first, count, step) => {
                out.push(Action::Defaults(first, count, step));
            }
            VariableCommand::Define(Kind::L, first, count) => {
                self.cur.blanks();
                let start = self.cur.pos;
                let definition = self.definition()?;
                use plcc_abi::pmac::Definition;
                if !matches!(definition, Definition::X { .. } | Definition::Y { .. }) {
                    let at = self.cur.since(start);
                    let help = "an L-variable is a part of an X or Y word";
                    return syntax_help(at, "L-variables are defined as X: or Y: only", help);
                }
                return Ok(OnlineEffect::DefineL(first, count, definition));
            }
            VariableCommand::Define(_, first, count) => {
                let definition = self.definition()?;
                out.push(Action::Define(first, count, definition));
            }
            VariableCommand::Query => {}
        }
        Ok(OnlineEffect::Continue)
    }

    fn online_word(
        &mut self,
        byte: u8,
        out: &mut Vec<Action>,
        table: &mut bool,
    ) -> Parsed<OnlineEffect> {
        if byte == b'J' {
            self.cur.pos += 1;
            while matches!(self.cur.byte(), b'+' | b'-' | b'/' | b'=' | b':' | b'^' | b'*')
                || matches!(self.cur.byte(), b'!' | b'.' | b'$' | b'0'..=b'9')
            {
                self.cur.pos += 1;
            }
            return Ok(OnlineEffect::Continue);
        }
        if matches!(byte, b'W' | b'R') && self.memory_command(byte, out)? {
            return Ok(OnlineEffect::Continue);
        }
        if let Some((word, after)) = words::find(self.cur, ONLINE.or(PLC).or(MOTION)) {
            let start = self.cur.pos;
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
            self.cur = after;
            let tail = match word.keyword {
                Keyword::Open => return self.open(),
                Keyword::Close => {
                    self.tail(Tail::All);
                    return Ok(OnlineEffect::Close);
                }
                Keyword::Define => return self.define_buffer(table),
                Keyword::Delete => return self.delete(out),
                Keyword::Switch(op) => {
                    let plcs = self.switched(op)?;
                    out.push(Action::Plc(op, plcs));
                    return Ok(OnlineEffect::Continue);
                }
                Keyword::Save => {
                    out.push(Action::Save);
                    return Ok(OnlineEffect::Continue);
                }
                Keyword::Clear => {
                    self.cur = self.cur_at(start);
                    return self.needs_buffer_error();
                }
                Keyword::Undefine => Tail::All,
                Keyword::Ring | Keyword::RingRead | Keyword::Lock => Tail::Line,
                Keyword::Unlock => Tail::Number,
                Keyword::SetPhase => Tail::Numbers,
                Keyword::Accepted(tail) => tail,
                _ => Tail::Nothing,
            };
            self.tail(tail);
            out.push(Action::Motion);
            return Ok(OnlineEffect::Continue);
        }
        if self.is_move(byte) {
            return self.needs_buffer_error();
        }
        if matches!(byte, b'A'..=b'C' | b'U'..=b'Z') && self.cur.byte_at(1) == b'=' {
            self.cur.pos += 2;
            self.signed()?;
            return Ok(OnlineEffect::Continue);
        }
        let single =
            (!self.cur.byte_at(1).is_ascii_alphabetic() || self.glued()) && !self.is_after_word();
        if single
            && let Some((word, after)) = words::find(self.cur, LETTER)
            && let Keyword::Accepted(tail) = word.keyword
        {
            self.cur = after;
            self.tail(tail);
            out.push(Action::Motion);
            return Ok(OnlineEffect::Continue);
        }
        self.unknown_word_error()
    }

    /// The error for a statement outside any buffer.
    fn needs_buffer_error(&mut self) -> Parsed<OnlineEffect> {
        let at = self.cur.next_word();
        let what = self.cur.text_at(at);
        Err(ParseError {
            code: "PMAC-5",
            at,
            message: format!("`{what}` is for programs, and no buffer is open").into(),
            help: Some("open one with OPEN PLC n CLEAR; a CLOSE may stand too early".into()),
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

    /// `#n`, and perhaps its axis definition.
    fn motor(&mut self, out: &mut Vec<Action>) -> Parsed<()> {
        self.cur.pos += 1;
        if !self.cur.peek().is_ascii_digit() {
            return Ok(());
        }
        self.addressed("motor", 8, 32)?;
        out.push(Action::Motion);
        if self.cur.peek() == b'-' && self.cur.byte_at(1) == b'>' {
            let rest = self.cur.rest();
            self.cur.pos += rest.find(['#', '&', '\n']).unwrap_or(rest.len());
        }
        Ok(())
    }

    /// `WX:$700,5` and `RHX:$700`: memory written and read.
    fn memory_command(&mut self, byte: u8, out: &mut Vec<Action>) -> Parsed<bool> {
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
            _ => return Ok(false),
        };
        ahead.pos += 1;
        if kind == WriteKind::Double {
            let _ = ahead.eat(b'P');
        }
        let program = kind == WriteKind::Program;
        if !matches!(ahead.peek(), b':' | b'$') && (program || !ahead.peek().is_ascii_digit()) {
            return Ok(false);
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
        if byte == b'W' {
            if values.is_empty() {
                return self.cur.expected("`,` and a value");
            }
            out.push(Action::Write(kind, address, values));
        }
        Ok(true)
    }
}

/// Whether a letter names an axis.
fn is_axis(letter: u8) -> bool {
    matches!(letter.to_ascii_uppercase(), b'A'..=b'C' | b'U'..=b'Z')
}

/// What a control character does to PLCs: `^D` disables all of them.
pub(crate) fn control_character(letter: u8, out: &mut Vec<Action>) {
    if letter.eq_ignore_ascii_case(&b'D') {
        for compiled in [false, true] {
            out.push(Action::Plc(PlcOp::Disable, PlcSet { compiled, bits: u32::MAX }));
        }
    } else {
        out.push(Action::Motion);
    }
}
