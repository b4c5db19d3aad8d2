//! The statements of PLCs (guide, appendix D).

use plcc_abi::pmac::{Define, Kind, PlcOp, Space, Text};
use plcc_diag::Diagnostic;

use super::assign::Variable;
use super::cursor::{Fault, Parsed, syntax, syntax_help};
use super::download::{Checker, Frame, FrameKind};
use super::expr::Reader;
use super::online::{Flow, control};
use crate::pmac::ast::{Action, Expr, Op, Stmt, Target, What, WriteKind};

/// Deepest nesting of IF and WHILE.
const MAX_NESTING: usize = 256;

/// What belongs to motion programs, with the letters that are enough to know it.
const MOTION: &[&str] = &[
    "LIN", "RAPID", "RPD", "DWE", "DELAY", "DLY", "CIR", "SPLINE", "PVT", "RET", "GOTO", "GOSUB",
    "CALL", "READ", "WAIT", "STOP", "ABS", "INC", "FRAX", "HOME", "HM", "TA", "TM", "TS", "PSET",
    "CC0", "CC1", "CC2", "BLOCKST", "TSEL", "TINIT", "ADIS", "IDIS", "AROT", "IROT",
];

impl Checker<'_> {
    /// One statement of the open buffer.
    pub(crate) fn statement(&mut self) -> Parsed<()> {
        let byte = self.reader.cur.peek().to_ascii_uppercase();
        let start = self.reader.cur.pos;
        if let Some(kind) = self.reader.variable_kind() {
            return self.assignment(kind, start);
        }
        match byte {
            b'&' if self.bare_system() => return Ok(()),
            b'I' if self.reader.cur.word("IF") => return self.branch(FrameKind::If, start),
            b'W' if self.reader.cur.short("WHILE", 3) => {
                return self.branch(FrameKind::While, start);
            }
            b'E' => {
                if self.end_word("IF") {
                    self.end_if(start);
                    return Ok(());
                }
                if self.end_word("WHILE") {
                    self.end_while(start);
                    return Ok(());
                }
                if self.reader.cur.word("ELSE") {
                    self.else_branch(start);
                    return Ok(());
                }
            }
            b'A' if self.reader.cur.short("ADDRESS", 4) || self.reader.cur.word("ADR") => {
                return self.address_statement(start);
            }
            b'A' | b'O' => {
                let word = ["AND", "OR"].into_iter().find(|word| {
                    let mut ahead = self.reader.cur;
                    ahead.word(word) && ahead.peek() == b'('
                });
                if let Some(word) = word {
                    let at = self.reader.cur.here();
                    let message = format!("{word} stands behind no IF or WHILE");
                    return syntax_help(at, message, "it follows the condition it belongs to");
                }
            }
            b'C' => {
                if self.reader.cur.short("COMMAND", 4) || self.reader.cur.word("CMD") {
                    return self.command(start);
                }
                if self.reader.cur.word("CLOSE") || self.reader.cur.word("CLS") {
                    let at = self.reader.cur.since(start);
                    let mut ahead = self.reader.cur;
                    ahead.lines = false;
                    if ahead.word("ALL") {
                        self.reader.cur = ahead;
                    }
                    self.close(at);
                    return Ok(());
                }
                if self.reader.cur.word("CLEAR") || self.reader.cur.word("CLR") {
                    if let Some(open) = &mut self.open {
                        open.frames.clear();
                        open.fault = None;
                    }
                    if let Some(buffer) = self.buffer() {
                        buffer.code.clear();
                        buffer.broken = false;
                    }
                    return Ok(());
                }
            }
            _ => {}
        }
        self.second_half(byte, start)
    }

    fn second_half(&mut self, byte: u8, start: usize) -> Parsed<()> {
        if let Some(op) = self.reader.plc_word() {
            let plcs = self.reader.plcs()?;
            if plcs.compiled && op == PlcOp::Disable && self.in_plc0() {
                let at = self.reader.cur.since(start);
                return syntax(at, "PLC0 and PLCC0 cannot disable PLCCs");
            }
            self.push(What::Plc(op, plcs), start);
            return Ok(());
        }
        match byte {
            b'S' if self.reader.cur.word("SEND") => return self.send(start),
            b'D' if self.reader.cur.short("DISPLAY", 4) => return self.display(start),
            b'O' if self.reader.cur.starts_with("OPEN") => {
                let at = self.reader.cur.here();
                let fault = Fault {
                    code: "PMAC-7",
                    at,
                    message: "another buffer is still open".into(),
                    help: Some("close it with CLOSE before this OPEN".into()),
                };
                self.report(fault);
                self.close(at);
                return Ok(());
            }
            b'M' if self.ring_word() => return self.ring(start),
            b'L' if self.reader.cur.word("LOCK") => {
                // LOCK n,P: the P-variable is 0 when the lock was free, and it always is.
                let _ = self.reader.cur.integer();
                if self.reader.cur.eat(b',') {
                    let target = self.plain_variable()?;
                    let expr = self.reader.constant(0.0);
                    self.push(What::Assign(target, expr), start);
                }
                return Ok(());
            }
            b'U' if self.reader.cur.word("UNLOCK") => {
                let _ = self.reader.cur.integer();
                return Ok(());
            }
            b'S' if self.reader.cur.word("SETPHASE") => {
                while self.reader.cur.integer().is_some()
                    && (self.reader.cur.eat(b',')
                        || (self.reader.cur.eat(b'.') && self.reader.cur.eat(b'.')))
                {
                }
                return Ok(());
            }
            _ => {}
        }
        self.foreign(byte, start)
    }

    /// What is no statement: on-line commands that work while a buffer is open, and errors.
    fn foreign(&mut self, byte: u8, start: usize) -> Parsed<()> {
        if byte == b'R' && self.final_return() {
            return Ok(());
        }
        let at = self.reader.cur.here();
        let what = self.reader.cur.what(at).to_owned();
        let known = MOTION.iter().any(|word| self.reader.cur.starts_with(word));
        let next = self.reader.cur.byte_at(1);
        let moves = matches!(byte, b'A'..=b'H' | b'J' | b'K' | b'N' | b'O' | b'R'..=b'Z')
            && (next.is_ascii_digit() || matches!(next, b'(' | b'-'));
        if known || moves {
            let message = format!("`{what}` is for motion programs, not for PLCs");
            return syntax_help(at, message, "a PLC can start one: COMMAND\"&1B1R\"");
        }
        if byte == b'D'
            && (self.reader.cur.starts_with("DEL") || self.reader.cur.starts_with("DEF"))
            || byte == b'U' && self.reader.cur.starts_with("UNDEF")
        {
            self.reader.cur.lines = false;
            let mut actions = Vec::new();
            let done = self.reader.online(&mut actions, &mut false);
            self.reader.cur.lines = true;
            done?;
            self.warn_of_online(start);
            let at = self.reader.cur.since(start);
            self.take_online(actions, at);
            return Ok(());
        }
        if byte.is_ascii_digit() || matches!(byte, b'#' | b'&' | b'?' | b'%') {
            let message = format!("`{what}` is an on-line command, no statement");
            return syntax_help(at, message, "a PLC gives it with COMMAND\"…\"");
        }
        self.reader.unknown()
    }

    /// Takes a RETURN that is the buffer's last statement: the controller itself adds one at CLOSE,
    /// and lists it, so that backups have it.
    fn final_return(&mut self) -> bool {
        let mut ahead = self.reader.cur;
        if !(ahead.word("RETURN") || ahead.word("RET")) {
            return false;
        }
        let next = ahead.peek();
        let last = next == 0 || ["CLOSE", "CLS", "RET"].iter().any(|word| ahead.starts_with(word));
        if last {
            self.reader.cur = ahead;
        }
        last
    }

    fn in_plc0(&self) -> bool {
        self.open.as_ref().is_some_and(|open| open.number == 0 && !open.lost)
    }

    /// ENDIF and ENDWHILE: short, in full, or in two words on one line.
    fn end_word(&mut self, word: &str) -> bool {
        let mut ahead = self.reader.cur;
        if !ahead.word("END") {
            return false;
        }
        ahead.lines = false;
        let found = ahead.short(word, 1);
        if found {
            ahead.lines = self.reader.cur.lines;
            self.reader.cur = ahead;
        }
        found
    }

    fn assignment(&mut self, kind: Kind, start: usize) -> Parsed<()> {
        match self.reader.variable(kind)? {
            Variable::Assign(target, expr) => {
                self.warn_of_range(target, expr, self.reader.cur.since(start));
                self.push(What::Assign(target, expr), start);
            }
            Variable::Define(kind, first, count) => {
                let definition = self.reader.definition()?;
                self.warn_of_online(start);
                let at = self.reader.cur.since(start);
                if kind == Kind::L {
                    self.flow(Flow::DefineL(first, count, definition), at);
                } else {
                    self.take_online(vec![Action::Define(first, count, definition)], at);
                }
            }
            Variable::Defaults(..) | Variable::Query => {
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

    fn take_online(&mut self, actions: Vec<Action>, at: super::origin::At) {
        for action in actions {
            self.note_i5(&action);
            self.warn_of_action(&action, at);
            self.out.online.push(crate::pmac::ast::Online { action, at });
        }
    }

    fn warn_of_online(&mut self, start: usize) {
        let at = self.reader.cur.since(start);
        let diagnostic = self.flat.origins.diagnose(at, |span| {
            Diagnostic::warning("PMAC-W3", span, "an on-line command in an open buffer")
                .note("it is done at load, it does not become part of the program")
                .help("move it before OPEN or behind CLOSE")
        });
        self.diagnostics.push(diagnostic);
    }

    fn branch(&mut self, kind: FrameKind, start: usize) -> Parsed<()> {
        let at = self.reader.cur.since(start);
        let byte = self.reader.cur.byte();
        let condition = if byte.is_ascii_alphanumeric() || byte == b'_' {
            // A longer word. In front of a parenthesis it is meant for this one: WHIEL (P1=1).
            self.reader.cur.pos = start;
            let mut ahead = self.reader.cur;
            ahead.pos = ahead.here().end as usize;
            if ahead.peek() != b'(' {
                return self.reader.unknown();
            }
            self.reader.unknown()
        } else {
            self.whole_condition()
        };
        let expr = *condition.as_ref().unwrap_or(&Expr::default());
        let patch = self.here() as usize;
        let what = if kind == FrameKind::While { What::While } else { What::If };
        self.push(what(expr, 0), start);
        if let Some(open) = &mut self.open {
            if open.frames.len() >= MAX_NESTING && open.fault.is_none() {
                open.fault = Some((at, "this is nested deeper than 256 levels".into()));
            }
            open.frames.push(Frame { at, patch, kind });
        }
        match condition {
            Ok(_) => Ok(()),
            Err(fault) => {
                self.skip_condition_lines();
                Err(fault)
            }
        }
    }

    /// Behind a wrong condition: the AND and OR lines that belong to it are skipped.
    fn skip_condition_lines(&mut self) {
        let mut ahead = self.reader.cur;
        loop {
            ahead.skip_line();
            if ahead.word("AND") || ahead.word("OR") {
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

    fn misplaced(&mut self, start: usize, message: &str) {
        let at = self.reader.cur.since(start);
        if let Some(open) = &mut self.open
            && open.fault.is_none()
        {
            open.fault = Some((at, message.into()));
        }
    }

    fn else_branch(&mut self, start: usize) {
        let here = self.here();
        let frame = match self.open.as_mut().and_then(|open| open.frames.last_mut()) {
            Some(frame) if frame.kind == FrameKind::If => frame,
            _ => return self.misplaced(start, "this ELSE has no IF"),
        };
        let patch = frame.patch;
        frame.kind = FrameKind::Else;
        frame.patch = here as usize;
        self.push(What::Jump(0), start);
        self.patch(patch, here + 1);
    }

    fn patch(&mut self, index: usize, to: u32) {
        if let Some(stmt) = self.buffer().and_then(|buffer| buffer.code.get_mut(index)) {
            match &mut stmt.what {
                What::If(_, target) | What::While(_, target) | What::Jump(target) => *target = to,
                _ => {}
            }
        }
    }

    fn end_if(&mut self, start: usize) {
        let here = self.here();
        match self.open.as_mut().and_then(|open| open.frames.pop()) {
            Some(frame) if frame.kind != FrameKind::While => self.patch(frame.patch, here),
            Some(frame) => {
                if let Some(open) = &mut self.open {
                    open.frames.push(frame);
                }
                self.misplaced(start, "this ENDIF stands in a WHILE whose ENDWHILE is missing");
            }
            None => self.misplaced(start, "this ENDIF has no IF"),
        }
    }

    fn end_while(&mut self, start: usize) {
        let here = self.here();
        match self.open.as_mut().and_then(|open| open.frames.pop()) {
            Some(frame) if frame.kind == FrameKind::While => {
                self.push(What::EndWhile(frame.patch as u32), start);
                self.patch(frame.patch, here + 1);
            }
            Some(frame) => {
                if let Some(open) = &mut self.open {
                    open.frames.push(frame);
                }
                self.misplaced(start, "this ENDWHILE stands in an IF whose ENDIF is missing");
            }
            None => self.misplaced(start, "this ENDWHILE has no WHILE"),
        }
    }

    fn address_statement(&mut self, start: usize) -> Parsed<()> {
        let (mut motor, mut system) = (None, None);
        loop {
            let given = motor.is_some() || system.is_some();
            if self.reader.cur.eat(b'#') {
                motor = Some(self.addressed("motor", 8, 32)?);
            } else if given && self.bare_system() {
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
                What::Address(motor.and_then(Result::ok), system.and_then(Result::ok))
            }
            _ => {
                let mut number = |given: Option<Result<u8, Expr>>| match given {
                    Some(Ok(number)) => self.reader.constant(f64::from(number)),
                    Some(Err(expr)) => expr,
                    None => Expr::default(),
                };
                What::AddressBy(number(motor), number(system))
            }
        };
        self.push(what, start);
        Ok(())
    }

    /// Takes a `&` without a number in front of COMMAND: the coordinate system stays as it is.
    fn bare_system(&mut self) -> bool {
        let mut ahead = self.reader.cur;
        let bare = ahead.eat(b'&') && (ahead.word("COMMAND") || ahead.word("CMD"));
        if bare {
            let _ = self.reader.cur.eat(b'&');
        }
        bare
    }

    /// What stands behind `#` or `&`: a number, or the variable that holds it.
    fn addressed(&mut self, what: &str, pmac: u64, turbo: u64) -> Parsed<Result<u8, Expr>> {
        match self.reader.variable_kind() {
            Some(_) => self.variable_value().map(Err),
            None => self.reader.addressed(what, pmac, turbo).map(Ok),
        }
    }

    fn text(&mut self, text: Text, value: Option<Expr>, start: usize) {
        self.out.texts.push(text);
        let index = self.out.texts.len() as u32 - 1;
        self.push(What::Text(index, value), start);
    }

    fn send(&mut self, start: usize) -> Parsed<()> {
        let letter = self.reader.cur.byte().to_ascii_uppercase();
        let port =
            matches!(letter, b'S' | b'P' | b'R' | b'A').then(|| (letter as char).to_string());
        self.reader.cur.pos += usize::from(port.is_some());
        let text = self.reader.quoted()?;
        self.text(Text::Send { text, port }, None, start);
        Ok(())
    }

    fn display(&mut self, start: usize) -> Parsed<()> {
        self.reader.cur.blanks();
        let from = self.reader.cur.pos;
        let position = self.reader.cur.integer();
        let Ok(position) = u32::try_from(position.unwrap_or(0)) else {
            return syntax(self.reader.cur.since(from), "no display has this position");
        };
        let _ = self.reader.cur.eat(b',');
        if self.reader.cur.peek() == b'"' {
            let text = self.reader.quoted()?;
            self.text(Text::Show { text, position }, None, start);
            return Ok(());
        }
        let from = self.reader.cur.pos;
        let width = self.reader.cur.integer();
        let decimals = self.reader.cur.eat(b'.').then(|| self.reader.cur.integer()).flatten();
        let (Some(width @ 1..=80), decimals @ 0..=40) = (width, decimals.unwrap_or(0)) else {
            if width.is_none() {
                return self.reader.cur.expected("a text in quotes, or width.decimals");
            }
            return syntax(
                self.reader.cur.since(from),
                "a field has 1 to 80 characters and 0 to 40 decimals",
            );
        };
        if !self.reader.cur.eat(b',') {
            return self.reader.cur.expected("`,` and a variable");
        }
        let expr = self.variable_value()?;
        let (width, decimals) = (width as u32, decimals as u32);
        self.text(Text::Value { position, width, decimals }, Some(expr), start);
        Ok(())
    }

    /// The value of a variable by itself.
    fn variable_value(&mut self) -> Parsed<Expr> {
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
    fn plain_variable(&mut self) -> Parsed<Target> {
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

    /// Whether the ring's word and the number of a node or station come next.
    fn ring_word(&self) -> bool {
        let mut ahead = self.reader.cur;
        let known = ["MACRO", "MS", "MX"].iter().any(|w| ahead.starts_with(w));
        while ahead.byte().is_ascii_alphabetic() {
            ahead.pos += 1;
        }
        known && ahead.integer().is_some()
    }

    /// MACROSLVREAD and its kind: node, the other side's variable, ours.
    fn ring(&mut self, start: usize) -> Parsed<()> {
        let rest = self.reader.cur.rest();
        let line = rest.find('\n').map_or(rest, |end| rest.get(..end).unwrap_or("")).trim_end();
        let upper = line.to_ascii_uppercase();
        let word: String = upper.chars().take_while(char::is_ascii_alphabetic).collect();
        // The slave's variable may follow the word at once: MSR4,MI910,P1.
        let reads = ["MSR", "MXR", "MACROSLVREAD", "MACROAUXREAD", "MACROSLAVEREAD"];
        let read = reads.iter().any(|r| word.starts_with(r));
        if self.in_plc0() {
            return syntax(self.reader.cur.here(), "the MACRO ring is for PLCs 1 to 31");
        }
        let known = self.reader.cur;
        if !self.ring_items(word.len()) {
            // Another form: what concerns us, if anything, stands behind the last comma.
            self.reader.cur = known;
            self.reader.cur.pos += line.len();
            if !read {
                self.text(Text::Macro { text: line.to_owned() }, None, start);
                return Ok(());
            }
            let tail = line.rfind(',').map_or(0, |comma| comma + 1);
            self.reader.cur.pos = known.pos + tail;
        }
        if read {
            let target = self.plain_variable()?;
            let expr = self.reader.constant(0.0);
            self.push(What::Assign(target, expr), start);
            return Ok(());
        }
        let expr = self.variable_value()?;
        let at = self.reader.cur.since(start);
        let text = self.reader.cur.what(at).to_owned();
        self.text(Text::Macro { text }, Some(expr), start);
        Ok(())
    }

    /// Takes the ring's word, the node and the other side's variable or parameter; false where
    /// they are not followed by a variable of ours.
    fn ring_items(&mut self, word: usize) -> bool {
        let cur = &mut self.reader.cur;
        cur.pos += word;
        if cur.integer().is_none() {
            return false;
        }
        let _ = cur.eat(b',');
        cur.blanks();
        while cur.byte().is_ascii_alphabetic() {
            cur.pos += 1;
        }
        if cur.integer().is_none() {
            return false;
        }
        let _ = cur.eat(b',');
        cur.blanks();
        self.reader.variable_kind().is_some()
    }

    /// COMMAND: its text is read now, and done when the statement runs.
    fn command(&mut self, start: usize) -> Parsed<()> {
        // Turbo PMAC's forms say which port the answer goes to; a command here has none.
        let letter = self.reader.cur.byte().to_ascii_uppercase();
        self.reader.cur.pos += usize::from(matches!(letter, b'S' | b'P' | b'R' | b'A'));
        let text = self.reader.quoted()?;
        let ops = std::mem::take(&mut self.reader.ops);
        let mut inner = Reader::new(&text, self.reader.turbo);
        inner.ops = ops;
        let actions = read_command(&mut inner);
        self.reader.ops = std::mem::take(&mut inner.ops);
        let at = self.reader.cur.since(start);
        let (error, task) = match actions {
            Ok(actions) => {
                for action in &actions {
                    self.note_i5(action);
                    self.warn_of_action(action, at);
                }
                (None, self.command_code(actions, at))
            }
            Err(fault) => {
                let diagnostic = self.flat.origins.diagnose(at, |span| {
                    Diagnostic::warning("PMAC-W4", span, "this command will be refused (ERR003)")
                        .note(fault.message)
                });
                self.diagnostics.push(diagnostic);
                (Some("ERR003".to_owned()), None)
            }
        };
        self.text(Text::Command { text, error, task }, None, start);
        // Some write a row of commands with commas between.
        let mut ahead = self.reader.cur;
        if ahead.eat(b',') && (ahead.word("COMMAND") || ahead.word("CMD")) {
            let _ = self.reader.cur.eat(b',');
        }
        Ok(())
    }

    /// The statements that do what a command says; none for one that only concerns motion.
    fn command_code(&mut self, actions: Vec<Action>, at: super::origin::At) -> Option<u32> {
        let mut code = Vec::new();
        for action in actions {
            match action {
                Action::Assign(target, expr) => code.push(What::Assign(target, expr)),
                Action::Defaults(first, count, step) => {
                    for k in 0..count {
                        let number = first + k * step;
                        let expr = self.reader.constant(crate::pmac::reference::tables::i_default(
                            self.out.controller,
                            u32::from(number),
                        ));
                        code.push(What::Assign(Target::Var(Kind::I, number), expr));
                    }
                }
                Action::Define(first, count, definition) => {
                    let (first, last) = (u32::from(first), u32::from(first + count) - 1);
                    self.out.defines.push(Define { first, last, definition });
                    code.push(What::Define(self.out.defines.len() as u32 - 1));
                }
                Action::Plc(op, plcs) => code.push(What::Plc(op, plcs)),
                Action::System(system) => code.push(What::Address(None, Some(system))),
                Action::Write(kind, addr, values) => {
                    let space = match kind {
                        WriteKind::X => Space::X,
                        WriteKind::Y => Space::Y,
                        WriteKind::Long | WriteKind::Double | WriteKind::Program => continue,
                    };
                    for (k, value) in values.into_iter().enumerate() {
                        code.push(What::Word(space, addr.wrapping_add(k as u32), value));
                    }
                }
                Action::Save => code.push(What::Save),
                Action::Reset | Action::DeletePlcc(_) | Action::Motion => {}
            }
        }
        if !code.iter().any(|what| !matches!(what, What::Address(..))) {
            return None;
        }
        let code = code.into_iter().map(|what| Stmt { what, at, integer: false }).collect();
        self.out.commands.push(code);
        Some(self.out.commands.len() as u32 - 1)
    }
}

/// Reads a COMMAND's text.
fn read_command(reader: &mut Reader<'_>) -> Parsed<Vec<Action>> {
    let mut actions = Vec::new();
    if reader.cur.byte() == b'^' && reader.cur.rest().len() == 2 {
        control(reader.cur.byte_at(1), &mut actions);
        return Ok(actions);
    }
    let mut table = false;
    loop {
        reader.cur.blanks();
        if reader.cur.at_end() {
            return Ok(actions);
        }
        let start = reader.cur.pos;
        if let Flow::DefineL(..) = reader.online(&mut actions, &mut table)? {
            return syntax(reader.cur.since(start), "L-variables are the compiler's: no command");
        }
    }
}
