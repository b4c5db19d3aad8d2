//! Parses expressions (PMI 2.3) by operator precedence. Operators and operands are kept on stacks
//! of its own, so that long or deep expressions need no recursion. Names, types and constants are
//! checked on the way.

mod operation;

use plcc_abi::pmi::Type;
use plcc_diag::{Diagnostic, MessageText};

use crate::common::Limits;
use crate::pmi::{
    analyse::{
        lookup::resolve,
        names::{Names, RESERVED},
    },
    ast::{Meaning, Op, Ops, SymbolId},
    read::{
        cursor::Cursor,
        diagnostic::error,
        token::{Kind, Token},
    },
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
    Index(SymbolId),
}

/// An entry of the operator stack: an operator that waits for its right operand, or an opening that
/// waits to be closed.
#[derive(Clone, Copy, Debug)]
enum Waiting {
    Binary {
        symbol: Kind,
        at: Token,
    },
    /// NOT, or else the minus sign of a negation.
    Unary {
        not: bool,
        at: Token,
    },
    /// `(`; `at` is `None` for that of an IF, which was read before the expression.
    Paren {
        at: Option<Token>,
    },
    /// `[` after an array, `None` if the array is not known; `at` is `None` for that of an
    /// assigned element, which was read before the expression.
    Bracket {
        array: Option<SymbolId>,
        at: Option<Token>,
    },
}

/// An entry of the operand stack.
#[derive(Clone, Copy, Debug)]
struct Operand {
    /// `None` if an error made its type unknown.
    ty: Option<Type>,
    /// Its value, if it is made of constants alone.
    constant: Option<i32>,
    /// All 32 bits of its value, if it is a product of constants.
    product: Option<i32>,
    /// The index of its first operation in [`Parser::ops`].
    start: usize,
    /// The token with which it begins.
    at: Token,
}

/// The index of an assigned element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Index {
    /// It is made of constants alone and has this value.
    At(u32),
    /// It is computed when the statement runs.
    Computed,
}

/// A parsed expression.
pub(crate) struct Parsed {
    pub(crate) ops: Ops,
    /// Its type; `None` if an error made it unknown.
    pub(crate) ty: Option<Type>,
    /// What kind of index it is, if it was parsed as one ([`Until::Index`]).
    pub(crate) index: Index,
}

/// Parses one expression of a statement. It reads tokens from `cursor` and adds operations to
/// `ops`.
pub(crate) struct Parser<'p, 'c> {
    pub(crate) cursor: &'p mut Cursor<'c>,
    pub(crate) names: &'p mut Names,
    pub(crate) ops: &'p mut Vec<Op>,
    pub(crate) limits: Limits,
    /// The operator stack.
    waiting: Vec<Waiting>,
    /// The operand stack.
    operands: Vec<Operand>,
    /// How many parentheses and brackets are open.
    depth: u32,
    /// The error that stands first in the text, of those found so far.
    problem: Option<Box<Diagnostic>>,
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

impl<'p, 'c> Parser<'p, 'c> {
    pub(crate) fn new(
        cursor: &'p mut Cursor<'c>,
        names: &'p mut Names,
        ops: &'p mut Vec<Op>,
        limits: Limits,
    ) -> Self {
        let (waiting, operands) = (vec![], vec![]);
        Self { cursor, names, ops, limits, waiting, operands, depth: 0, problem: None }
    }

    /// Parses an expression.
    ///
    /// # Errors
    /// The error that stands first in the text.
    pub(crate) fn parse(mut self, until: Until) -> Result<Parsed, Box<Diagnostic>> {
        let from = self.ops.len();
        match until {
            Until::End => {}
            Until::Condition => self.waiting.push(Waiting::Paren { at: None }),
            Until::Index(array) => {
                self.depth = 1;
                self.waiting.push(Waiting::Bracket { array: Some(array), at: None });
            }
        }
        let outcome = self.run(until);
        if let Err(problem) = outcome {
            self.keep_first(*problem);
        }
        if let Some(problem) = self.problem {
            self.ops.truncate(from);
            return Err(problem);
        }
        let index = match self.operands.last() {
            Some(Operand { constant: Some(value), .. }) if matches!(until, Until::Index(_)) => {
                self.ops.truncate(from);
                Index::At(*value as u32)
            }
            _ => Index::Computed,
        };
        let ty = self.operands.last().and_then(|operand| operand.ty);
        Ok(Parsed { ops: from as u32..self.ops.len() as u32, ty, index })
    }

    /// Keeps an error, unless one is kept that stands further in front.
    fn keep_first(&mut self, problem: Diagnostic) {
        match &self.problem {
            Some(first) if first.span.start <= problem.span.start => {}
            _ => self.problem = Some(Box::new(problem)),
        }
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

    /// Applies all operators that wait. This finds errors that stand before the one just found,
    /// since error 42 stands at its operator. A missing operand counts as one of unknown type.
    fn apply_all(&mut self, operand_missing: bool) {
        if operand_missing && let Some(at) = self.cursor.tokens.last() {
            let (start, at) = (self.ops.len(), *at);
            self.operands.push(Operand { ty: None, constant: None, product: None, start, at });
        }
        while let Some(waiting) = self.waiting.pop() {
            match waiting {
                Waiting::Binary { .. } | Waiting::Unary { .. } => self.apply(waiting),
                Waiting::Paren { .. } | Waiting::Bracket { .. } => {}
            }
        }
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

    /// Reads an operand, an operator that stands in front of one, or an opening. Gives `true` if an
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
                if let Some(Waiting::Unary { at, .. }) = self.waiting.last() {
                    let adjacent = self.unary_names(*at, token);
                    return self.refuse(
                        34,
                        format!("{adjacent} stand side by side"),
                        "put the second one and its operand in parentheses",
                    );
                }
                self.waiting.push(Waiting::Unary { not: token.kind == Kind::Slash, at: token });
                self.cursor.at += 1;
                Ok(true)
            }
            Kind::LParen => {
                self.open()?;
                self.waiting.push(Waiting::Paren { at: Some(token) });
                self.cursor.at += 1;
                Ok(true)
            }
            Kind::Number(value) => {
                let ty = if value <= 32_767 { Type::Integer } else { Type::Long };
                self.constant(token, ty, value as i32);
                self.cursor.at += 1;
                Ok(false)
            }
            Kind::Name | Kind::Executive => self.variable(token),
            Kind::Comma | Kind::Directive if self.in_parentheses() => self.not_closed(),
            _ => {
                let what = format!("an operand is expected, not {}", self.cursor.found());
                self.refuse(34, what, "a name, a number, T, F or a parenthesis stands here")
            }
        }
    }

    /// Whether the innermost opening that waits is a parenthesis.
    fn in_parentheses(&self) -> bool {
        let open =
            |waiting: &&Waiting| matches!(waiting, Waiting::Paren { .. } | Waiting::Bracket { .. });
        matches!(self.waiting.iter().rev().find(open), Some(Waiting::Paren { .. }))
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

    fn push(&mut self, token: Token, ty: Option<Type>, constant: Option<i32>, op: Op) {
        let start = self.ops.len();
        self.operands.push(Operand { ty, constant, product: None, start, at: token });
        self.ops.push(op);
    }

    fn constant(&mut self, token: Token, ty: Type, value: i32) {
        self.push(token, Some(ty), Some(value), Op::Const(value));
    }

    /// Reads a variable, T or F, or an array with its `[`. Gives `true` if an operand must still
    /// follow.
    fn variable(&mut self, token: Token) -> Result<bool, Box<Diagnostic>> {
        let name = self.cursor.slice(token);
        let span = self.cursor.span_of(token);
        let indexed = self.cursor.second_kind() == Some(Kind::LBracket);
        if RESERVED.contains(&name) && !matches!(name, "T" | "F") {
            return self.refuse(
                34,
                format!("{name} stands where an operand is expected"),
                "a keyword starts a statement",
            );
        }
        if matches!(name, "T" | "F") && !indexed {
            self.constant(token, Type::Logical, i32::from(name == "T"));
            self.cursor.at += 1;
            return Ok(false);
        }
        let resolved = if matches!(name, "T" | "F") {
            let what = format!("{name} is a constant, no array");
            Err(Box::new(error(35, span, what).help("remove the brackets")))
        } else {
            resolve(self.names, name, span, indexed)
        };
        let array = match resolved {
            Ok(array) => array,
            Err(problem) => {
                self.keep_first(*problem);
                None
            }
        };
        self.cursor.at += 1;
        if indexed {
            let bracket = self.cursor.token();
            self.open()?;
            self.waiting.push(Waiting::Bracket { array, at: bracket });
            self.cursor.at += 1;
            return Ok(true);
        }
        let known = array.and_then(|id| Some((id, self.names.get(id)?)));
        let (ty, constant, op) = match known {
            None => (None, None, Op::Const(0)),
            Some((id, symbol)) => match &symbol.meaning {
                Meaning::Constant(values) => {
                    let value = values.first().copied().unwrap_or(0);
                    (Some(symbol.ty), Some(value), Op::Const(value))
                }
                _ => (Some(symbol.ty), None, Op::Load(id)),
            },
        };
        self.push(token, ty, constant, op);
        Ok(false)
    }

    /// Reads an operator between operands, or a closing. Gives two answers: whether an operand must
    /// follow, and whether the expression is over.
    fn operator(&mut self, until: Until) -> Result<(bool, bool), Box<Diagnostic>> {
        let Some(token) = self.cursor.token() else {
            self.reduce(0);
            return match self.waiting.last() {
                None => Ok((false, true)),
                Some(Waiting::Paren { at }) => {
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
            self.waiting.push(Waiting::Binary { symbol: token.kind, at: token });
            self.cursor.at += 1;
            return Ok((true, false));
        }
        match token.kind {
            Kind::RParen => {
                self.reduce(0);
                match self.waiting.last() {
                    Some(Waiting::Paren { .. }) => {
                        self.waiting.pop();
                        self.depth = self.depth.saturating_sub(1);
                        self.cursor.at += 1;
                        Ok((false, self.waiting.is_empty() && until == Until::Condition))
                    }
                    Some(_) => self.refuse(
                        34,
                        "`)` stands where `]` is expected",
                        "close the bracket first",
                    ),
                    None => self.refuse(32, "`)` has no `(`", "remove it, or open it further left"),
                }
            }
            Kind::RBracket => {
                self.reduce(0);
                match self.waiting.last().copied() {
                    Some(Waiting::Bracket { array, at }) => {
                        self.waiting.pop();
                        self.depth = self.depth.saturating_sub(1);
                        let done = at.is_none();
                        self.element(array, token, done);
                        self.cursor.at += 1;
                        Ok((false, done))
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
                Waiting::Unary { .. } => true,
                Waiting::Binary { symbol, .. } => precedence(symbol).is_some_and(|p| p >= binds),
                Waiting::Paren { .. } | Waiting::Bracket { .. } => false,
            };
            if !applies {
                return;
            }
            self.waiting.pop();
            self.apply(waiting);
        }
    }
}
