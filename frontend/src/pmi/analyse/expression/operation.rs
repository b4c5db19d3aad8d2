//! Applies an operator or an index to its operands: adds the operation, and works out the type, the
//! value if it is constant, and errors 42 and 43 (PMI 2.3.3.7).

use plcc_abi::pmi::{Type, arithmetic};
use plcc_diag::{Diagnostic, Span};

use super::{Operand, Parser, Waiting};
use crate::pmi::{
    ast::{Binary, Meaning, Op, SymbolId},
    read::{
        diagnostic::{self, error},
        token::{Kind, Token},
    },
};

impl Parser<'_, '_> {
    /// Applies an operator from the operator stack.
    pub(super) fn apply(&mut self, waiting: Waiting) {
        match waiting {
            Waiting::Unary { not, at } => self.unary(not, at),
            Waiting::Binary { symbol, at } => self.binary(symbol, at),
            Waiting::Paren { .. } | Waiting::Bracket { .. } => {}
        }
    }

    /// Applies NOT (`not`) or a negation to the last operand.
    fn unary(&mut self, not: bool, at: Token) {
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
    fn binary(&mut self, symbol: Kind, at: Token) {
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
    pub(super) fn element(&mut self, array: Option<SymbolId>, close: Token, target: bool) {
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
