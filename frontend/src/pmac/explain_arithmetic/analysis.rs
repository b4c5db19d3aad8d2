//! Finds which statements are computed with integers, and for the others what forces floating
//! point.
//!
//! A statement is computed with integers if the result of each of its operations is an integer by
//! its [bounds](super::range_analysis). P-, Q- and I-variables hold doubles, so that is not known
//! of them. Where it pays, the compiler *speculates* that they hold integers of 32 bits: an
//! integrality check guards code with integers, and general code with doubles runs if a check
//! fails. This makes bit operators and remainders faster, but not sums, differences and
//! comparisons: doubles compute those exactly for such integers, without conversions.

use plcc_abi::pmac::{Definition, DirectAccess, Kind};

use super::range_analysis::Bounds;
use crate::pmac::ast::{Bin, Download, Func, Op};

/// A statement speculates on no more variables than this: each costs an integrality check.
const MAX_ASSUMED: usize = 6;

/// The bounds of a variable that is assumed to hold an integer.
pub(crate) const ASSUMED: Bounds = Bounds::Int(i32::MIN as i64, i32::MAX as i64);

/// A variable: its kind and its number.
pub(crate) type Name = (Kind, u16);

/// The bounds of a variable's value while the assumed definitions hold. `places` has for each
/// M-variable the place that is assumed.
pub(crate) fn bounds_of(
    download: &Download,
    places: &[Option<DirectAccess>],
    kind: Kind,
    number: u16,
) -> Bounds {
    match kind {
        Kind::M => match places.get(usize::from(number)) {
            Some(Some(DirectAccess::Word(_, _, field))) => Bounds::field(*field),
            Some(Some(DirectAccess::Star)) => Bounds::STAR,
            _ => Bounds::FINITE,
        },
        Kind::L => match download.l_defs.get(&number) {
            Some(Definition::X { field, .. } | Definition::Y { field, .. }) => {
                Bounds::field(*field)
            }
            _ => Bounds::Int(0, 0),
        },
        Kind::P | Kind::Q | Kind::I => Bounds::FINITE,
    }
}

/// What forces floating point on a statement.
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
    /// It would have to assume integers in more variables than [`MAX_ASSUMED`].
    Many,
}

/// What is known of an expression or condition.
#[derive(Clone, Debug)]
pub(crate) struct Analysis {
    /// The first thing that forces floating point; `None` if integers can compute all of it.
    pub(crate) forced: Option<Reason>,
    /// The variables that must hold integers so that integers can compute it.
    pub(crate) assumed: Vec<Name>,
    /// Whether integers are faster. They are if the operand of a bit operator or remainder depends
    /// on one of these variables.
    pub(crate) gains: bool,
}

/// Analyses the operations of an expression or condition, which are in postfix order. `bounds`
/// gives what is known of a variable's value.
pub(crate) fn analyse(ops: &[Op], mut bounds: impl FnMut(Name) -> Bounds) -> Analysis {
    let mut out = Analysis { forced: None, assumed: Vec::new(), gains: false };
    // For each value its bounds, and whether it depends on an assumed variable.
    let mut stack: Vec<(Bounds, bool)> = Vec::new();
    for op in ops {
        let mut pop = || stack.pop().unwrap_or((Bounds::FINITE, false));
        let (value, reason) = match *op {
            Op::Const(value) => ((Bounds::constant(value), false), Reason::Constant(value)),
            Op::Var(kind, number) => {
                let name = (kind, number);
                let value = match bounds(name) {
                    known @ Bounds::Int(..) => (known, false),
                    _ if matches!(kind, Kind::P | Kind::Q | Kind::I) => {
                        if !out.assumed.contains(&name) {
                            out.assumed.push(name);
                        }
                        (ASSUMED, true)
                    }
                    unknown => (unknown, false),
                };
                (value, Reason::Variable(name))
            }
            Op::Indirect(kind) => {
                pop();
                ((Bounds::FINITE, false), Reason::Indirect(kind))
            }
            Op::Neg => {
                let (value, assumed) = pop();
                ((value.negated(), assumed), Reason::Operator(Bin::Sub))
            }
            Op::Bin(bin) => {
                let ((right, b), (left, a)) = (pop(), pop());
                out.gains |= (a || b) && matches!(bin, Bin::And | Bin::Or | Bin::Xor | Bin::Mod);
                ((Bounds::binary(bin, left, right), a || b), Reason::Operator(bin))
            }
            Op::Call(func) => {
                let (value, assumed) = pop();
                let bounds = match (func, value) {
                    (Func::Int, Bounds::Int(..)) => value,
                    (Func::Abs, Bounds::Int(low, high)) => Bounds::magnitude(low, high),
                    _ => Bounds::FUNCTION,
                };
                ((bounds, assumed), Reason::Function(func))
            }
            Op::Cmp(_) | Op::Both | Op::Either => {
                pop();
                pop();
                // A truth value never forces floating point, so this reason is not used.
                ((Bounds::Truth, false), Reason::Many)
            }
        };
        if out.forced.is_none() && matches!(value.0, Bounds::Real { .. }) {
            out.forced = Some(reason);
        }
        stack.push(value);
    }
    if out.forced.is_none() && out.gains && out.assumed.len() > MAX_ASSUMED {
        out.forced = Some(Reason::Many);
    }
    out
}
