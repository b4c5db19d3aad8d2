//! Expressions and conditions. Fields are whole numbers, all else is floating point; a comparison of whole numbers needs no floating point.

use plcc_abi::pmac::Kind;
use plcc_iec::{Expression, Level, literal};

use super::Writer;
use crate::pmac::ast::{Bin, Cmp, Expr, Func, Op};

/// An expression with its kind.
#[derive(Clone, Debug)]
pub(super) enum Typed {
    Whole(Expression),
    /// A P-, Q- or I-variable, which is finite.
    Variable(Expression),
    Float(Expression),
    Number(f64),
    Truth(Expression),
}

impl Typed {
    fn float(self) -> Expression {
        match self {
            Self::Whole(it) => it.call("DINT_TO_LREAL("),
            Self::Variable(it) | Self::Float(it) | Self::Truth(it) => it,
            Self::Number(value) => operand(value),
        }
    }

    fn whole(&self) -> Option<Expression> {
        match self {
            Self::Whole(it) => Some(it.clone()),
            Self::Number(value) if *value == f64::from(*value as i32) => {
                Some(literal((*value as i32).into()))
            }
            _ => None,
        }
    }

    /// As a number that can be stored.
    pub(super) fn finite(self) -> Expression {
        match self {
            Self::Float(it) => it.call("FLOAT_FINITE("),
            other => other.float(),
        }
    }

    /// A number of the source, or the text of an expression in floating point.
    pub(super) fn number(self) -> Result<f64, String> {
        match self {
            Self::Number(value) => Ok(value),
            other => Err(other.float().into_text()),
        }
    }

    /// As a condition.
    pub(super) fn truth(self) -> Expression {
        match self {
            Self::Truth(it) => it,
            other => other.float().infix("<>", Level::Relation, Expression::name("0.0")),
        }
    }
}

/// A number as the first value of an LREAL.
pub(super) fn real(value: f64) -> Expression {
    written("", value)
}

/// What a literal of LREAL begins with.
const TYPED: &str = "LREAL#";

/// A number in an expression. Compilers may take a literal for a REAL of 32 bits, where nothing beside it has another type (IEC 61131-3,
/// table 5): the type is written where 32 bits do not hold the number.
pub(super) fn operand(value: f64) -> Expression {
    let is_short = value == 0.0 || (SMALLEST..=LARGEST).contains(&value.abs());
    let is_real = is_short && f64::from(value as f32) == value;
    written(if is_real { "" } else { TYPED }, value)
}

/// Two operands in floating point. Of two numbers one has its type, so that what is computed has it.
fn operands(left: Typed, right: Typed) -> (Expression, Expression) {
    match (left, right) {
        (Typed::Number(left), Typed::Number(right)) => (written(TYPED, left), operand(right)),
        (left, right) => (left.float(), right.float()),
    }
}

/// Between these are the numbers, without their sign, that all compilers read.
const SMALLEST: f64 = 1e-37;
const LARGEST: f64 = 1e37;

/// A number, with what its literal begins with. Not all compilers read very large and very small ones, which are multiplied from others: by
/// powers of two, and so exactly.
fn written(begin: &str, value: f64) -> Expression {
    const POWER: f64 = 18_446_744_073_709_551_616.0;
    let (mut magnitude, mut times, mut over) = (value.abs(), 0, 0);
    while magnitude > LARGEST {
        (magnitude, times) = (magnitude / POWER, times + 1);
    }
    while magnitude < SMALLEST && magnitude > 0.0 {
        (magnitude, over) = (magnitude * POWER, over + 1);
    }
    let text = format!("{magnitude:?}");
    let text = match text.split_once('e') {
        Some((mantissa, exponent)) if mantissa.contains('.') => format!("{mantissa}E{exponent}"),
        Some((mantissa, exponent)) => format!("{mantissa}.0E{exponent}"),
        None => text,
    };
    let mut number = Expression::name(format!("{begin}{text}"));
    for (operator, count) in [("*", times), ("/", over)] {
        for _ in 0..count {
            let power = Expression::name("18446744073709551616.0");
            number = number.infix(operator, Level::Product, power);
        }
    }
    if value < 0.0 { number.negative() } else { number }
}

fn pop(stack: &mut Vec<Typed>) -> Typed {
    stack.pop().unwrap_or(Typed::Number(0.0))
}

impl Writer<'_> {
    pub(super) fn value(&self, expr: Expr) -> Typed {
        let mut stack: Vec<Typed> = vec![];
        for op in self.download.ops(expr) {
            let result = match *op {
                Op::Const(value) => Typed::Number(value),
                Op::Var(kind @ (Kind::M | Kind::L), number) => match self.words.get(kind, number) {
                    Some(variable) => Typed::Whole(variable.read()),
                    None => Typed::Number(0.0),
                },
                Op::Var(kind, number) => Typed::Variable(Expression::name(self.name(kind, number))),
                // Refused before.
                Op::Indirect(_) => pop(&mut stack),
                Op::Neg => match pop(&mut stack) {
                    Typed::Number(value) => Typed::Number(-value),
                    other => Typed::Float(other.float().negative()),
                },
                Op::Bin(op) => {
                    let (right, left) = (pop(&mut stack), pop(&mut stack));
                    binary(op, left, right)
                }
                Op::Call(function) => {
                    let function = match function {
                        Func::Abs => "FLOAT_ABS(",
                        Func::Int => "FLOAT_FLOOR(",
                        _ => "FLOAT_SQRT(",
                    };
                    Typed::Variable(pop(&mut stack).float().call(function))
                }
                Op::Cmp(cmp) => {
                    let (right, left) = (pop(&mut stack), pop(&mut stack));
                    Typed::Truth(compare(cmp, &left, &right))
                }
                Op::Both | Op::Either => {
                    let (right, left) = (pop(&mut stack).truth(), pop(&mut stack).truth());
                    let (operator, level) =
                        if *op == Op::Both { ("AND", Level::And) } else { ("OR", Level::Or) };
                    Typed::Truth(left.infix(operator, level, right))
                }
            };
            stack.push(result);
        }
        pop(&mut stack)
    }
}

fn binary(op: Bin, left: Typed, right: Typed) -> Typed {
    let (left, right) = operands(left, right);
    Typed::Float(match op {
        Bin::Add => left.infix("+", Level::Sum, right),
        Bin::Sub => left.infix("-", Level::Sum, right),
        Bin::Mul => left.infix("*", Level::Product, right),
        Bin::Div => left.call_with("FLOAT_DIV(", right),
        Bin::Mod => left.call_with("FLOAT_MOD(", right),
        Bin::And => left.call_with("FLOAT_AND(", right),
        Bin::Or => left.call_with("FLOAT_OR(", right),
        Bin::Xor => left.call_with("FLOAT_XOR(", right),
    })
}

/// Those that begin with `!` are the negations of the others, also for what is not a number.
fn compare(cmp: Cmp, left: &Typed, right: &Typed) -> Expression {
    let whole = left.whole().zip(right.whole());
    let is_whole = whole.is_some();
    let (left, right) = whole.unwrap_or_else(|| operands(left.clone(), right.clone()));
    let relation = |operator: &str| left.clone().infix(operator, Level::Relation, right.clone());
    let near = || match is_whole {
        true => relation("="),
        false => {
            let apart = left.clone().infix("-", Level::Sum, right.clone()).call("FLOAT_ABS(");
            apart.infix("<", Level::Relation, Expression::name("1.0"))
        }
    };
    match cmp {
        Cmp::Eq => relation("="),
        Cmp::Ne => relation("<>"),
        Cmp::Gt => relation(">"),
        Cmp::Lt => relation("<"),
        Cmp::NotGt if is_whole => relation("<="),
        Cmp::NotLt if is_whole => relation(">="),
        Cmp::NotGt => relation(">").inverted(),
        Cmp::NotLt => relation("<").inverted(),
        Cmp::Near => near(),
        Cmp::NotNear => near().inverted(),
    }
}
