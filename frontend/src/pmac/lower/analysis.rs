//! Which statements integers compute, and what forces floating point on the others.
//!
//! A statement is integer when every step of it is one by its [shape](super::rangeanalysis). P, Q
//! and I hold doubles, so whether they hold integers is asked when the statement runs: it is
//! written twice, once for integers of 32 bits in all of them and once for anything else, where
//! that gains something. Sums, differences and comparisons gain nothing: doubles do these exactly
//! for such integers, without conversion.

use plcc_abi::pmac::Kind;

use super::rangeanalysis::Shape;
use crate::pmac::ast::{Bin, Func, Op};

/// Most variables that a statement asks about.
const MAX_ASKED: usize = 6;

/// What a variable that is asked about is taken for.
pub(crate) const ASKED: Shape = Shape::Int(i32::MIN as i64, i32::MAX as i64);

/// A variable.
pub(crate) type Name = (Kind, u16);

/// What forces floating point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Reason {
    /// A literal with a fraction, or beyond 2^53.
    Constant(f64),
    /// A variable of a floating-point or unknown format.
    Variable(Name),
    /// A variable whose number is computed.
    Indirect(Kind),
    /// An operator.
    Operator(Bin),
    /// A function.
    Function(Func),
    /// It asks about more variables than are worth it.
    Many,
}

/// What is known of an expression or condition.
#[derive(Clone, Debug)]
pub(crate) struct Analysis {
    /// The first thing that forces floating point; none when integers compute it.
    pub(crate) forced: Option<Reason>,
    /// The variables that must hold integers for that.
    pub(crate) asked: Vec<Name>,
    /// Whether integers are faster: a bit operator or remainder works on what is asked about.
    pub(crate) gains: bool,
}

/// Analyses steps. `shape` tells what is known of a variable's value.
pub(crate) fn analyse(ops: &[Op], mut shape: impl FnMut(Name) -> Shape) -> Analysis {
    let mut out = Analysis { forced: None, asked: Vec::new(), gains: false };
    // For each value its shape, and whether it hangs on what is asked about.
    let mut stack: Vec<(Shape, bool)> = Vec::new();
    for op in ops {
        let mut pop = || stack.pop().unwrap_or((Shape::FINITE, false));
        let (value, reason) = match *op {
            Op::Const(value) => ((Shape::constant(value), false), Reason::Constant(value)),
            Op::Var(kind, number) => {
                let name = (kind, number);
                let value = match shape(name) {
                    known @ Shape::Int(..) => (known, false),
                    _ if matches!(kind, Kind::P | Kind::Q | Kind::I) => {
                        if !out.asked.contains(&name) {
                            out.asked.push(name);
                        }
                        (ASKED, true)
                    }
                    unknown => (unknown, false),
                };
                (value, Reason::Variable(name))
            }
            Op::Indirect(kind) => {
                pop();
                ((Shape::FINITE, false), Reason::Indirect(kind))
            }
            Op::Neg => {
                let (value, asked) = pop();
                ((value.negated(), asked), Reason::Operator(Bin::Sub))
            }
            Op::Bin(bin) => {
                let ((right, b), (left, a)) = (pop(), pop());
                out.gains |= (a || b) && matches!(bin, Bin::And | Bin::Or | Bin::Xor | Bin::Mod);
                ((Shape::binary(bin, left, right), a || b), Reason::Operator(bin))
            }
            Op::Call(func) => {
                let (value, asked) = pop();
                let shape = match (func, value) {
                    (Func::Int, Shape::Int(..)) => value,
                    (Func::Abs, Shape::Int(low, high)) => Shape::magnitude(low, high),
                    _ => Shape::FUNCTION,
                };
                ((shape, asked), Reason::Function(func))
            }
            Op::Cmp(_) | Op::Both | Op::Either => {
                pop();
                pop();
                ((Shape::Truth, false), Reason::Many)
            }
        };
        if out.forced.is_none() && matches!(value.0, Shape::Real { .. }) {
            out.forced = Some(reason);
        }
        stack.push(value);
    }
    if out.forced.is_none() && out.gains && out.asked.len() > MAX_ASKED {
        out.forced = Some(Reason::Many);
    }
    out
}
