//! Expressions in floating point, in postfix order, and their values: for on-line commands that are
//! executed at load, for expressions outside of programs, and for statements that general code has
//! executed by the host ([`Statement`](super::Statement)). The statement interpreter has its own
//! evaluation, since it has to tell when others are wrong.
//!
//! | source | operations |
//! | --- | --- |
//! | `P1+P2*3` | `Var(P, 1)`, `Var(P, 2)`, `Const(3)`, `Bin(Mul)`, `Bin(Add)` |

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use super::arithmetic;
use super::fixed;
use super::tables::Kind;

/// A mathematical function.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Func {
    /// Sine.
    Sin,
    /// Cosine.
    Cos,
    /// Tangent.
    Tan,
    /// Inverse sine.
    Asin,
    /// Inverse cosine.
    Acos,
    /// Inverse tangent.
    Atan,
    /// Angle in all four quadrants whose sine is the argument and whose cosine is Q0.
    Atan2,
    /// Square root.
    Sqrt,
    /// Natural logarithm.
    Ln,
    /// Exponential.
    Exp,
    /// Absolute value.
    Abs,
    /// The largest integer that is not above the argument.
    Int,
}

/// A comparator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Cmp {
    /// `=`
    Eq,
    /// `!=`
    Ne,
    /// `>`
    Gt,
    /// `!>`: less or equal.
    NotGt,
    /// `<`
    Lt,
    /// `!<`: greater or equal.
    NotLt,
    /// `~`: the two differ by less than one.
    Near,
    /// `!~`: the two differ by one or more.
    NotNear,
}

/// An operation on two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Bin {
    /// `+`
    Add,
    /// `-`
    Sub,
    /// `*`
    Mul,
    /// `/`
    Div,
    /// `%`
    Mod,
    /// `&`
    And,
    /// `|`
    Or,
    /// `^`
    Xor,
}

/// One operation of an expression or condition in postfix order. It takes its operands from a
/// stack and puts its result there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Op {
    /// A literal.
    Const(f64),
    /// A variable's value.
    Var(Kind, u16),
    /// The value of the variable whose number is on top of the stack: `P(…)`.
    Indirect(Kind),
    /// Unary minus.
    Neg,
    /// An operator on two numbers.
    Bin(Bin),
    /// A function of the number on top of the stack.
    Call(Func),
    /// A comparison of two numbers, which gives a truth value.
    Cmp(Cmp),
    /// AND of two truth values.
    Both,
    /// OR of two truth values.
    Either,
}

/// What an operator gives for two numbers. The remainder and bit operators have a shortcut for
/// integers.
#[inline]
pub fn binary(op: Bin, a: f64, b: f64) -> f64 {
    match op {
        Bin::Add => a + b,
        Bin::Sub => a - b,
        Bin::Mul => a * b,
        Bin::Div => arithmetic::div(a, b),
        Bin::Mod | Bin::And | Bin::Or | Bin::Xor => {
            match (arithmetic::whole(a), arithmetic::whole(b)) {
                (Some(i), Some(j)) => f64::from(match op {
                    Bin::And => i & j,
                    Bin::Or => i | j,
                    Bin::Xor => i ^ j,
                    _ if j > 0 => i.rem_euclid(j),
                    Bin::Add | Bin::Sub | Bin::Mul | Bin::Div | Bin::Mod => {
                        return by_fixed_point(op, a, b);
                    }
                }),
                _ => by_fixed_point(op, a, b),
            }
        }
    }
}

/// A remainder or bit operator for any numbers, computed in fixed point.
#[cold]
fn by_fixed_point(op: Bin, a: f64, b: f64) -> f64 {
    match op {
        Bin::And => arithmetic::and(a, b),
        Bin::Or => arithmetic::or(a, b),
        Bin::Xor => arithmetic::xor(a, b),
        Bin::Add | Bin::Sub | Bin::Mul | Bin::Div | Bin::Mod => arithmetic::modulo(a, b),
    }
}

/// What a function gives. `cosine` is Q0, which ATAN2 alone reads; angles are in `radians` where
/// I15 is not 0, else in degrees.
pub fn function(func: Func, x: f64, cosine: f64, radians: bool) -> f64 {
    match func {
        Func::Sin => arithmetic::sin(x, radians),
        Func::Cos => arithmetic::cos(x, radians),
        Func::Tan => arithmetic::tan(x, radians),
        Func::Asin => arithmetic::asin(x, radians),
        Func::Acos => arithmetic::acos(x, radians),
        Func::Atan => arithmetic::atan(x, radians),
        Func::Atan2 => arithmetic::atan2(x, cosine, radians),
        Func::Sqrt => arithmetic::sqrt(x),
        Func::Ln => arithmetic::ln(x),
        Func::Exp => arithmetic::exp(x),
        Func::Abs => arithmetic::abs(x),
        Func::Int => arithmetic::int(x),
    }
}

/// Whether a comparator holds. NaN equals nothing, and is neither above nor below anything.
#[inline]
pub fn compare(cmp: Cmp, a: f64, b: f64) -> bool {
    match cmp {
        Cmp::Eq => a == b,
        Cmp::Ne => !matches!(a.partial_cmp(&b), Some(core::cmp::Ordering::Equal)),
        Cmp::Gt => a > b,
        Cmp::NotGt => !matches!(a.partial_cmp(&b), Some(core::cmp::Ordering::Greater)),
        Cmp::Lt => a < b,
        Cmp::NotLt => !matches!(a.partial_cmp(&b), Some(core::cmp::Ordering::Less)),
        Cmp::Near => arithmetic::near(a, b),
        Cmp::NotNear => !arithmetic::near(a, b),
    }
}

/// The value of an expression, or 1 or 0 for a condition that is true or false. `stack` is emptied
/// first; it is passed so that no call allocates. `read` gives the value of a variable by its kind
/// and number.
pub fn evaluate(
    ops: &[Op],
    stack: &mut Vec<f64>,
    radians: bool,
    read: &mut impl FnMut(Kind, u32) -> f64,
) -> f64 {
    stack.clear();
    for op in ops {
        let value = match *op {
            Op::Const(value) => value,
            Op::Var(kind, number) => read(kind, u32::from(number)),
            Op::Indirect(kind) => {
                let index = stack.pop().unwrap_or(0.0);
                read(kind, fixed::index(index, u32::MAX))
            }
            Op::Neg => -stack.pop().unwrap_or(0.0),
            Op::Call(func) => {
                let x = stack.pop().unwrap_or(0.0);
                let cosine = if func == Func::Atan2 { read(Kind::Q, 0) } else { 0.0 };
                function(func, x, cosine, radians)
            }
            Op::Bin(bin) => {
                let b = stack.pop().unwrap_or(0.0);
                binary(bin, stack.pop().unwrap_or(0.0), b)
            }
            Op::Cmp(cmp) => {
                let b = stack.pop().unwrap_or(0.0);
                f64::from(u8::from(compare(cmp, stack.pop().unwrap_or(0.0), b)))
            }
            Op::Both | Op::Either => {
                let b = stack.pop().unwrap_or(0.0) != 0.0;
                let a = stack.pop().unwrap_or(0.0) != 0.0;
                f64::from(u8::from(if matches!(op, Op::Both) { a && b } else { a || b }))
            }
        };
        stack.push(value);
    }
    stack.pop().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shortcuts_for_integers_give_what_fixed_point_gives() {
        let limit = (1i64 << 39) as f64;
        let edges = [0.0, 1.0, 2.0, 7.0, 255.0, 8_388_607.0, limit - 1.0, limit, limit + 1.0, 0.5];
        let all: Vec<f64> = edges.iter().flat_map(|v| [*v, -v]).collect();
        for &a in &all {
            for &b in &all {
                for op in [Bin::And, Bin::Or, Bin::Xor, Bin::Mod] {
                    assert_eq!(binary(op, a, b), by_fixed_point(op, a, b), "{a} {op:?} {b}");
                }
            }
        }
    }
}
