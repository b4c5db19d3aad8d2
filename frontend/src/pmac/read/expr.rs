//! The parser of expressions and conditions. It writes them in postfix order, with two stacks
//! instead of recursion (the shunting-yard algorithm).

use plcc_abi::pmac::Kind;
use plcc_diag::MessageText;

use super::cursor::{Cursor, ParseError, Parsed, syntax, syntax_help};
use super::ranges::{RangeBudget, UsedL};
use crate::common::Controller;
use crate::pmac::ast::{Bin, Cmp, Expr, FUNCTIONS, Func, Op};
use crate::pmac::origin::TextRange;

/// Deepest nesting of parentheses.
const MAX_NESTING: usize = 256;

/// The parser that statements of PLCs and on-line commands share: expressions here, assignments,
/// definitions and on-line commands in the files beside this one.
#[derive(Debug)]
pub(crate) struct Reader<'a> {
    /// The place in the text.
    pub(crate) cur: Cursor<'a>,
    /// The operations of all expressions that were read.
    pub(crate) ops: Vec<Op>,
    pub(crate) controller: Controller,
    /// In a PLCC the L-variables that are used; elsewhere `None`, and L-variables are errors.
    pub(crate) l_used: Option<Vec<UsedL>>,
    /// How many variables ranges may still name.
    pub(crate) range_budget: RangeBudget,
    /// Where the statement that was read last has `==`, which is taken as `=`.
    pub(crate) double_equals: Option<TextRange>,
    /// The operations of PLCCs that are constants written with a decimal point: their indices in `ops`.
    pub(crate) constants_with_point: Vec<usize>,
    /// Whether comparators, AND and OR may be outside of parentheses.
    bare_conditions: bool,
}

/// An operator whose right operand is not read yet, or an open parenthesis.
#[derive(Clone, Copy, PartialEq)]
enum PendingOperator {
    Paren,
    Func(Func),
    Index(Kind),
    Neg,
    Bin(Bin),
    Cmp(Cmp),
    Both,
    Either,
}

impl PendingOperator {
    /// How tight the operator binds; 0 for what ends with a closing parenthesis.
    fn precedence(self) -> u8 {
        match self {
            Self::Paren | Self::Func(_) | Self::Index(_) => 0,
            Self::Either => 1,
            Self::Both => 2,
            Self::Cmp(_) => 3,
            Self::Bin(Bin::Add | Bin::Sub | Bin::Or | Bin::Xor) => 4,
            Self::Bin(Bin::Mul | Bin::Div | Bin::Mod | Bin::And) => 5,
            Self::Neg => 6,
        }
    }
}

/// The two stacks of the shunting-yard algorithm.
struct Stacks {
    operators: Vec<(PendingOperator, TextRange)>,
    /// For each operand that is complete, whether it is a truth value.
    values: Vec<bool>,
    /// How many parentheses are open.
    depth: usize,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(text: &'a str, controller: Controller) -> Self {
        Self {
            cur: Cursor::new(text),
            ops: Vec::new(),
            controller,
            l_used: None,
            range_budget: RangeBudget::default(),
            double_equals: None,
            constants_with_point: Vec::new(),
            bare_conditions: false,
        }
    }

    /// The cursor at the offset `pos`.
    pub(crate) fn cur_at(&self, pos: usize) -> Cursor<'a> {
        let mut cur = self.cur;
        cur.pos = pos;
        cur
    }

    /// Whether the text is for Turbo PMAC.
    pub(crate) fn is_turbo(&self) -> bool {
        self.controller == Controller::Turbo
    }

    /// The highest variable number.
    pub(crate) fn last_variable(&self) -> u16 {
        if self.is_turbo() { 8191 } else { 1023 }
    }

    /// A variable's number, written as an integer.
    pub(crate) fn variable_number(&mut self) -> Parsed<u16> {
        self.cur.blanks();
        let start = self.cur.pos;
        let Some(number) = self.cur.integer() else {
            return self.cur.expected("a variable's number");
        };
        let at = self.cur.since(start);
        let last = self.last_variable();
        match u16::try_from(number) {
            Ok(number) if number <= last => Ok(number),
            _ => Err(self
                .beyond_controller(at, format!("there are variables 0 to {last}, not {number}"))),
        }
    }

    /// The error `PMAC-X1` for a number that is too large for the controller.
    pub(crate) fn beyond_controller(
        &self,
        at: TextRange,
        message: impl Into<MessageText>,
    ) -> ParseError {
        let help = if self.is_turbo() {
            "Turbo PMAC has no more than that"
        } else {
            "a program for Turbo PMAC needs --controller turbo"
        };
        ParseError { code: "PMAC-X1", at, message: message.into(), help: Some(help.into()) }
    }

    /// The kind of the variable that begins at the cursor, if one does: a letter, then a number or
    /// a parenthesis.
    pub(crate) fn variable_kind(&mut self) -> Option<Kind> {
        let kind = match self.cur.peek().to_ascii_uppercase() {
            b'I' => Kind::I,
            b'P' => Kind::P,
            b'Q' => Kind::Q,
            b'M' => Kind::M,
            b'L' => Kind::L,
            _ => return None,
        };
        let mut ahead = self.cur;
        ahead.pos += 1;
        ahead.crosses_lines = false;
        matches!(ahead.peek(), b'0'..=b'9' | b'(' | b'$').then_some(kind)
    }

    /// Records the use of a variable if it is an L-variable. Outside of PLCCs that is an error.
    pub(crate) fn uses(&mut self, kind: Kind, number: u16, at: TextRange) -> Parsed<()> {
        self.uses_range(kind, (number, 1, 1), at)
    }

    /// Records the use of `count` variables from `first` on, `step` apart, if they are L-variables.
    /// Outside of PLCCs that is an error.
    pub(crate) fn uses_range(
        &mut self,
        kind: Kind,
        (first, count, step): (u16, u16, u16),
        at: TextRange,
    ) -> Parsed<()> {
        if kind == Kind::L {
            match &mut self.l_used {
                Some(used) => used.push(UsedL { first, count, step, at }),
                None => {
                    let help = "use an M-variable, or make the program a PLCC";
                    return syntax_help(at, "L-variables are for PLCCs only", help);
                }
            }
        }
        Ok(())
    }

    /// An expression. It ends in front of the first character that can't be part of it.
    pub(crate) fn expression(&mut self) -> Parsed<Expr> {
        let start = self.ops.len();
        self.cur.blanks();
        let from = self.cur.pos;
        let value = self.shunt(false)?;
        if value {
            let at = self.cur.since(from);
            return syntax(at, "a comparison cannot be assigned to a variable");
        }
        Ok(self.since(start))
    }

    /// A condition in its parentheses.
    pub(crate) fn condition(&mut self) -> Parsed<Expr> {
        let start = self.ops.len();
        if self.cur.peek() != b'(' {
            return self.cur.expected("`(` and a condition");
        }
        let from = self.cur.pos;
        let value = self.shunt(true)?;
        if !value {
            let at = self.cur.since(from);
            let help = "compare it with something: (P1!=0)";
            return syntax_help(at, "a condition needs a comparator", help);
        }
        Ok(self.since(start))
    }

    /// The whole text as an expression or as a condition, which needs no parentheses around it. The
    /// second value says whether it is a condition.
    pub(crate) fn whole_text(&mut self) -> Parsed<(Expr, bool)> {
        self.bare_conditions = true;
        self.cur.crosses_lines = true;
        let start = self.ops.len();
        let condition = self.shunt(false)?;
        self.cur.blanks();
        if !self.cur.at_end() {
            return self.cur.expected_at_once("an operator");
        }
        Ok((self.since(start), condition))
    }

    /// The expression whose operations are those from `start` on.
    pub(crate) fn since(&self, start: usize) -> Expr {
        let at = TextRange::new(start, self.ops.len());
        Expr { start: at.start, len: at.end - at.start }
    }

    /// An expression in parentheses: the number of an indirect variable.
    pub(crate) fn index(&mut self) -> Parsed<Expr> {
        let start = self.ops.len();
        self.cur.blanks();
        let from = self.cur.pos;
        if self.shunt(true)? {
            return syntax(self.cur.since(from), "a comparison cannot be a variable's number");
        }
        Ok(self.since(start))
    }

    /// Reads operands and operators by the shunting-yard algorithm. With `closed` the text begins
    /// with a parenthesis, and reading ends after the one that closes it. Returns whether the result
    /// is a truth value.
    fn shunt(&mut self, closed: bool) -> Parsed<bool> {
        let mut stacks = Stacks { operators: Vec::new(), values: Vec::new(), depth: 0 };
        loop {
            while !self.operand(&mut stacks)? {}
            // Closing parentheses, then an operator or the end.
            loop {
                if self.cur.peek() == b')' && stacks.depth > 0 {
                    self.close(&mut stacks)?;
                    if closed && stacks.depth == 0 {
                        return Ok(stacks.values.pop().unwrap_or(false));
                    }
                    continue;
                }
                break;
            }
            self.cur.blanks();
            let start = self.cur.pos;
            match self.operator(stacks.depth > 0 || self.bare_conditions)? {
                Some(operator) => {
                    let at = self.cur.since(start);
                    while let Some(&(top, at)) = stacks.operators.last()
                        && top.precedence() >= operator.precedence()
                    {
                        stacks.operators.pop();
                        self.apply(top, at, &mut stacks)?;
                    }
                    stacks.operators.push((operator, at));
                }
                None if stacks.depth > 0 => return self.unclosed(&stacks),
                None => {
                    while let Some((top, at)) = stacks.operators.pop() {
                        self.apply(top, at, &mut stacks)?;
                    }
                    return Ok(stacks.values.pop().unwrap_or(false));
                }
            }
        }
    }

    /// The error for a parenthesis that is not closed.
    fn unclosed<T>(&mut self, stacks: &Stacks) -> Parsed<T> {
        let open = stacks.operators.iter().rev().find(|(what, _)| what.precedence() == 0);
        let error = self.cur.expected("an operator or `)`");
        match (open, error) {
            (Some(&(_, at)), Err(error)) if error.message.contains("missing") => {
                syntax_help(at, "this parenthesis is not closed", "add the `)`")
            }
            (_, error) => error,
        }
    }

    /// Reads the next part of an operand: a sign, an opening parenthesis, or a number or variable,
    /// which completes the operand. Returns whether it is complete.
    fn operand(&mut self, stacks: &mut Stacks) -> Parsed<bool> {
        let byte = self.cur.peek();
        let start = self.cur.pos;
        match byte {
            b'(' => {
                self.cur.pos += 1;
                return self.open_paren(PendingOperator::Paren, start, stacks);
            }
            b'-' => {
                self.cur.pos += 1;
                stacks.operators.push((PendingOperator::Neg, self.cur.since(start)));
                return Ok(false);
            }
            b'+' => {
                let at = TextRange::new(start, start + 1);
                return syntax_help(at, "there is no unary plus", "leave the `+` out");
            }
            b'0'..=b'9' | b'.' | b'$' => {
                let Some(number) = self.cur.number() else {
                    return self.cur.expected("a number");
                };
                let digit = |at| self.cur.byte_at(at).is_ascii_digit();
                if matches!(self.cur.byte(), b'e' | b'E')
                    && (digit(1) || self.cur.byte_at(1) == b'-' && digit(2))
                {
                    let at = TextRange::new(start, self.cur.next_word().end as usize);
                    return syntax_help(at, "numbers have no exponent", "write its digits out");
                }
                let written = TextRange::new(start, self.cur.pos);
                if self.l_used.is_some() && self.cur.text_at(written).contains('.') {
                    self.constants_with_point.push(self.ops.len());
                }
                self.ops.push(Op::Const(number));
                stacks.values.push(false);
                return Ok(true);
            }
            _ => {}
        }
        for &(name, func) in FUNCTIONS {
            if self.cur.starts_with(name) {
                let mut ahead = self.cur;
                ahead.pos += name.len();
                if ahead.eat(b'(') {
                    self.cur = ahead;
                    return self.open_paren(PendingOperator::Func(func), start, stacks);
                }
            }
        }
        let Some(kind) = self.variable_kind() else {
            let help = match (byte, self.cur.byte_at(1)) {
                (b'&', _) => "conditions are joined with AND",
                (b'|', _) => "conditions are joined with OR",
                (b'!', _) => "`!` is part of comparators: != !> !< !~",
                (b'P' | b'Q' | b'M' | b'I' | b'p' | b'q' | b'm' | b'i', b'[') => {
                    "the number of an indirect variable is in parentheses: P(P1+5)"
                }
                _ => return self.cur.expected("a value"),
            };
            return self
                .cur
                .expected("a value")
                .map_err(|error| ParseError { help: Some(help.into()), ..error });
        };
        self.cur.pos += 1;
        if self.cur.eat(b'(') {
            if kind == Kind::L {
                return syntax(self.cur.since(start), "an L-variable's number is a constant");
            }
            return self.open_paren(PendingOperator::Index(kind), start, stacks);
        }
        let number = self.variable_number()?;
        self.uses(kind, number, self.cur.since(start))?;
        self.ops.push(Op::Var(kind, number));
        stacks.values.push(false);
        Ok(true)
    }

    fn open_paren(
        &mut self,
        what: PendingOperator,
        start: usize,
        stacks: &mut Stacks,
    ) -> Parsed<bool> {
        stacks.depth += 1;
        let at = self.cur.since(start);
        if stacks.depth > MAX_NESTING {
            return syntax(at, "parentheses nest too deep: 256 levels at most");
        }
        stacks.operators.push((what, at));
        Ok(false)
    }

    /// Takes `)`, and writes all pending operators up to its `(`.
    fn close(&mut self, stacks: &mut Stacks) -> Parsed<()> {
        self.cur.pos += 1;
        stacks.depth -= 1;
        while let Some((top, at)) = stacks.operators.pop() {
            self.apply(top, at, stacks)?;
            if top.precedence() == 0 {
                break;
            }
        }
        Ok(())
    }

    /// Writes an operator whose operands are complete. They must be numbers or truth values as the
    /// operator needs them.
    fn apply(&mut self, what: PendingOperator, at: TextRange, stacks: &mut Stacks) -> Parsed<()> {
        let (op, operands, truth, wants) = match what {
            PendingOperator::Paren => return Ok(()),
            PendingOperator::Func(func) => (Op::Call(func), 1, false, false),
            PendingOperator::Index(kind) => (Op::Indirect(kind), 1, false, false),
            PendingOperator::Neg => (Op::Neg, 1, false, false),
            PendingOperator::Bin(bin) => (Op::Bin(bin), 2, false, false),
            PendingOperator::Cmp(cmp) => (Op::Cmp(cmp), 2, true, false),
            PendingOperator::Both => (Op::Both, 2, true, true),
            PendingOperator::Either => (Op::Either, 2, true, true),
        };
        for _ in 0..operands {
            match stacks.values.pop() {
                Some(truth) if truth == wants => {}
                _ if wants => {
                    let help = "compare both sides with something: (P1!=0)";
                    return syntax_help(at, "AND and OR join conditions", help);
                }
                _ => {
                    let help = "put each comparison on its own, joined with AND or OR";
                    return syntax_help(
                        at,
                        "a comparison has no value that an operator could use",
                        help,
                    );
                }
            }
        }
        stacks.values.push(truth);
        self.ops.push(op);
        Ok(())
    }

    /// Takes the operator that comes next, if one does. AND, OR and comparators are operators only
    /// where `inside` says that they are allowed: in parentheses.
    fn operator(&mut self, inside: bool) -> Parsed<Option<PendingOperator>> {
        let byte = self.cur.peek();
        let start = self.cur.pos;
        let next = self.cur.byte_at(1);
        let arithmetic = match byte {
            b'+' => Some(Bin::Add),
            b'-' => Some(Bin::Sub),
            b'*' => Some(Bin::Mul),
            b'/' => Some(Bin::Div),
            b'%' => Some(Bin::Mod),
            b'&' => Some(Bin::And),
            b'|' => Some(Bin::Or),
            b'^' => Some(Bin::Xor),
            _ => None,
        };
        if let Some(bin) = arithmetic {
            self.cur.pos += 1;
            return Ok(Some(PendingOperator::Bin(bin)));
        }
        if !inside {
            return Ok(None);
        }
        let negated = byte == b'!';
        if negated {
            self.cur.pos += 1;
            self.cur.blanks();
        }
        let cmp = match (self.cur.byte(), negated) {
            (b'=', false) => Cmp::Eq,
            (b'=', true) => Cmp::Ne,
            (b'>', false) => Cmp::Gt,
            (b'>', true) => Cmp::NotGt,
            (b'<', false) => Cmp::Lt,
            (b'<', true) => Cmp::NotLt,
            (b'~', false) => Cmp::Near,
            (b'~', true) => Cmp::NotNear,
            (_, true) => return self.cur.expected("`=`, `>`, `<` or `~` after `!`"),
            _ if self.cur.eat_word("AND") => return Ok(Some(PendingOperator::Both)),
            _ if self.cur.eat_word("OR") => return Ok(Some(PendingOperator::Either)),
            _ => return Ok(None),
        };
        self.cur.pos += 1;
        if matches!((byte, next), (b'<' | b'>' | b'=', b'=') | (b'<', b'>')) {
            let at = TextRange::new(start, start + 2);
            let (message, help) = match (byte, next) {
                (b'<', b'=') => ("`<=` is not a comparator", "less or equal is `!>`"),
                (b'>', b'=') => ("`>=` is not a comparator", "greater or equal is `!<`"),
                (b'<', _) => ("`<>` is not a comparator", "not equal is `!=`"),
                _ => ("`==` is not a comparator", "equal is `=`"),
            };
            return syntax_help(at, message, help);
        }
        Ok(Some(PendingOperator::Cmp(cmp)))
    }
}
