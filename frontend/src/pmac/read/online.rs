//! On-line commands (guide, appendix C): those of the text and those of COMMAND.
//!
//! What concerns variables, memory and PLCs becomes an [`Action`]; what concerns motors, coordinate
//! systems and the card is known by its form and accepted.

use plcc_abi::pmac::{Kind, PlcOp};

use super::assign::Variable;
use super::cursor::{Fault, Parsed, syntax_help};
use super::expr::Reader;
use super::origin::At;
use crate::pmac::ast::{Action, Expr, Op, Plcs, Target, WriteKind};

/// The help for a word that nothing is like.
pub(crate) const PERHAPS_A_NAME: &str = "if it is a name, its #define must come before";

/// What a command does to the reading of the text.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Flow {
    /// Nothing.
    Go,
    /// A PLC's or PLCC's buffer is opened.
    Open {
        /// A PLCC.
        compiled: bool,
        /// Which; none when the number is wrong.
        number: Option<u8>,
    },
    /// A buffer that is not for PLCs is opened.
    OpenMotion,
    /// The buffer is closed.
    Close,
    /// An L-variable definition: first, count.
    DefineL(u16, u16, plcc_abi::pmac::Definition),
}

/// What follows a command's word.
#[derive(Clone, Copy)]
enum Tail {
    Nothing,
    /// Perhaps a number.
    Number,
    /// Perhaps a list in parentheses.
    List,
    /// Perhaps numbers with commas and `..` between.
    Numbers,
    /// Anything up to the line's end.
    Line,
}

/// Commands that are only accepted: word, letters at least, what follows. Longer words stand
/// before shorter ones that they begin with.
const ACCEPTED: &[(&str, usize, Tail)] = &[
    ("ABS", 3, Tail::List),
    ("ABR", 3, Tail::Number),
    ("CID", 3, Tail::Nothing),
    ("CLEAR", 3, Tail::Nothing),
    ("CLRF", 4, Tail::Nothing),
    ("CLR", 3, Tail::Nothing),
    ("CPU", 3, Tail::Nothing),
    ("DATE", 3, Tail::Nothing),
    ("DKILL", 5, Tail::Nothing),
    ("EAVERSION", 3, Tail::Nothing),
    ("ENDGATHER", 4, Tail::Nothing),
    ("ENDTRACE", 4, Tail::Nothing),
    ("FRAX2", 5, Tail::List),
    ("FRAX", 4, Tail::List),
    ("GATHER", 3, Tail::Number),
    ("HOMEZ", 5, Tail::Numbers),
    ("HMZ", 3, Tail::Numbers),
    ("HOME", 4, Tail::Numbers),
    ("HM", 2, Tail::Numbers),
    ("IDC", 3, Tail::Line),
    ("IDNUMBER", 3, Tail::Line),
    ("INC", 3, Tail::List),
    ("LEARN", 3, Tail::List),
    ("LRN", 3, Tail::List),
    ("LIST", 3, Tail::Line),
    ("LMOVERLAY", 3, Tail::Line),
    ("LOCK", 4, Tail::Line),
    ("MACRO", 5, Tail::Line),
    ("MACSTA", 6, Tail::Line),
    ("MFLUSH", 3, Tail::Nothing),
    ("MS", 2, Tail::Line),
    ("MX", 2, Tail::Line),
    ("NOFRAX", 3, Tail::Nothing),
    ("NORMAL", 4, Tail::Line),
    ("NRM", 3, Tail::Line),
    ("PASSWORD", 4, Tail::Line),
    ("PMATCH", 3, Tail::Nothing),
    ("PC", 2, Tail::Nothing),
    ("PE", 2, Tail::Nothing),
    ("PR", 2, Tail::Nothing),
    ("SETPHASE", 4, Tail::Numbers),
    ("SID", 3, Tail::Nothing),
    ("SIZE", 3, Tail::Nothing),
    ("STOPINVERSE", 5, Tail::Nothing),
    ("STN", 3, Tail::Line),
    ("TIME", 4, Tail::Line),
    ("TODAY", 4, Tail::Line),
    ("TRACE", 4, Tail::Nothing),
    ("TRIGGER", 4, Tail::Nothing),
    ("TYPE", 3, Tail::Nothing),
    ("UNDEFINE", 5, Tail::Nothing),
    ("UNLOCK", 3, Tail::Number),
    ("UPDATE", 3, Tail::Nothing),
    ("VERSION", 3, Tail::Nothing),
    ("VID", 3, Tail::Nothing),
    ("A", 1, Tail::Nothing),
    ("B", 1, Tail::Number),
    ("D", 1, Tail::Nothing),
    ("E", 1, Tail::Nothing),
    ("F", 1, Tail::Nothing),
    ("H", 1, Tail::Nothing),
    ("K", 1, Tail::Nothing),
    ("O", 1, Tail::Number),
    ("P", 1, Tail::Nothing),
    ("Q", 1, Tail::Nothing),
    ("R", 1, Tail::Nothing),
    ("S", 1, Tail::Nothing),
    ("V", 1, Tail::Nothing),
    ("Z", 1, Tail::Nothing),
];

/// Words that need an open buffer.
const BUFFERED: &[&str] = &[
    "IF", "WHILE", "ELSE", "ENDI", "ENDW", "AND", "OR", "COMMAND", "CMD", "SENDS", "SENDP", "SEND",
    "DISP", "ADDRESS", "ADR", "LINEAR", "LIN", "RAPID", "RPD", "DWELL", "DWE", "DELAY", "DLY",
    "CIR", "SPLINE", "PVT", "RETURN", "RET", "GOTO", "GOSUB", "CALL", "READ", "WAIT", "STOP", "TA",
    "TM", "TS", "PSET", "CC0", "CC1", "CC2", "BLOCKST", "TSEL", "TINIT", "ADIS", "IDIS", "AROT",
    "IROT", "PRELUDE", "DTOGREAD",
];

/// What a buffer of DEFINE and DELETE may be.
const BUFFERS: &[(&str, usize)] = &[
    ("GATHER", 3),
    ("TRACE", 4),
    ("ROTARY", 3),
    ("TBUF", 2),
    ("TCOMP", 2),
    ("BLCOMP", 2),
    ("COMP", 4),
    ("UBUFFER", 2),
    ("LOOKAHEAD", 4),
    ("CCUBUF", 3),
    ("CCBUF", 3),
    ("TEMPS", 4),
    ("ALL", 3),
];

impl Reader<'_> {
    /// One on-line command. `table` says, and is told, that the entries of a compensation table
    /// may follow.
    pub(crate) fn online(&mut self, out: &mut Vec<Action>, table: &mut bool) -> Parsed<Flow> {
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
                return Ok(Flow::Go);
            }
            b',' if in_table => {
                self.cur.pos += 1;
                *table = true;
                return Ok(Flow::Go);
            }
            b'#' => {
                self.motor(out)?;
                // #1 DEFINE COMP is one command.
                return Ok(Flow::Go);
            }
            b'&' => {
                self.cur.pos += 1;
                if self.cur.peek().is_ascii_digit() {
                    let system = self.addressed("coordinate system", 8, 16)?;
                    out.push(Action::System(system));
                }
                return Ok(Flow::Go);
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
                return Ok(Flow::Go);
            }
            b'%' | b'@' => {
                self.cur.pos += 1;
                while self.cur.byte().is_ascii_hexdigit() || matches!(self.cur.byte(), b'*' | b'.')
                {
                    self.cur.pos += 1;
                }
                return Ok(Flow::Go);
            }
            b'?' | b'/' | b'\\' | b'<' | b'>' | b'!' | b'{' | b'}' => {
                self.cur.pos += 1;
                return Ok(Flow::Go);
            }
            b'^' if self.cur.byte_at(1).is_ascii_alphabetic() => {
                let letter = self.cur.byte_at(1);
                self.cur.pos += 2;
                control(letter, out);
                return Ok(Flow::Go);
            }
            _ => {}
        }
        if let Some(kind) = self.variable_kind() {
            return self.online_variable(kind, out);
        }
        if let Some(op) = self.plc_word() {
            let plcs = self.plcs()?;
            out.push(Action::Plc(op, plcs));
            return Ok(Flow::Go);
        }
        self.online_word(byte, out, table)
    }

    fn online_variable(&mut self, kind: Kind, out: &mut Vec<Action>) -> Parsed<Flow> {
        match self.variable(kind)? {
            Variable::Assign(target, expr) => out.push(Action::Assign(target, expr)),
            Variable::Defaults(first, count, step) => {
                out.push(Action::Defaults(first, count, step));
            }
            Variable::Define(Kind::L, first, count) => {
                self.cur.blanks();
                let start = self.cur.pos;
                let definition = self.definition()?;
                use plcc_abi::pmac::Definition;
                if !matches!(definition, Definition::X { .. } | Definition::Y { .. }) {
                    let at = self.cur.since(start);
                    let help = "an L-variable is a part of an X or Y word";
                    return syntax_help(at, "L-variables are defined as X: or Y: only", help);
                }
                return Ok(Flow::DefineL(first, count, definition));
            }
            Variable::Define(_, first, count) => {
                let definition = self.definition()?;
                out.push(Action::Define(first, count, definition));
            }
            Variable::Query => {}
        }
        Ok(Flow::Go)
    }

    fn online_word(&mut self, byte: u8, out: &mut Vec<Action>, table: &mut bool) -> Parsed<Flow> {
        let start = self.cur.pos;
        match byte {
            b'O' if self.cur.word("OPEN") => return self.open(),
            b'C' if self.cur.short("CLOSE", 4) || self.cur.word("CLS") => {
                let _ = self.cur.word("ALL");
                return Ok(Flow::Close);
            }
            b'D' if self.cur.starts_with("DEF") => {
                let _ = self.cur.short("DEFINE", 3);
                self.cur.blanks();
                let at = self.cur.here();
                let what = self.cur.what(at);
                let Some((name, _)) =
                    BUFFERS.iter().find(|(name, least)| self.cur.short(name, *least))
                else {
                    let what = format!("`{what}` is no buffer that can be defined");
                    return syntax_help(at, what, "GATHER, ROTARY, TBUF, UBUFFER, COMP…");
                };
                *table = name.ends_with("COMP");
                self.cur.skip_line();
                return Ok(Flow::Go);
            }
            b'D' if self.cur.starts_with("DEL") && !self.cur.starts_with("DELA") => {
                let _ = self.cur.short("DELETE", 3);
                return self.delete(out);
            }
            b'S' if self.cur.word("SAVE") => {
                out.push(Action::Save);
                return Ok(Flow::Go);
            }
            b'E' if self.cur.word("END") => {
                if self.cur.short("GATHER", 1) || self.cur.short("TRACE", 1) {
                    return Ok(Flow::Go);
                }
                self.cur.pos = start;
            }
            b'J' => {
                self.cur.pos += 1;
                while matches!(self.cur.byte(), b'+' | b'-' | b'/' | b'=' | b':' | b'^' | b'*')
                    || matches!(self.cur.byte(), b'!' | b'.' | b'$' | b'0'..=b'9')
                {
                    self.cur.pos += 1;
                }
                return Ok(Flow::Go);
            }
            b'W' | b'R' if self.memory_command(byte, out)? => return Ok(Flow::Go),
            _ => {}
        }
        if self.accepted(out, true) {
            return Ok(Flow::Go);
        }
        if BUFFERED.iter().any(|word| self.cur.starts_with(word)) || self.is_move(byte) {
            let at = self.cur.here();
            let what = self.cur.what(at);
            return Err(Fault {
                code: "PMAC-5",
                at,
                message: format!("`{what}` is for programs, and no buffer is open"),
                help: Some("open one with OPEN PLC n CLEAR; a CLOSE may stand too early".into()),
            });
        }
        if matches!(byte, b'A'..=b'C' | b'U'..=b'Z') && self.cur.byte_at(1) == b'=' {
            self.cur.pos += 2;
            self.signed()?;
            return Ok(Flow::Go);
        }
        if self.accepted(out, false) {
            return Ok(Flow::Go);
        }
        self.unknown()
    }

    /// Takes a command that is only accepted: words, or single letters.
    fn accepted(&mut self, out: &mut Vec<Action>, words: bool) -> bool {
        let single =
            (!self.cur.byte_at(1).is_ascii_alphabetic() || self.glued()) && !self.behind_word();
        for &(word, least, tail) in ACCEPTED {
            // MX->Y:$FFC2,8 is no command of the ring.
            let ring = matches!(word, "MS" | "MX");
            if ring && matches!(self.cur.byte_at(2), b'-' | b'=' | b'(' | b'.' | b',') {
                continue;
            }
            if (word.len() > 1) == words && (words || single) && self.cur.short(word, least) {
                self.tail(tail);
                if matches!(word, "UNDEFINE" | "CLEAR" | "CLR") {
                    let _ = self.cur.word("ALL");
                }
                out.push(Action::Motion);
                return true;
            }
        }
        false
    }

    /// Whether a one-letter command is followed by one other.
    fn glued(&self) -> bool {
        self.cur.rest().bytes().take(3).take_while(u8::is_ascii_alphabetic).count() <= 2
    }

    /// Whether letters stand right before the place that make a word, so that one letter more is a
    /// mistake in it: CLSE, DELETE GATHR. Homing is written so: #1HMZK.
    fn behind_word(&self) -> bool {
        let before = self.cur.glued_word(At::new(self.cur.pos, self.cur.pos));
        before.len() > 1
            && !["HM", "HMZ", "HOME", "HOMEZ"].iter().any(|w| before.eq_ignore_ascii_case(w))
    }

    /// The error for a word that nothing knows.
    pub(crate) fn unknown<T>(&mut self) -> Parsed<T> {
        const WORDS: &[&str] = &[
            "OPEN",
            "CLOSE",
            "CLEAR",
            "DELETE",
            "DEFINE",
            "ENABLE",
            "DISABLE",
            "PAUSE",
            "RESUME",
            "UNDEFINE",
            "SAVE",
            "COMMAND",
            "ADDRESS",
            "DISPLAY",
            "SEND",
            "WHILE",
            "ENDWHILE",
            "ENDIF",
            "ELSE",
            "GATHER",
            "ENDGATHER",
            "HOME",
            "LIST",
            "PASSWORD",
        ];
        let at = self.cur.here();
        let what = self.cur.what(at).to_owned();
        if !what.is_ascii() || !what.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
            return self.cur.expected_here("a command or statement");
        }
        // ENDWHLE: a short keyword was taken off its front.
        let whole = self.cur.glued_word(at);
        let near = |word: &str| crate::common::closest(word, WORDS.iter().copied());
        let help = match near(&what).or_else(|| near(whole)) {
            Some(word) if word.eq_ignore_ascii_case(&what) => format!(
                "{word} can't stand here: statements stand in buffers, and there \
                 COMMAND\"…\" gives on-line commands"
            ),
            Some(word) => format!("did you mean {word}?"),
            None => PERHAPS_A_NAME.to_owned(),
        };
        syntax_help(at, format!("`{what}` is neither a statement nor defined"), help)
    }

    /// Whether an axis with a position begins here.
    fn is_move(&mut self, byte: u8) -> bool {
        matches!(byte, b'A' | b'C' | b'U'..=b'Z' | b'G' | b'N' | b'T' | b'D')
            && (self.cur.byte_at(1).is_ascii_digit() || matches!(self.cur.byte_at(1), b'(' | b'-'))
    }

    fn tail(&mut self, tail: Tail) {
        match tail {
            Tail::Nothing => {}
            Tail::Number => {
                let _ = self.cur.number();
            }
            Tail::Numbers => {
                while self.cur.number().is_some()
                    && (self.cur.eat(b',') || (self.cur.eat(b'.') && self.cur.eat(b'.')))
                {
                }
            }
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

    /// A number with a sign or none.
    pub(crate) fn signed(&mut self) -> Parsed<f64> {
        let negative = self.cur.eat(b'-');
        let _ = !negative && self.cur.eat(b'+');
        match self.cur.number() {
            Some(value) => Ok(if negative && value != 0.0 { -value } else { value }),
            None if self.cur.byte() == b'.' => self.cur.expected_here("a number"),
            None => self.cur.expected("a number"),
        }
    }

    /// An expression that is a number.
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

    fn open(&mut self) -> Parsed<Flow> {
        if self.cur.word("PLC") {
            let compiled = matches!(self.cur.byte(), b'C' | b'c')
                && !self.cur.starts_with("CLEAR")
                && !self.cur.starts_with("CLR");
            self.cur.pos += usize::from(compiled);
            let number = self.plc_number()?;
            return Ok(Flow::Open { compiled, number: Some(number) });
        }
        for word in ["PROGRAM", "ROTARY", "FORWARD", "INVERSE", "SERVO", "BINARY", "FWD", "SUBPROG"]
        {
            if self.cur.short(word, 3) {
                return Ok(Flow::OpenMotion);
            }
        }
        self.cur.expected("PLC, PLCC, PROG, ROTARY, FORWARD or INVERSE")
    }

    fn delete(&mut self, out: &mut Vec<Action>) -> Parsed<Flow> {
        if self.cur.word("PLCC") {
            if let Some(number @ 0..=31) = self.cur.integer() {
                out.push(Action::DeletePlcc(number as u8));
            }
            return Ok(Flow::Go);
        }
        if self.cur.word("PLC") || self.cur.short("PROGRAM", 4) {
            let _ = self.cur.integer();
            return Ok(Flow::Go);
        }
        let all = self.cur.short("ALL", 3);
        if BUFFERS.iter().any(|(name, least)| self.cur.short(name, *least)) || all {
            let _ = self.cur.integer();
            return Ok(Flow::Go);
        }
        self.cur.expected("GATHER, TRACE, ROTARY, COMP, PLCC or another buffer")
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

/// What a control character does to PLCs: `^D` disables all of them.
pub(crate) fn control(letter: u8, out: &mut Vec<Action>) {
    if letter.eq_ignore_ascii_case(&b'D') {
        for compiled in [false, true] {
            out.push(Action::Plc(PlcOp::Disable, Plcs { compiled, set: u32::MAX }));
        }
    } else {
        out.push(Action::Motion);
    }
}
