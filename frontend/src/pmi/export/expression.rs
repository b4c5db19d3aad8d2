//! Expressions, in postfix order, with the types that the language gives each result (PMI 2.3.3.7).

use plcc_abi::pmi::Type as PmiType;
use plcc_abi::pmi::arithmetic::{Binary, convert};
use plcc_iec::{Expression, Level, literal};

use super::Own;
use super::variables::Variables;
use crate::pmi::ast::{Op, SymbolId};

/// An expression with its type. A number in the source takes the type that is needed.
pub(super) enum Typed {
    Logical(Expression),
    Integer(Expression),
    Long(Expression),
    Number(i32),
}

impl Typed {
    fn of(ty: PmiType, expression: Expression) -> Self {
        match ty {
            PmiType::Logical => Self::Logical(expression),
            PmiType::Integer => Self::Integer(expression),
            PmiType::Long => Self::Long(expression),
        }
    }

    /// Whether it is not zero.
    pub(super) fn truth(self) -> Expression {
        match self {
            Self::Logical(it) => it,
            Self::Integer(it) | Self::Long(it) => {
                it.infix("<>", Level::Relation, Expression::name("0"))
            }
            Self::Number(0) => Expression::name("FALSE"),
            Self::Number(_) => Expression::name("TRUE"),
        }
    }

    /// As INTEGER.
    pub(super) fn integer(self) -> Expression {
        match self {
            Self::Logical(it) => it.call("BOOL_TO_INT("),
            Self::Integer(it) => it,
            Self::Long(it) => it.call("INTEGER_OF("),
            Self::Number(value) => literal(convert(value, PmiType::Integer).into()),
        }
    }

    /// As LONG.
    pub(super) fn long(self) -> Expression {
        match self {
            Self::Logical(it) => it.call("BOOL_TO_DINT("),
            Self::Integer(it) => it.call("INT_TO_DINT("),
            Self::Long(it) => it,
            Self::Number(value) => literal(value.into()),
        }
    }

    /// As a variable of a type takes it.
    pub(super) fn in_type(self, ty: PmiType) -> Expression {
        match ty {
            PmiType::Logical => self.truth(),
            PmiType::Integer => self.integer(),
            PmiType::Long => self.long(),
        }
    }

    fn is_long(&self) -> bool {
        match self {
            Self::Long(_) => true,
            Self::Number(value) => i16::try_from(*value).is_err(),
            Self::Logical(_) | Self::Integer(_) => false,
        }
    }
}

/// The lines that an expression needs in front of its statement: they compute the indices of arrays and stop the program where
/// one is outside.
pub(super) struct Indices<'a> {
    variables: &'a Variables<'a>,
    own: &'a Own,
    line: u32,
    pub(super) lines: Vec<String>,
    used: usize,
}

impl<'a> Indices<'a> {
    /// For the statement in a line of the source.
    pub(super) fn new(variables: &'a Variables<'a>, own: &'a Own, line: u32) -> Self {
        Self { variables, own, line, lines: vec![], used: 0 }
    }

    /// An element of an array at a computed index.
    pub(super) fn element(&mut self, id: SymbolId, index: Typed) -> Expression {
        let variable = self.own.indices.get(self.used).map_or("", String::as_str);
        self.used += 1;
        let symbol = self.variables.checked.symbol(id);
        let last = symbol.and_then(|symbol| symbol.elements).unwrap_or(1).saturating_sub(1);
        self.lines.push(format!("{variable} := {};", index.integer().into_text()));
        self.lines.push(format!("IF ({variable} < 0) OR ({variable} > {last}) THEN"));
        self.lines.push(format!("  {} := {};", self.own.stop, self.line));
        self.lines.push("  EXIT;".into());
        self.lines.push("END_IF;".into());
        Expression::name(format!("{}[{variable}]", self.variables.name(id)))
    }

    /// The value of an expression.
    pub(super) fn value(&mut self, ops: &[Op]) -> Typed {
        let mut stack: Vec<Typed> = vec![];
        let ty = |id: SymbolId| {
            self.variables.checked.symbol(id).map_or(PmiType::Logical, |symbol| symbol.ty)
        };
        for op in ops {
            let result = match *op {
                Op::Const(value) => Typed::Number(value),
                Op::Load(id) => Typed::of(ty(id), Expression::name(self.variables.name(id))),
                Op::LoadAt(id, index) => {
                    let element = format!("{}[{index}]", self.variables.name(id));
                    Typed::of(ty(id), Expression::name(element))
                }
                Op::Element(id) => {
                    let index = pop(&mut stack);
                    Typed::of(ty(id), self.element(id, index))
                }
                Op::Neg { long } => {
                    let operand = pop(&mut stack);
                    match (operand, long) {
                        (Typed::Number(value), _) => {
                            Typed::Number(plcc_abi::pmi::arithmetic::negate(value, long))
                        }
                        (operand, true) => Typed::Long(operand.long().call("LONG_NEG(")),
                        (operand, false) => Typed::Integer(operand.integer().call("INTEGER_NEG(")),
                    }
                }
                Op::Not => match pop(&mut stack) {
                    Typed::Integer(it) | Typed::Long(it) => {
                        Typed::Logical(it.infix("=", Level::Relation, Expression::name("0")))
                    }
                    other => Typed::Logical(other.truth().inverted()),
                },
                Op::Binary(op) => {
                    let right = pop(&mut stack);
                    let left = pop(&mut stack);
                    binary(op, left, right)
                }
            };
            stack.push(result);
        }
        pop(&mut stack)
    }
}

/// A checked expression has all its operands.
fn pop(stack: &mut Vec<Typed>) -> Typed {
    stack.pop().unwrap_or(Typed::Number(0))
}

fn binary(op: Binary, left: Typed, right: Typed) -> Typed {
    let integer = |function, left: Typed, right: Typed| {
        Typed::Integer(left.integer().call_with(function, right.integer()))
    };
    let long = |function, left: Typed, right: Typed| {
        Typed::Long(left.long().call_with(function, right.long()))
    };
    match op {
        Binary::Add { long: false } => integer("INTEGER_ADD(", left, right),
        Binary::Add { long: true } => long("LONG_ADD(", left, right),
        Binary::Sub { long: false } => integer("INTEGER_SUB(", left, right),
        Binary::Sub { long: true } => long("LONG_SUB(", left, right),
        Binary::Mul { wide: false } => integer("INTEGER_MUL(", left, right),
        Binary::Mul { wide: true } => {
            Typed::Long(left.integer().call_with("LONG_MUL(", right.integer()))
        }
        Binary::Div => Typed::Integer(left.long().call_with("INTEGER_DIV(", right.integer())),
        Binary::Rem => Typed::Integer(left.long().call_with("INTEGER_REM(", right.integer())),
        Binary::Eq => relation("=", left, right),
        Binary::Ne => relation("<>", left, right),
        Binary::Lt => relation("<", left, right),
        Binary::Le => relation("<=", left, right),
        Binary::Gt => relation(">", left, right),
        Binary::Ge => relation(">=", left, right),
        Binary::And => Typed::Logical(left.truth().infix("AND", Level::And, right.truth())),
        Binary::Or => Typed::Logical(left.truth().infix("OR", Level::Or, right.truth())),
    }
}

/// Both operands in the type of the larger one. That two LOGICALs are equal can be asked of them as they are.
fn relation(operator: &str, left: Typed, right: Typed) -> Typed {
    let (left, right) = match (left, right) {
        (Typed::Logical(left), Typed::Logical(right)) if matches!(operator, "=" | "<>") => {
            (left, right)
        }
        (left, right) if left.is_long() || right.is_long() => (left.long(), right.long()),
        (left, right) => (left.integer(), right.integer()),
    };
    Typed::Logical(left.infix(operator, Level::Relation, right))
}
