//! The statements of PLCs (guide, appendix D).

use plcc_abi::pmac::{Kind, PlcOp};
use plcc_diag::Diagnostic;

use super::assign::VariableCommand;
use super::command::is_command;
use super::cursor::{Cursor, ParseError, Parsed, syntax, syntax_help};
use super::download::DownloadReader;
use super::online::OnlineCommand;
use super::structure::FrameKind;
use super::words::{self, Keyword, MOTION, PLC};
use crate::pmac::ast::{Expr, Op, StmtKind, Target};

impl DownloadReader<'_> {
    /// One statement of the open buffer.
    pub(crate) fn statement(&mut self) -> Parsed<()> {
        let byte = self.reader.cur.peek().to_ascii_uppercase();
        let start = self.reader.cur.pos;
        if let Some(kind) = self.reader.variable_kind() {
            return self.assignment(kind, start);
        }
        if byte == b'&' && self.eat_lone_ampersand() {
            return Ok(());
        }
        let Some((word, after)) = words::find(self.reader.cur, PLC.or(MOTION)) else {
            return self.not_a_statement_error(byte);
        };
        if !word.is_in(PLC) {
            if word.keyword == Keyword::Return && self.final_return(after) {
                return Ok(());
            }
            return self.motion_statement_error();
        }
        let before = std::mem::replace(&mut self.reader.cur, after);
        match word.keyword {
            Keyword::If => self.branch(FrameKind::If, start),
            Keyword::While => self.branch(FrameKind::While, start),
            Keyword::EndIf => {
                self.end_if(start);
                Ok(())
            }
            Keyword::EndWhile => {
                self.end_while(start);
                Ok(())
            }
            Keyword::Else => {
                self.else_branch(start);
                Ok(())
            }
            Keyword::Address => self.address_statement(start),
            Keyword::Command => self.command(start),
            Keyword::Close => self.close_statement(start),
            Keyword::Clear => self.clear(),
            Keyword::Switch(op) => self.switch(op, start),
            Keyword::Send => self.send(start),
            Keyword::Display => self.display(start),
            Keyword::Lock => self.lock(start),
            Keyword::Unlock => {
                let _ = self.reader.cur.integer();
                Ok(())
            }
            Keyword::SetPhase => {
                self.reader.numbers();
                Ok(())
            }
            Keyword::And | Keyword::Or if self.reader.cur.peek() == b'(' => {
                self.reader.cur = before;
                let at = self.reader.cur.next_word();
                let message = format!("{} follows neither an IF nor a WHILE", word.spelling);
                syntax_help(at, message, "it follows the condition it belongs to")
            }
            // These functions read the word themselves.
            _ => {
                self.reader.cur = before;
                match word.keyword {
                    Keyword::Open => self.open_in_buffer(),
                    Keyword::Ring => self.macro_ring(false, start),
                    Keyword::RingRead => self.macro_ring(true, start),
                    Keyword::Define | Keyword::Delete | Keyword::Undefine => {
                        self.online_in_buffer(start)
                    }
                    _ => self.not_a_statement_error(byte),
                }
            }
        }
    }

    /// CLOSE, and perhaps ALL on the same line.
    fn close_statement(&mut self, start: usize) -> Parsed<()> {
        let at = self.reader.cur.since(start);
        let mut ahead = self.reader.cur;
        ahead.crosses_lines = false;
        if ahead.eat_word("ALL") {
            self.reader.cur.pos = ahead.pos;
        }
        if matches!(self.reader.cur.byte(), b'_' | b'a'..=b'z') {
            let whole = start..self.reader.cur.clone().next_word().end as usize;
            self.closed_by_name = Some(crate::pmac::origin::TextRange::new(whole.start, whole.end));
        }
        self.close(at);
        Ok(())
    }

    /// CLEAR in an open buffer, which empties it.
    pub(crate) fn clear(&mut self) -> Parsed<()> {
        if let Some(open) = &mut self.open {
            open.frames.clear();
            open.structure_error = None;
        }
        if let Some(buffer) = self.buffer() {
            buffer.code.clear();
            buffer.labels.clear();
            buffer.broken = false;
        }
        Ok(())
    }

    /// ENABLE, DISABLE, PAUSE or RESUME, whose word is taken.
    fn switch(&mut self, op: PlcOp, start: usize) -> Parsed<()> {
        let plcs = self.reader.switched(op)?;
        if plcs.compiled && op == PlcOp::Disable && self.in_plc0() {
            let at = self.reader.cur.since(start);
            return syntax(at, "PLC0 and PLCC0 cannot disable PLCCs");
        }
        self.push(StmtKind::Plc(op, plcs), start);
        Ok(())
    }

    /// `LOCK n,P`: sets the P-variable to 0, which means that the lock was free. It always is.
    pub(crate) fn lock(&mut self, start: usize) -> Parsed<()> {
        let _ = self.reader.cur.integer();
        if self.reader.cur.eat(b',') {
            let target = self.plain_variable()?;
            let expr = self.reader.constant(0.0);
            self.push(StmtKind::Assign(target, expr), start);
        }
        Ok(())
    }

    /// OPEN while a buffer is open: that buffer ends here, and the OPEN is read as an on-line
    /// command.
    pub(crate) fn open_in_buffer(&mut self) -> Parsed<()> {
        let at = self.reader.cur.next_word();
        if self.open.as_ref().is_some_and(|open| open.program.is_some()) {
            self.close_motion(at);
            self.report_still_open(at);
        } else {
            self.report_still_open(at);
            self.close(at);
        }
        Ok(())
    }

    /// The error of an OPEN at `at` while another buffer is open.
    pub(crate) fn report_still_open(&mut self, at: crate::pmac::origin::TextRange) {
        self.report(ParseError {
            code: "PMAC-7",
            at,
            message: "another buffer is still open".into(),
            help: Some("close it with CLOSE before this OPEN".into()),
        });
    }

    /// An on-line command in an open buffer, which is executed at load all the same.
    pub(crate) fn online_in_buffer(&mut self, start: usize) -> Parsed<()> {
        let crosses = std::mem::replace(&mut self.reader.cur.crosses_lines, false);
        let command = self.reader.online(&mut false);
        self.reader.cur.crosses_lines = crosses;
        self.execute_in_buffer(command?, start);
        Ok(())
    }

    /// The error for text with which no statement of a PLC begins; `byte` is its first byte in
    /// capitals.
    fn not_a_statement_error(&mut self, byte: u8) -> Parsed<()> {
        let next = self.reader.cur.byte_at(1);
        let axis = matches!(byte, b'A'..=b'H' | b'J' | b'K' | b'N' | b'O' | b'R'..=b'Z')
            && (next.is_ascii_digit() || matches!(next, b'(' | b'-'));
        if axis {
            return self.motion_statement_error();
        }
        if byte.is_ascii_digit() || matches!(byte, b'#' | b'&' | b'?' | b'%') {
            let at = self.reader.cur.next_word();
            let what = self.reader.cur.text_at(at);
            let message = format!("`{what}` is an on-line command, no statement");
            return syntax_help(at, message, "a PLC gives it with COMMAND\"…\"");
        }
        self.reader.unknown_word_error()
    }

    /// The error for a statement of motion programs.
    fn motion_statement_error(&mut self) -> Parsed<()> {
        let at = self.reader.cur.next_word();
        let what = self.reader.cur.text_at(at);
        let message = format!("`{what}` is for motion programs, not for PLCs");
        syntax_help(at, message, "a PLC can start one: COMMAND\"&1B1R\"")
    }

    /// Takes a RETURN, which ends at `after`, when it is the buffer's last statement: the
    /// controller itself adds one at CLOSE and lists it, so that backups have it.
    fn final_return(&mut self, after: Cursor<'_>) -> bool {
        let last = after.clone().peek() == 0
            || words::find(after, PLC.or(MOTION))
                .is_some_and(|(next, _)| matches!(next.keyword, Keyword::Close | Keyword::Return));
        if last {
            self.reader.cur.pos = after.pos;
        }
        last
    }

    /// Whether the open buffer is PLC 0 or PLCC 0.
    pub(crate) fn in_plc0(&self) -> bool {
        self.open.as_ref().is_some_and(|open| open.number == 0 && !open.discarded)
    }

    pub(crate) fn assignment(&mut self, kind: Kind, start: usize) -> Parsed<()> {
        match self.reader.variable_command(kind)? {
            VariableCommand::Assign(target, expr) => {
                if let Some(at) = self.reader.double_equals.take() {
                    self.tell(at, |span| {
                        Diagnostic::warning("PMAC-W6", span, "`==` is taken as `=` in a PLC")
                            .note("in a motion program it waits for the next move")
                            .help("write `=`")
                            .replace("=")
                    });
                }
                if self.reader.is_turbo() && matches!(target, Target::Range { .. }) {
                    let at = self.reader.cur.since(start);
                    let help = "assign to each variable, or to an indirect one in a loop";
                    return syntax_help(at, "Turbo PMAC has no ranges in programs", help);
                }
                self.push(StmtKind::Assign(target, expr), start);
            }
            VariableCommand::Define(kind, first, count) => {
                let command = self.reader.definition_of(kind, first, count)?;
                self.execute_in_buffer(command, start);
            }
            VariableCommand::Defaults(..) | VariableCommand::Query => {
                let at = self.reader.cur.since(start);
                return syntax_help(
                    at,
                    "a statement is expected: a variable alone does nothing",
                    "assign to it: P1=…",
                );
            }
        }
        Ok(())
    }

    /// Does what an on-line command in an open buffer asks for, with a warning. It reaches from the offset
    /// `start` to the cursor.
    fn execute_in_buffer(&mut self, command: OnlineCommand, start: usize) {
        let at = self.reader.cur.since(start);
        self.tell(at, |span| {
            Diagnostic::warning("PMAC-W3", span, "an on-line command in an open buffer")
                .note("it is done at load, it does not become part of the program")
                .help("move it before OPEN or after CLOSE")
        });
        self.execute(command, at);
    }

    /// ADDRESS, whose word is taken and begins at the offset `start`.
    fn address_statement(&mut self, start: usize) -> Parsed<()> {
        let (mut motor, mut system) = (None, None);
        loop {
            let given = motor.is_some() || system.is_some();
            if self.reader.cur.eat(b'#') {
                motor = Some(self.addressed("motor", 8, 32)?);
            } else if given && self.eat_lone_ampersand() {
                break;
            } else if self.reader.cur.eat(b'&') {
                system = Some(self.addressed("coordinate system", 8, 16)?);
            } else if !given {
                return self.reader.cur.expected("`#` and a motor or `&` and a coordinate system");
            } else {
                break;
            }
        }
        if self.in_plc0() {
            let at = self.reader.cur.since(start);
            return syntax(at, "ADDRESS is for PLCs 1 to 31");
        }
        let what = match (motor, system) {
            (None | Some(Ok(_)), None | Some(Ok(_))) => {
                StmtKind::Address(motor.and_then(Result::ok), system.and_then(Result::ok))
            }
            _ => {
                let mut number = |given: Option<Result<u8, Expr>>| match given {
                    Some(Ok(number)) => self.reader.constant(f64::from(number)),
                    Some(Err(expr)) => expr,
                    None => Expr::default(),
                };
                StmtKind::AddressBy(number(motor), number(system))
            }
        };
        self.push(what, start);
        Ok(())
    }

    /// Takes a `&` without a number in front of COMMAND, if there is one. It leaves the
    /// coordinate system as it is.
    fn eat_lone_ampersand(&mut self) -> bool {
        let mut ahead = self.reader.cur;
        let bare = ahead.eat(b'&') && is_command(ahead);
        if bare {
            let _ = self.reader.cur.eat(b'&');
        }
        bare
    }

    /// What is after `#` or `&` of ADDRESS: a number (`Ok`), or the value of a variable
    /// (`Err`). `pmac` and `turbo` are the largest numbers on the two controllers.
    fn addressed(&mut self, what: &str, pmac: u64, turbo: u64) -> Parsed<Result<u8, Expr>> {
        match self.reader.variable_kind() {
            Some(_) => self.variable_value().map(Err),
            None => self.reader.addressed(what, pmac, turbo).map(Ok),
        }
    }

    /// The value of a variable by itself.
    pub(crate) fn variable_value(&mut self) -> Parsed<Expr> {
        Ok(match self.plain_variable()? {
            Target::Var(kind, number) => {
                let from = self.reader.ops.len();
                self.reader.ops.push(Op::Var(kind, number));
                self.reader.since(from)
            }
            Target::Indirect(kind, expr) => {
                self.reader.ops.push(Op::Indirect(kind));
                Expr { len: expr.len + 1, ..expr }
            }
            Target::Range { .. } => Expr::default(),
        })
    }

    /// A variable by itself.
    pub(crate) fn plain_variable(&mut self) -> Parsed<Target> {
        self.reader.cur.blanks();
        let start = self.reader.cur.pos;
        let Some(kind) = self.reader.variable_kind() else {
            return self.reader.cur.expected("a variable");
        };
        self.reader.cur.pos += 1;
        if self.reader.cur.peek() == b'(' && kind != Kind::L {
            return Ok(Target::Indirect(kind, self.reader.index()?));
        }
        let number = self.reader.variable_number()?;
        let at = self.reader.cur.since(start);
        self.reader.uses(kind, number, at)?;
        Ok(Target::Var(kind, number))
    }
}
