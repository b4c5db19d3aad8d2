//! Conditions in parentheses and computations in brackets (NCT 4.4, 4.8). They are read without
//! recursion, so that deep nesting needs no stack.

use plcc_diag::Diagnostic;

use crate::common::Limits;
use crate::nct::{
    ast::{Arith, ConditionPart, Op},
    read::{
        cursor::Cursor,
        diagnostic::{Read, SyntaxError, error, shown},
        operand::{Prefix, begins_constant, constant, load, refuse},
        parser::Parser,
    },
};

/// How deep they may nest for the original compiler.
const ORIGINAL_DEPTH: usize = 8;
/// How deep they may nest with `--limits none`.
const MAX_DEPTH: usize = 256;

/// An open parenthesis or bracket.
struct Open<T> {
    /// Where it is.
    at: usize,
    /// What is done with its value when it is closed.
    then: T,
}

/// The operation that a letter between two conditions, or two operands, stands for.
fn gate(c: Option<char>) -> Option<Arith> {
    match c {
        Some('A') => Some(Arith::And),
        Some('O') => Some(Arith::Or),
        Some('X') => Some(Arith::Xor),
        _ => None,
    }
}

impl Parser<'_> {
    /// Refuses one more parenthesis or bracket inside `depth` others if that is too deep.
    fn check_depth(&mut self, depth: usize) -> Read<()> {
        let most = match self.limits {
            Limits::Original => ORIGINAL_DEPTH,
            Limits::None => MAX_DEPTH,
        };
        if depth < most {
            return Ok(());
        }
        let span = self.cursor.span_here();
        let message = format!("more than {most} levels of parentheses");
        if self.limits == Limits::None {
            let help = "compute a part before and keep it in a flag";
            return Err(Box::new(Diagnostic::error("NCT-X1", span, message).help(help)));
        }
        let help = "compute a part before and keep it in a flag, or use --limits none";
        Err(error(12, span, message, help))
    }

    /// A condition in parentheses, at its `(`.
    pub(crate) fn group(&mut self) -> Read<()> {
        let mut open = vec![];
        let result = self.group_parts(&mut open);
        result.map_err(|fail| self.skip_group(fail, open.iter().map(|o| o.at).collect(), '(', ')'))
    }

    /// Reads a condition in parentheses; `open` holds those that are open.
    fn group_parts(&mut self, open: &mut Vec<Open<Option<Arith>>>) -> Read<()> {
        let mut waiting = None;
        loop {
            // A test or another parenthesis must begin here.
            if self.cursor.at('(') {
                self.check_depth(open.len())?;
                open.push(Open { at: self.cursor.pos(), then: waiting.take() });
                self.cursor.bump();
                continue;
            }
            let first = waiting.is_none();
            if !self.test()? {
                return Err(self.no_test(first));
            }
            if let Some(gate) = waiting.take() {
                self.out.condition_parts.push(ConditionPart::Gate(gate));
            }
            loop {
                if self.cursor.eat(')') {
                    match open.pop() {
                        Some(Open { then: Some(gate), .. }) => {
                            self.out.condition_parts.push(ConditionPart::Gate(gate));
                        }
                        Some(_) => {}
                        None => return Ok(()),
                    }
                    if open.is_empty() {
                        return Ok(());
                    }
                } else if let Some(gate) = gate(self.cursor.peek()) {
                    waiting = Some(gate);
                    self.cursor.bump();
                    break;
                } else {
                    return Err(self.wrong_inside("A, O, X or `)`"));
                }
            }
        }
    }

    /// The error if no condition begins where one must, right after `(` (`first`) or after a
    /// gate.
    fn no_test(&mut self, first: bool) -> SyntaxError {
        if !first {
            return self.wrong_inside("a condition");
        }
        let found = self.cursor.peek();
        let span = self.cursor.span_here();
        let help = "a condition must follow `(`: a flag, a counter, a timer or a relation";
        error(18, span, format!("{} begins no condition", shown(found)), help)
    }

    /// The error of a character that can't be inside parentheses or brackets; `wanted` must
    /// be in its place. A character that is foreign to the language has another number.
    fn wrong_inside(&mut self, wanted: &str) -> SyntaxError {
        let found = self.cursor.peek();
        let foreign = found
            .is_some_and(|c| !matches!(c, 'A'..='Z' | '0'..='9') && !":,.$()[]<>=+-*/".contains(c));
        let number = if foreign { 44 } else { 62 };
        let message = format!("{} is not allowed here", shown(found));
        let span = self.cursor.span_here();
        if foreign {
            self.cursor.bump();
        }
        error(number, span, message, format!("{wanted} must be here"))
    }

    /// Skips the rest of a parenthesis or bracket in which `fail` was found, up to where it is
    /// closed. `open` holds the offsets of all that are open. If nothing closes one of them,
    /// nothing is skipped, and the error is the missing parenthesis rather than `fail`, if `fail`
    /// may follow from it.
    fn skip_group(
        &mut self,
        fail: SyntaxError,
        open: Vec<usize>,
        opening: char,
        closing: char,
    ) -> SyntaxError {
        if self.unclosed.is_none() {
            self.unclosed = Some(find_unclosed(Cursor::new(self.file, self.text)));
        }
        let unclosed = self.unclosed.as_deref().unwrap_or_default();
        let is_unclosed = |at: &usize| unclosed.binary_search(at).is_ok();
        if let Some(&at) = open.iter().find(|at| is_unclosed(at)) {
            let wrong = [
                crate::nct::read::diagnostic::code(62),
                crate::nct::read::diagnostic::code(18),
                crate::nct::read::diagnostic::code(20),
            ];
            if !wrong.contains(&fail.code) {
                return fail;
            }
            let span = plcc_diag::Span::new(self.file, at, at + 1);
            let message = format!("nothing closes this `{opening}`");
            return error(11, span, message, format!("write `{closing}` where it ends"));
        }
        let mut depth = open.len();
        while depth > 0 {
            match self.cursor.bump() {
                Some(c) if c == opening => depth += 1,
                Some(c) if c == closing => depth -= 1,
                Some(_) => {}
                None => break,
            }
        }
        fail
    }

    /// A bracket, at its `[`. It is the operand of the operation `then`, if there is one.
    pub(crate) fn bracket(&mut self, start: usize, then: Option<Arith>) -> Read<()> {
        let before = self.out.stmts.len();
        let mut open = vec![];
        let result = self.bracket_parts(start, then, &mut open);
        result.map_err(|fail| {
            self.out.stmts.truncate(before);
            self.skip_group(fail, open.iter().map(|o| o.at).collect(), '[', ']')
        })
    }

    /// Reads a bracket and emits its statements; `open` holds those that are open.
    fn bracket_parts(
        &mut self,
        start: usize,
        mut waiting: Option<Arith>,
        open: &mut Vec<Open<Option<(Arith, u16)>>>,
    ) -> Read<()> {
        let mut start = start;
        loop {
            // An operand or another bracket must begin here.
            if self.cursor.at('[') {
                self.check_depth(open.len())?;
                let slot = open.len() as u16;
                let at = self.cursor.pos();
                self.cursor.bump();
                if waiting.is_some() {
                    self.out.slots = self.out.slots.max(slot + 1);
                    self.emit(start, Op::Push(slot));
                }
                open.push(Open { at, then: waiting.take().map(|op| (op, slot)) });
                start = self.cursor.pos();
                continue;
            }
            let operand = self.bracket_operand(start, waiting.is_none())?;
            let op = match waiting.take() {
                Some(op) => self.arith(start, op, operand)?,
                None => Op::Load(operand),
            };
            self.emit(start, op);
            loop {
                start = self.cursor.pos();
                if self.cursor.eat(']') {
                    if let Some(Open { then: Some((op, slot)), .. }) = open.pop() {
                        self.emit(start, Op::Apply { op, slot });
                    }
                    if open.is_empty() {
                        return Ok(());
                    }
                } else if let Some(op) = self.bracket_operation(start)? {
                    waiting = Some(op);
                    break;
                }
            }
        }
    }

    /// Reads an operation in a bracket: returns one that needs an operand, or `None` for a shift or
    /// conversion, which needs none and is emitted.
    fn bracket_operation(&mut self, start: usize) -> Read<Option<Arith>> {
        let found = self.cursor.peek();
        let op = match found {
            Some('+') => Arith::Add,
            Some('-') => Arith::Sub,
            Some('*') => Arith::Mul,
            Some('/') => Arith::Div,
            Some('B') => {
                self.cursor.bump();
                let op = self.convert(start)?;
                self.emit(start, op);
                return Ok(None);
            }
            Some(arrow @ ('<' | '>')) => {
                let mut ahead = self.cursor.clone();
                ahead.bump();
                if !ahead.eat(arrow) {
                    return Err(self.wrong_inside("an operation or `]`"));
                }
                self.cursor = ahead;
                let op = self.shift(start, arrow == '<')?;
                self.emit(start, op);
                return Ok(None);
            }
            other => match gate(other) {
                Some(op) => op,
                None => return Err(self.wrong_inside("an operation or `]`")),
            },
        };
        self.cursor.bump();
        Ok(Some(op))
    }

    /// An operand in a bracket; `first` if it is the first one, which OP is loaded with.
    fn bracket_operand(&mut self, start: usize, first: bool) -> Read<crate::nct::ast::Operand> {
        let cursor = &mut self.cursor;
        if begins_constant(cursor) && (!first || cursor.at('.')) {
            return constant(cursor, start);
        }
        if first && cursor.eat(',') {
            return crate::nct::read::number::decimal(cursor, start)
                .map(crate::nct::ast::Operand::Const);
        }
        let mut ahead = cursor.clone();
        let not = ahead.eat('N');
        if ahead.eat('L') {
            *cursor = ahead;
            return load(cursor, start, if not { Prefix::LoadNot } else { Prefix::Load });
        }
        if matches!(ahead.peek(), Some('I' | 'Y' | 'V' | 'P' | 'F' | 'R' | 'Q' | 'T' | 'H' | 'M')) {
            let name = ahead.peek().unwrap_or('F');
            let n = if not { "N" } else { "" };
            *cursor = ahead;
            let help = format!("write {n}L{name}…: in brackets variables are loaded");
            return Err(refuse(cursor, |cursor| {
                error(20, cursor.span_from(start), "L is missing before the variable's name", help)
            }));
        }
        Err(self.wrong_inside("a constant, a variable after L, or `[`"))
    }
}

/// The offsets, in rising order, of the parentheses and brackets that nothing closes. None of them
/// can hold a `Z` or `$`, so what is open there is never closed. The same is true of a label and a
/// `J`, except where the innermost one is closed next: there they are a mistake inside it.
fn find_unclosed(mut cursor: Cursor<'_>) -> Vec<usize> {
    let mut open: Vec<(char, usize)> = vec![];
    let mut unclosed = vec![];
    // How many of the open ones are parentheses.
    let mut round = 0_usize;
    let mut next_closing = NextClosing::default();
    loop {
        let at = cursor.pos();
        let Some(next) = cursor.bump() else { break };
        match next {
            '(' | '[' => {
                round += usize::from(next == '(');
                open.push((next, at));
            }
            ')' | ']' => {
                let opening = if next == ')' { '(' } else { '[' };
                let any = if next == ')' { round > 0 } else { open.len() > round };
                while any && let Some((kind, at)) = open.pop() {
                    round -= usize::from(kind == '(');
                    if kind == opening {
                        break;
                    }
                    unclosed.push(at);
                }
            }
            ':' | 'J' if open.last().is_some_and(|&(kind, _)| next_closing.is(&cursor, kind)) => {}
            ':' => {
                round = 0;
                unclosed.extend(open.drain(..).map(|(_, at)| at));
                let label: String = (0..3).filter_map(|_| cursor.bump()).collect();
                if matches!(label.as_str(), "197" | "198" | "199" | "200") {
                    cursor.enter_raw();
                    while cursor.bump_raw().is_some_and(|c| c != Some('$')) {}
                    cursor.leave_raw();
                }
            }
            'Z' | 'J' | '$' => {
                round = 0;
                unclosed.extend(open.drain(..).map(|(_, at)| at));
            }
            _ => {}
        }
    }
    unclosed.extend(open.into_iter().map(|(_, at)| at));
    unclosed.sort_unstable();
    unclosed
}

/// Which character comes next of those that open and close parentheses and brackets or end
/// conditions and texts.
#[derive(Default)]
struct NextClosing {
    /// The answer is known for every place up to this offset, so that no text is searched twice.
    end: usize,
    /// The character there.
    found: Option<char>,
}

impl NextClosing {
    /// Whether that character, after the cursor, closes an `opening`.
    fn is(&mut self, cursor: &Cursor<'_>, opening: char) -> bool {
        if self.end <= cursor.pos() {
            let mut ahead = cursor.clone();
            self.found = None;
            while let Some(next) = ahead.bump() {
                if matches!(next, '(' | ')' | '[' | ']' | 'Z' | '$') {
                    self.found = Some(next);
                    break;
                }
            }
            self.end = ahead.end();
        }
        self.found == Some(if opening == '(' { ')' } else { ']' })
    }
}
