//! Checks the names and types of an expression and makes operations of it: works out the type, the
//! value if it is constant, and errors 42 and 43 (PMI 2.3.3.7).

use plcc_abi::pmi::{Type, arithmetic};
use plcc_diag::{Diagnostic, Span};

use crate::pmi::{
    analyse::{lookup::resolve, names::Names},
    ast::{Binary, Meaning, Op, Ops, SymbolId},
    read::{
        cursor::Cursor,
        diagnostic::{self, error},
        syntax::{Expression, Part, PartKind},
        token::{Kind, Token},
    },
};

/// An entry of the operand stack.
#[derive(Clone, Copy, Debug)]
struct Operand {
    /// `None` if an error made its type unknown.
    ty: Option<Type>,
    /// Its value, if it is made of constants alone.
    constant: Option<i32>,
    /// All 32 bits of its value, if it is a product of constants.
    product: Option<i32>,
    /// The index of its first operation in [`ExpressionCheck::ops`].
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

/// A checked expression.
pub(crate) struct CheckedExpression {
    pub(crate) ops: Ops,
    /// Its type; `None` if an error made it unknown.
    pub(crate) ty: Option<Type>,
    /// What kind of index it is, if it was checked as one.
    pub(crate) index: Index,
}

/// Checks one expression of a statement. It adds operations to `ops`.
pub(crate) struct ExpressionCheck<'p, 'c> {
    cursor: &'p Cursor<'c>,
    names: &'p mut Names,
    ops: &'p mut Vec<Op>,
    /// The operand stack.
    operands: Vec<Operand>,
    /// The arrays whose index is not over yet, the innermost last; `None` for one that is not
    /// known.
    arrays: Vec<Option<SymbolId>>,
    /// The error that is first in the text, of those found so far.
    problem: Option<Box<Diagnostic>>,
}

impl<'p, 'c> ExpressionCheck<'p, 'c> {
    /// A check of an expression of the statement at `cursor`.
    pub(crate) fn new(cursor: &'p Cursor<'c>, names: &'p mut Names, ops: &'p mut Vec<Op>) -> Self {
        Self { cursor, names, ops, operands: vec![], arrays: vec![], problem: None }
    }

    /// Checks an expression. `target` is the array of which it is the index, if it is that of an
    /// assigned element.
    ///
    /// # Errors
    /// The error that is first in the text.
    pub(crate) fn check(
        mut self,
        expression: &mut Expression,
        parts: &[Part],
        target: Option<SymbolId>,
    ) -> Result<CheckedExpression, Box<Diagnostic>> {
        let from = self.ops.len();
        self.arrays.extend(target.map(Some));
        let range = expression.parts.start as usize..expression.parts.end as usize;
        for Part { kind, token } in parts.get(range).unwrap_or(&[]).iter().copied() {
            match kind {
                PartKind::Operand => self.operand(token),
                PartKind::Array => self.array(token),
                PartKind::Element => {
                    let array = self.arrays.pop().flatten();
                    self.element(array, token, target.is_some() && self.arrays.is_empty());
                }
                PartKind::Unary => self.unary(token),
                PartKind::Binary => self.binary(token),
                PartKind::Missing => self.missing(token),
            }
        }
        if let Some(problem) = expression.error.take() {
            self.keep_first(*problem);
        }
        if let Some(problem) = self.problem {
            self.ops.truncate(from);
            return Err(problem);
        }
        let index = match self.operands.last() {
            Some(Operand { constant: Some(value), .. }) if target.is_some() => {
                self.ops.truncate(from);
                Index::At(*value as u32)
            }
            _ => Index::Computed,
        };
        let ty = self.operands.last().and_then(|operand| operand.ty);
        Ok(CheckedExpression { ops: from as u32..self.ops.len() as u32, ty, index })
    }

    /// Keeps an error, unless one is kept that is further in front.
    fn keep_first(&mut self, problem: Diagnostic) {
        match &self.problem {
            Some(first) if first.span.start <= problem.span.start => {}
            _ => self.problem = Some(Box::new(problem)),
        }
    }

    fn push(&mut self, token: Token, ty: Option<Type>, constant: Option<i32>, op: Op) {
        self.missing(token);
        if let Some(operand) = self.operands.last_mut() {
            (operand.ty, operand.constant) = (ty, constant);
        }
        self.ops.push(op);
    }

    /// An operand of unknown type, without an operation.
    fn missing(&mut self, at: Token) {
        let start = self.ops.len();
        self.operands.push(Operand { ty: None, constant: None, product: None, start, at });
    }

    /// A number, a variable, T or F.
    fn operand(&mut self, token: Token) {
        let (ty, value) = match (token.kind, self.cursor.slice(token)) {
            (Kind::Number(value), _) if value <= 32_767 => (Type::Integer, value as i32),
            (Kind::Number(value), _) => (Type::Long, value as i32),
            (_, "T") => (Type::Logical, 1),
            (_, "F") => (Type::Logical, 0),
            (_, name) => return self.variable(token, name),
        };
        self.push(token, Some(ty), Some(value), Op::Const(value));
    }

    fn variable(&mut self, token: Token, name: &str) {
        let id = self.resolve(token, name, false);
        let known = id.and_then(|id| Some((id, self.names.get(id)?)));
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
    }

    /// The name of an array in front of its index.
    fn array(&mut self, token: Token) {
        let name = self.cursor.slice(token);
        let array = if matches!(name, "T" | "F") {
            let what = format!("{name} is a constant, no array");
            let span = self.cursor.span_of(token);
            self.keep_first(error(35, span, what).help("remove the brackets"));
            None
        } else {
            self.resolve(token, name, true)
        };
        self.arrays.push(array);
    }

    /// The symbol of a name, `None` if there is none.
    fn resolve(&mut self, token: Token, name: &str, indexed: bool) -> Option<SymbolId> {
        resolve(self.names, name, self.cursor.span_of(token), indexed).unwrap_or_else(|problem| {
            self.keep_first(*problem);
            None
        })
    }

    /// Applies NOT or a negation to the last operand.
    fn unary(&mut self, at: Token) {
        let not = at.kind == Kind::Slash;
        let Some(operand) = self.operands.last_mut() else { return };
        operand.at = at;
        operand.product = None;
        let long = operand.ty == Some(Type::Long);
        if not {
            operand.ty = Some(Type::Logical);
            operand.constant = operand.constant.map(|value| i32::from(value == 0));
            self.ops.push(Op::Not);
        } else {
            operand.ty = operand.ty.map(|_| if long { Type::Long } else { Type::Integer });
            operand.constant = operand.constant.map(|value| arithmetic::negate(value, long));
            self.ops.push(Op::Neg { long });
        }
    }

    /// Applies a binary operator to the last two operands.
    fn binary(&mut self, at: Token) {
        let symbol = at.kind;
        let (Some(right), Some(left)) = (self.operands.pop(), self.operands.pop()) else { return };
        let long = left.ty == Some(Type::Long) || right.ty == Some(Type::Long);
        let span = self.cursor.span_of(at);
        let (op, ty) = match symbol {
            Kind::Plus => (Binary::Add { long }, if long { Type::Long } else { Type::Integer }),
            Kind::Minus => (Binary::Sub { long }, if long { Type::Long } else { Type::Integer }),
            Kind::Star => {
                if long {
                    self.keep_first(
                        error(42, span, "a LONG cannot be multiplied")
                            .help("copy it to an INTEGER first"),
                    );
                }
                (Binary::Mul { wide: false }, Type::Integer)
            }
            Kind::Slash | Kind::Percent => {
                if right.ty == Some(Type::Long) {
                    self.keep_first(
                        error(42, span, "a LONG cannot be a divisor")
                            .help("copy it to an INTEGER first"),
                    );
                }
                // A product that is divided keeps all its 32 bits.
                if let Some(Op::Binary(Binary::Mul { wide })) =
                    right.start.checked_sub(1).and_then(|last| self.ops.get_mut(last))
                {
                    *wide = true;
                }
                (if symbol == Kind::Slash { Binary::Div } else { Binary::Rem }, Type::Integer)
            }
            Kind::Eq => (Binary::Eq, Type::Logical),
            Kind::Ne => (Binary::Ne, Type::Logical),
            Kind::Lt => (Binary::Lt, Type::Logical),
            Kind::Le => (Binary::Le, Type::Logical),
            Kind::Gt => (Binary::Gt, Type::Logical),
            Kind::Ge => (Binary::Ge, Type::Logical),
            Kind::And => (Binary::And, Type::Logical),
            _ => (Binary::Or, Type::Logical),
        };
        self.ops.push(Op::Binary(op));
        let dividend = matches!(op, Binary::Div | Binary::Rem).then_some(left.product).flatten();
        let both = dividend.or(left.constant).zip(right.constant);
        let constant = both.map(|(a, b)| arithmetic::binary(op, a, b));
        let product = match op {
            Binary::Mul { .. } => {
                both.map(|(a, b)| arithmetic::binary(Binary::Mul { wide: true }, a, b))
            }
            _ => None,
        };
        let known = left.ty.is_some() && right.ty.is_some();
        // If an operand's type is unknown, so is the result's, unless it is LOGICAL in any case.
        let ty = (known || ty == Type::Logical).then_some(ty);
        let Operand { start, at, .. } = left;
        self.operands.push(Operand { ty, constant, product, start, at });
    }

    /// Closes an index at `close`. On the operand stack the element of `array` takes the index's
    /// place, unless it is the element that a statement assigns (`target`).
    fn element(&mut self, array: Option<SymbolId>, close: Token, target: bool) {
        let Some(index) = self.operands.last().copied() else { return };
        let span = self.cursor.span_of(index.at).to(self.cursor.span_of(close));
        let span = Span { end: close.start.max(span.start), ..span };
        if index.ty == Some(Type::Long) {
            self.keep_first(
                error(43, span, "the index is a LONG")
                    .help("an index is an INTEGER or a LOGICAL; copy it to an INTEGER first"),
            );
        }
        let symbol = array.and_then(|id| self.names.get(id));
        let elements = symbol.and_then(|symbol| symbol.elements);
        if let (Some(value), Some(elements), Some(symbol)) = (index.constant, elements, symbol)
            && u32::try_from(value).map_or(true, |value| value >= elements)
            && index.ty != Some(Type::Long)
        {
            let problem = Diagnostic::error(
                diagnostic::OUT_OF_ARRAY,
                span,
                format!("{} has no element {value}", symbol.name),
            )
            .help(format!("its elements are 0 to {}", elements.saturating_sub(1)));
            self.keep_first(problem);
        }
        if target {
            return;
        }
        let symbol = array.and_then(|id| self.names.get(id));
        let (ty, values) = match symbol {
            Some(symbol) => (
                Some(symbol.ty),
                match &symbol.meaning {
                    Meaning::Constant(values) => Some(values),
                    _ => None,
                },
            ),
            None => (None, None),
        };
        let at = index.constant.and_then(|value| usize::try_from(value).ok());
        let constant = at.and_then(|at| values.and_then(|values| values.get(at).copied()));
        let op = match (array, constant, index.constant) {
            (_, Some(value), _) => Some(Op::Const(value)),
            (Some(id), None, Some(value)) => Some(Op::LoadAt(id, value as u32)),
            _ => None,
        };
        match (op, array) {
            (Some(op), _) => {
                self.ops.truncate(index.start);
                self.ops.push(op);
            }
            (None, Some(id)) => self.ops.push(Op::Element(id)),
            (None, None) => {}
        }
        self.operands.pop();
        let Operand { start, at, .. } = index;
        self.operands.push(Operand { ty, constant, product: None, start, at });
    }
}
