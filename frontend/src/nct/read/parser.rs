//! Parses the text into statements (NCT 4). A statement that can't be read is reported, and the
//! next one is looked for after it.
//!
//! In all functions of the parser `start` is the offset at which the statement begins, for its
//! place and for the place of an error.

use plcc_diag::{Diagnostic, FileId, Span};

use crate::common::Limits;
use crate::nct::{
    ast::{AreaOp, ConditionPart, Op, Opens, Operand, Space, Stmt, Texts, Word},
    read::{
        cursor::Cursor,
        diagnostic::{Read, SyntaxError, error, shown},
        number::{Digits, address, decimal, hexadecimal},
        operand::{Prefix, bit, counter, load, refuse, variable},
    },
};

/// How many characters a program may have, without white space and comments (NCT 5).
const MAX_TEXT: usize = 64 * 1024;

/// What the text holds, before conditions, labels and modules are checked. The fields are those of
/// [`Program`](crate::nct::ast::Program).
#[derive(Default)]
pub(crate) struct Parsed {
    pub(crate) stmts: Vec<Stmt>,
    pub(crate) condition_parts: Vec<ConditionPart>,
    /// Where each test of `condition_parts` stands: offsets of its beginning and its end.
    pub(crate) tests: Vec<(usize, usize)>,
    pub(crate) texts: Texts,
    pub(crate) slots: u16,
}

// The helps for an operation without a valid operand are constants, since a source of a mebibyte may hold
// hundreds of thousands of them.

/// The parser of one text.
pub(crate) struct Parser<'a> {
    pub(crate) cursor: Cursor<'a>,
    pub(crate) file: FileId,
    pub(crate) text: &'a str,
    pub(crate) limits: Limits,
    /// What was read so far.
    pub(crate) out: Parsed,
    /// The errors and warnings so far.
    pub(crate) found: Vec<Diagnostic>,
    /// Offsets of the parentheses and brackets that nothing closes; `None` until they are needed.
    pub(crate) unclosed: Option<Vec<usize>>,
}

/// Reads a whole text.
pub(crate) fn parse(file: FileId, text: &str, limits: Limits) -> (Parsed, Vec<Diagnostic>) {
    let mut parser = Parser {
        cursor: Cursor::new(file, text),
        file,
        text,
        limits,
        out: Parsed::default(),
        found: vec![],
        unclosed: None,
    };
    parser.all();
    (parser.out, parser.found)
}

/// Whether a statement that could not be read would have begun a condition, as far as its first two
/// characters tell.
fn opens(text: &str) -> Opens {
    let mut chars = text.chars().filter(|c| !crate::nct::read::cursor::is_blank(*c));
    match (chars.next(), chars.next()) {
        (Some('N'), Some('L' | 'S')) | (Some('H' | 'P'), Some('F')) | (Some('<'), Some('<')) => {
            Opens::No
        }
        (Some('>'), Some('>')) | (Some('M'), Some('R' | 'W' | 'U')) => Opens::No,
        (Some('N'), Some('I' | 'Y' | 'V' | 'P' | 'F' | 'Q' | 'T' | 'H' | 'M'))
        | (Some('P' | 'H' | 'M'), Some('0'..='9'))
        | (Some('I' | 'Y' | 'V' | 'F' | 'Q' | 'T' | '<' | '>' | '=' | '('), _) => Opens::Yes,
        (Some('N' | 'P' | 'H' | 'M'), _) => Opens::Perhaps,
        (Some('A'..='Z' | ',' | '.' | '[' | ':' | '+' | '-' | '*' | '/'), _) => Opens::No,
        _ => Opens::Perhaps,
    }
}

impl Parser<'_> {
    /// Reads all statements.
    fn all(&mut self) {
        // An error right after another one, without a statement or a gap between, follows from it
        // and is not reported.
        let mut quiet = false;
        let mut too_long = false;
        while self.cursor.peek().is_some() {
            let start = self.cursor.pos();
            quiet &= !self.cursor.gap();
            match self.statement(start) {
                Ok(()) => quiet = false,
                Err(fail) => {
                    if !quiet {
                        self.found.push(*fail);
                    }
                    self.recover(start, quiet);
                    quiet = true;
                }
            }
            if self.cursor.taken() > MAX_TEXT && !too_long && self.limits == Limits::Original {
                too_long = true;
                self.found.push(*error(
                    29,
                    self.cursor.span_from(start),
                    "the program has more than 64 kB of text, comments and spaces aside",
                    "shorten the program, or lift the original limits with --limits none",
                ));
            }
        }
        if let Some(start) = self.cursor.open_comment() {
            let span = Span::new(self.file, start, start + 2);
            self.found.push(*error(
                76,
                span,
                "nothing closes this comment",
                "close it with `*/`, or use `;` for a comment up to the line's end",
            ));
        }
    }

    /// Goes on after a statement that could not be read: at least one character and all digits
    /// after it belong to it. `again` says that its error follows from the one before.
    fn recover(&mut self, start: usize, again: bool) {
        if self.cursor.pos() == start {
            self.cursor.bump();
        }
        while !self.cursor.gap() && self.cursor.peek().is_some_and(|c| c.is_ascii_digit()) {
            self.cursor.bump();
        }
        let opens = match opens(self.text.get(start..self.cursor.end()).unwrap_or("")) {
            Opens::Yes if again => Opens::Perhaps,
            other => other,
        };
        self.emit(start, Op::Bad { opens });
    }

    /// Adds a statement that reaches from `start` to the last character taken.
    pub(crate) fn emit(&mut self, start: usize, op: Op) {
        let span = self.cursor.span_from(start);
        self.out.stmts.push(Stmt { op, span });
    }

    /// Reads one statement.
    fn statement(&mut self, start: usize) -> Read<()> {
        let Some(first) = self.cursor.peek() else { return Ok(()) };
        let op = match first {
            'I' | 'Y' | 'V' | 'F' | 'Q' | 'T' | '(' | '=' => return self.condition(start),
            'P' | 'H' | 'M' | 'N' | '<' | '>' => return self.statement_or_test(start, first),
            '[' => return self.bracket(start, None),
            '+' | '-' | '*' | '/' | 'A' | 'O' | 'X' => return self.operation(start, first),
            ':' => return self.label(start),
            _ => {
                self.cursor.bump();
                self.simple(start, first)?
            }
        };
        self.emit(start, op);
        Ok(())
    }

    /// A statement that is recognised by its first character, which is taken.
    fn simple(&mut self, start: usize, first: char) -> Read<Op> {
        let cursor = &mut self.cursor;
        Ok(match first {
            'U' | 'D' => return self.switch(start, first == 'U'),
            ',' => Op::Load(Operand::Const(decimal(cursor, start)?)),
            '.' => Op::Load(Operand::Const(hexadecimal(cursor, start)?)),
            'L' => Op::Load(load(cursor, start, Prefix::Load)?),
            'S' if cursor.eat('U') => {
                return self.area_by_last_letter(start, "SUB", AreaOp::Sub, 'B', 48);
            }
            'S' => Op::Store { negate: false, place: variable(cursor, start, Prefix::Store)? },
            'B' => return self.convert(start),
            'E' => Op::Else { end: 0 },
            'Z' => Op::EndIf,
            'R' => Op::Return,
            'G' | 'C' => return self.jump(start, first == 'C'),
            'J' => return self.end(start),
            _ => return Err(self.unknown(start, first)),
        })
    }

    /// The error of a character with which no statement begins.
    fn unknown(&mut self, start: usize, first: char) -> SyntaxError {
        let span = self.cursor.span_from(start);
        if !matches!(first, 'A'..='Z' | '0'..='9' | ')' | ']' | '$') {
            let upper = first.to_ascii_uppercase();
            let help = if first.is_ascii_lowercase() {
                format!("the language is written in capitals: `{upper}`")
            } else {
                "remove it, or make it a comment with `;`".to_owned()
            };
            return error(44, span, format!("`{first}` is not a character of the language"), help);
        }
        let help = match first {
            '0'..='9' => {
                "a number follows a letter, `,` or `.`; the letter may be missing, \
                          or I and O written as 1 and 0"
            }
            ')' | ']' => "no parenthesis or bracket is open here",
            '$' => "`$` ends the texts of :197 to :200 only",
            _ => "statements are listed in chapter 4 of the manual",
        };
        error(7, span, format!("no statement begins with `{first}`"), help)
    }

    /// A statement, or a condition, that begins with a character with which both can begin.
    fn statement_or_test(&mut self, start: usize, first: char) -> Read<()> {
        let mut ahead = self.cursor.clone();
        ahead.bump();
        let op = match (first, ahead.peek()) {
            ('P', Some('F')) => self.named_area(start, "PF", AreaOp::Pf)?,
            ('H', Some('F')) => self.named_area(start, "HF", AreaOp::Hf)?,
            ('M', Some('R')) => self.named_area(start, "MR", AreaOp::Mr)?,
            ('M', Some('W')) => self.named_area(start, "MW", AreaOp::Mw)?,
            ('M', Some('U')) => {
                self.cursor.bump();
                self.cursor.bump();
                self.area_by_last_letter(start, "MUL", AreaOp::Mul, 'L', 52)?
            }
            ('N', Some('L')) => {
                self.cursor = ahead;
                self.cursor.bump();
                Op::Load(load(&mut self.cursor, start, Prefix::LoadNot)?)
            }
            ('N', Some('S')) => {
                self.cursor = ahead;
                self.cursor.bump();
                let variable = variable(&mut self.cursor, start, Prefix::StoreNot)?;
                Op::Store { negate: true, place: variable }
            }
            ('<', Some('<')) | ('>', Some('>')) => {
                self.cursor = ahead;
                self.cursor.bump();
                self.shift(start, first == '<')?
            }
            _ => return self.condition(start),
        };
        self.emit(start, op);
        Ok(())
    }

    /// `<<` and `>>`, after the sign.
    pub(crate) fn shift(&mut self, start: usize, left: bool) -> Read<Op> {
        let by = decimal(&mut self.cursor, start)?;
        match u8::try_from(by) {
            Ok(by @ 0..=15) => Ok(Op::Shift { left, by }),
            _ => Err(error(
                if left { 24 } else { 25 },
                self.cursor.span_from(start),
                format!("OP can't be shifted by {by} bits"),
                "shift by 0 to 15",
            )),
        }
    }

    /// `BIN` and `BCD`, after the `B`.
    pub(crate) fn convert(&mut self, start: usize) -> Read<Op> {
        let (second, last, number, op) = match self.cursor.peek() {
            Some('I') => ('I', 'N', 27, Op::Bin),
            Some('C') => ('C', 'D', 28, Op::Bcd),
            _ => ('I', 'N', 26, Op::Bin),
        };
        if self.cursor.eat(second) && self.cursor.eat(last) {
            return Ok(op);
        }
        let found = self.cursor.peek();
        Err(refuse(&mut self.cursor, |cursor| {
            let message = format!("{} can't follow here", shown(found));
            let help = "only the statements BIN and BCD begin with B";
            error(number, cursor.span_from(start), message, help)
        }))
    }

    /// `U…` (`up`) and `D…`, after that letter.
    fn switch(&mut self, start: usize, up: bool) -> Read<Op> {
        let cursor = &mut self.cursor;
        let bit = match cursor.peek() {
            Some('F') => {
                cursor.bump();
                bit(cursor, start, Space::F)?
            }
            Some('O') => {
                cursor.bump();
                bit(cursor, start, Space::O)?
            }
            Some('Q') => {
                cursor.bump();
                let Word::Q(counter) = counter(cursor, start, 'Q')? else {
                    return Ok(Op::Bad { opens: Opens::No });
                };
                return Ok(Op::Count { counter, up });
            }
            Some('I') if !up => {
                cursor.bump();
                return self.area_by_last_letter(start, "DIV", AreaOp::Div, 'V', 56);
            }
            Some('Y') => {
                let name = if up { 'U' } else { 'D' };
                return Err(refuse(cursor, |cursor| {
                    let message = format!("`Y` can't follow {name}");
                    let help = format!("leave it out: {name}pqr switches the output Ypqr");
                    error(9, cursor.span_from(start), message, help)
                }));
            }
            _ => bit(cursor, start, Space::Y)?,
        };
        Ok(if up { Op::Set(bit) } else { Op::Clear(bit) })
    }

    /// `G…`, and `C…` (`call`), after that letter.
    fn jump(&mut self, start: usize, call: bool) -> Read<Op> {
        let cursor = &mut self.cursor;
        if cursor.eat('F') {
            let at = address(cursor, start, 3, 3, Digits::Decimal)?.value;
            return Ok(if call { Op::CallIndirect(at) } else { Op::GotoIndirect(at) });
        }
        if call && cursor.eat('M') {
            return self.area_by_last_letter(start, "CMP", AreaOp::Cmp, 'P', 59);
        }
        let label = address(cursor, start, 3, 3, Digits::Decimal)?.value;
        let span = cursor.span_from(start);
        if label > 196 {
            let message = format!(":{label:03} can't be jumped to or called");
            let help = "program labels are :003 to :196; :197 to :200 hold texts";
            return Err(error(41, span, message, help));
        }
        match label {
            0..=2 if call => Err(error(
                68,
                span,
                format!("module :{label:03} can't be called"),
                "call a label from :003 to :196; modules are started by the control",
            )),
            1 | 2 => Err(error(
                67,
                span,
                format!("module :{label:03} can't be jumped to"),
                "jump to :000 or to a label from :003 to :196",
            )),
            _ if call => Ok(Op::Call(label)),
            _ => Ok(Op::Goto(label)),
        }
    }

    /// `J0`, `J1` and `J2`, after the `J`.
    fn end(&mut self, start: usize) -> Read<Op> {
        if let Some(digit @ '0'..='2') = self.cursor.peek() {
            self.cursor.bump();
            return Ok(Op::End(digit as u8 - b'0'));
        }
        let found = self.cursor.peek();
        Err(refuse(&mut self.cursor, |cursor| {
            let message = format!("{} can't follow J", shown(found));
            let help = "J0 ends module :000, J1 module :001, J2 module :002";
            error(57, cursor.span_from(start), message, help)
        }))
    }

    /// `:nnn`, and the texts after :197 to :200.
    fn label(&mut self, start: usize) -> Read<()> {
        self.cursor.bump();
        let label = address(&mut self.cursor, start, 3, 3, Digits::Decimal)?.value;
        if label > 200 {
            return Err(error(
                1,
                self.cursor.span_from(start),
                format!("there is no label :{label:03}"),
                "labels are :000 to :200",
            ));
        }
        self.emit(start, Op::Label(label));
        if label >= 197 {
            self.text_module(label, start);
        }
        Ok(())
    }
}
