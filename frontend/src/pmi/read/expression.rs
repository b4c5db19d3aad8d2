//! Reads expressions (PMI 2.3) by operator precedence, as parts in postfix order. Operators that
//! wait for their operands are kept on a stack of its own, so that long or deep expressions need no
//! recursion.

use plcc_diag::{Diagnostic, MessageText};

use crate::common::Limits;
use crate::pmi::read::{
    cursor::Cursor,
    syntax::{Expression, Part, PartKind},
    token::{Kind, RESERVED, Token},
};

/// How deep parentheses and brackets may nest for the original compiler (PMI 2.3.7).
const NESTING: u32 = 5;
/// How deep they may nest with `--limits none`.
const MAX_NESTING: u32 = 256;

/// What ends an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Until {
    /// The end of the statement.
    End,
    /// The `)` of an IF, whose `(` is taken already.
    Condition,
    /// The `]` of an assignment's target, whose `[` is taken already.
    Index,
}

/// An entry of the operator stack: an operator that waits for its right operand, or an opening that
/// waits to be closed.
#[derive(Clone, Copy, Debug)]
enum Waiting {
    Binary(Token),
    /// NOT, or else the minus sign of a negation.
    Unary(Token),
    /// `(`; `None` for that of an IF, which was read before the expression.
    Paren(Option<Token>),
    /// `[` after an array; `None` for that of an assigned element, which was read before the
    /// expression.
    Bracket(Option<Token>),
}

/// Reads one expression of a statement. It takes tokens from `cursor` and adds to `parts`.
pub(crate) struct ExpressionReader<'p, 'c> {
    cursor: &'p mut Cursor<'c>,
    parts: &'p mut Vec<Part>,
    limits: Limits,
    /// The operator stack.
    waiting: Vec<Waiting>,
    /// How many parentheses and brackets are open.
    depth: u32,
}

/// How tightly a binary operator binds: 5 binds tightest (PMI 2.3.7).
fn precedence(kind: Kind) -> Option<u8> {
    Some(match kind {
        Kind::Star | Kind::Slash | Kind::Percent => 5,
        Kind::Plus | Kind::Minus => 4,
        Kind::Eq | Kind::Ne | Kind::Lt | Kind::Le | Kind::Gt | Kind::Ge => 3,
        Kind::And => 2,
        Kind::Or => 1,
        _ => return None,
    })
}

impl<'p, 'c> ExpressionReader<'p, 'c> {
    pub(crate) fn new(
        cursor: &'p mut Cursor<'c>,
        parts: &'p mut Vec<Part>,
        limits: Limits,
    ) -> Self {
        Self { cursor, parts, limits, waiting: vec![], depth: 0 }
    }

    /// Reads an expression.
    pub(crate) fn read(mut self, until: Until) -> Expression {
        let from = self.parts.len() as u32;
        match until {
            Until::End => {}
            Until::Condition => self.waiting.push(Waiting::Paren(None)),
            Until::Index => {
                self.depth = 1;
                self.waiting.push(Waiting::Bracket(None));
            }
        }
        let error = self.run(until).err();
        Expression { parts: from..self.parts.len() as u32, error }
    }

    /// Reads tokens until the expression is over.
    fn run(&mut self, until: Until) -> Result<(), Box<Diagnostic>> {
        let mut operand_expected = true;
        loop {
            let step = if operand_expected {
                self.operand().map(|still| {
                    operand_expected = still;
                    false
                })
            } else {
                self.operator(until).map(|(expected, done)| {
                    operand_expected = expected;
                    done
                })
            };
            match step {
                Ok(true) => return Ok(()),
                Ok(false) => {}
                Err(problem) => {
                    self.apply_all(operand_expected);
                    return Err(problem);
                }
            }
        }
    }

    /// Applies all operators that wait, so that errors of their operands are found too: those are
    /// further in front than the one just found.
    fn apply_all(&mut self, operand_missing: bool) {
        if operand_missing && let Some(last) = self.cursor.tokens.last() {
            self.push(PartKind::Missing, *last);
        }
        while let Some(waiting) = self.waiting.pop() {
            self.apply(waiting);
        }
    }

    /// Adds an operator from the operator stack to the parts.
    fn apply(&mut self, waiting: Waiting) {
        match waiting {
            Waiting::Unary(at) => self.push(PartKind::Unary, at),
            Waiting::Binary(at) => self.push(PartKind::Binary, at),
            Waiting::Paren(_) | Waiting::Bracket(_) => {}
        }
    }

    fn push(&mut self, kind: PartKind, token: Token) {
        self.parts.push(Part { kind, token });
    }

    /// Makes an error at the next token, with `help` unless the error has one of its own.
    fn refuse<T>(
        &self,
        number: u8,
        message: impl Into<MessageText>,
        help: &'static str,
    ) -> Result<T, Box<Diagnostic>> {
        let problem = self.cursor.error_here(number, message);
        Err(Box::new(if problem.help.is_none() { problem.help(help) } else { problem }))
    }

    /// Reads an operand, an operator that is in front of one, or an opening. Returns `true` if an
    /// operand must still follow.
    fn operand(&mut self) -> Result<bool, Box<Diagnostic>> {
        let Some(token) = self.cursor.token() else {
            return self.refuse(
                34,
                "the expression ends where an operand is expected",
                "finish the expression",
            );
        };
        match token.kind {
            Kind::Minus | Kind::Slash => {
                if let Some(Waiting::Unary(at)) = self.waiting.last() {
                    let adjacent = self.unary_names(*at, token);
                    return self.refuse(
                        34,
                        format!("{adjacent} are next to each other"),
                        "put the second one and its operand in parentheses",
                    );
                }
                self.waiting.push(Waiting::Unary(token));
                self.cursor.at += 1;
                Ok(true)
            }
            Kind::LParen => {
                self.open()?;
                self.waiting.push(Waiting::Paren(Some(token)));
                self.cursor.at += 1;
                Ok(true)
            }
            Kind::Number(_) => {
                self.push(PartKind::Operand, token);
                self.cursor.at += 1;
                Ok(false)
            }
            Kind::Name | Kind::Executive => self.variable(token),
            Kind::Comma | Kind::Directive if self.in_parentheses() => self.not_closed(),
            _ => {
                let what = format!("an operand is expected, not {}", self.cursor.found());
                self.refuse(34, what, "a name, a number, T, F or a parenthesis is needed here")
            }
        }
    }

    /// Whether the innermost opening that waits is a parenthesis.
    fn in_parentheses(&self) -> bool {
        let open = |waiting: &&Waiting| matches!(waiting, Waiting::Paren(_) | Waiting::Bracket(_));
        matches!(self.waiting.iter().rev().find(open), Some(Waiting::Paren(_)))
    }

    /// The error of a comma or directive inside parentheses.
    fn not_closed<T>(&self) -> Result<T, Box<Diagnostic>> {
        let what = format!("a parenthesis is not closed before {}", self.cursor.found());
        self.refuse(32, what, "put a `)` before it, or remove it")
    }

    /// Two unary operators as a message names them.
    fn unary_names(&self, a: Token, b: Token) -> String {
        let word = |token: Token| if token.kind == Kind::Slash { "NOT" } else { "NEGATE" };
        format!("{} and {}", word(a), word(b))
    }

    /// Counts one more parenthesis or bracket and refuses one too many.
    fn open(&mut self) -> Result<(), Box<Diagnostic>> {
        self.depth += 1;
        if self.depth > NESTING && self.limits == Limits::Original {
            return self.refuse(
                32,
                "more than five parentheses and brackets are nested",
                "compute a part in a statement of its own, or compile with `--limits none`",
            );
        }
        if self.depth > MAX_NESTING {
            return self.refuse(
                32,
                "more than 256 parentheses and brackets are nested",
                "compute a part in a statement of its own",
            );
        }
        Ok(())
    }

    /// Reads a variable, T or F, or an array with its `[`. Returns `true` if an operand must still
    /// follow.
    fn variable(&mut self, token: Token) -> Result<bool, Box<Diagnostic>> {
        let name = self.cursor.slice(token);
        let indexed = self.cursor.second_kind() == Some(Kind::LBracket);
        if RESERVED.contains(&name) && !matches!(name, "T" | "F") {
            return self.refuse(
                34,
                format!("{name} is where an operand is expected"),
                "a keyword starts a statement",
            );
        }
        self.push(if indexed { PartKind::Array } else { PartKind::Operand }, token);
        self.cursor.at += 1;
        if indexed {
            let bracket = self.cursor.token();
            self.open()?;
            self.waiting.push(Waiting::Bracket(bracket));
            self.cursor.at += 1;
        }
        Ok(indexed)
    }

    /// Reads an operator between operands, or a closing. Returns two answers: whether an operand must
    /// follow, and whether the expression is over.
    fn operator(&mut self, until: Until) -> Result<(bool, bool), Box<Diagnostic>> {
        let Some(token) = self.cursor.token() else {
            self.reduce(0);
            return match self.waiting.last() {
                None => Ok((false, true)),
                Some(Waiting::Paren(at)) => {
                    let open = at.map(|token| self.cursor.span_of(token));
                    let problem = self.cursor.error_here(32, "a parenthesis is not closed");
                    let problem = if problem.help.is_none() {
                        problem.help("put a `)` where it ends")
                    } else {
                        problem
                    };
                    Err(Box::new(match open {
                        Some(open) => problem.label(open, "this one"),
                        None => problem,
                    }))
                }
                Some(_) => self.refuse(34, "a bracket is not closed", "put a `]` after the index"),
            };
        };
        if let Some(binds) = precedence(token.kind) {
            self.reduce(binds);
            self.waiting.push(Waiting::Binary(token));
            self.cursor.at += 1;
            return Ok((true, false));
        }
        match token.kind {
            Kind::RParen => {
                self.reduce(0);
                match self.waiting.last() {
                    Some(Waiting::Paren(_)) => {
                        self.waiting.pop();
                        self.depth = self.depth.saturating_sub(1);
                        self.cursor.at += 1;
                        Ok((false, self.waiting.is_empty() && until == Until::Condition))
                    }
                    Some(_) => {
                        self.refuse(34, "`)` is where `]` is expected", "close the bracket first")
                    }
                    None => self.refuse(32, "`)` has no `(`", "remove it, or open it further left"),
                }
            }
            Kind::RBracket => {
                self.reduce(0);
                match self.waiting.last().copied() {
                    Some(Waiting::Bracket(at)) => {
                        self.waiting.pop();
                        self.depth = self.depth.saturating_sub(1);
                        self.push(PartKind::Element, token);
                        self.cursor.at += 1;
                        Ok((false, at.is_none()))
                    }
                    Some(_) => self.refuse(
                        32,
                        "a parenthesis is not closed before `]`",
                        "put a `)` before it",
                    ),
                    None => self.refuse(34, "`]` has no `[`", "remove it"),
                }
            }
            Kind::Name | Kind::Executive | Kind::Number(_) | Kind::LParen => {
                let what = format!("an operator is expected, not {}", self.cursor.found());
                self.refuse(37, what, "put one of + - * / % & ! = /= < <= > >= between the two")
            }
            Kind::LBracket | Kind::Text => {
                let what = format!("{} has no place in an expression", self.cursor.found());
                self.refuse(34, what, "brackets belong right after an array's name")
            }
            Kind::Comma | Kind::Directive if self.in_parentheses() => self.not_closed(),
            _ => {
                let what = format!("{} is too much in this statement", self.cursor.found());
                self.refuse(5, what, "remove it, or put it on a line of its own")
            }
        }
    }

    /// Applies the waiting operators that bind at least as tightly as `binds`, up to the innermost
    /// opening.
    fn reduce(&mut self, binds: u8) {
        while let Some(waiting) = self.waiting.last().copied() {
            let applies = match waiting {
                Waiting::Unary(_) => true,
                Waiting::Binary(at) => precedence(at.kind).is_some_and(|p| p >= binds),
                Waiting::Paren(_) | Waiting::Bracket(_) => false,
            };
            if !applies {
                return;
            }
            self.waiting.pop();
            self.apply(waiting);
        }
    }
}
