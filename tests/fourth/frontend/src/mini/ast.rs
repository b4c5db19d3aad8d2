//! A checked program: variables and steps, without any tree.

use plcc_abi::mini::Symbol;
use plcc_diag::Span;

/// A program.
#[derive(Clone, Debug, Default)]
pub(super) struct Code {
    pub(super) symbols: Vec<Symbol>,
    pub(super) steps: Vec<Step>,
}

/// A statement.
#[derive(Clone, Debug)]
pub(super) struct Step {
    pub(super) action: Action,
    pub(super) span: Span,
    pub(super) line: u32,
}

/// What a statement does. Variables are named by their indices.
#[derive(Clone, Debug)]
pub(super) enum Action {
    Assign { to: usize, value: Vec<Term> },
    /// Goes on behind the END at the index `otherwise` if the condition is 0.
    If { condition: Vec<Term>, otherwise: usize },
    End,
}

/// A term of an expression: what is done with it, to what stands before it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Term {
    pub(super) op: Op,
    pub(super) not: bool,
    pub(super) operand: Operand,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Op {
    Add,
    Subtract,
    And,
    Or,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Operand {
    Number(i32),
    Variable(usize),
}

/// The value of an expression. `read` gives the value of a variable.
pub(super) fn evaluate(terms: &[Term], mut read: impl FnMut(usize) -> i32) -> i32 {
    terms.iter().fold(0, |before, term| {
        let value = match term.operand {
            Operand::Number(number) => number,
            Operand::Variable(index) => read(index),
        };
        let value = if term.not { i32::from(value == 0) } else { value };
        match term.op {
            Op::Add => before.wrapping_add(value),
            Op::Subtract => before.wrapping_sub(value),
            Op::And => i32::from(before != 0 && value != 0),
            Op::Or => i32::from(before != 0 || value != 0),
        }
    })
}
