//! Generates random statements and conditions of PMAC, many in a program, and computes what they must
//! give.
//!
//! A statement is a tree that can be written as text and can be computed. It is computed in plain
//! floating point, as docs/pmac.md says, and without any part of the compiler, so that it is a second
//! reference beside the statement interpreter.

mod generate;
mod oracle;
mod values;

pub use generate::{Kinds, program};
pub use oracle::Machine;
pub use values::fill;

use std::fmt::Write as _;

use plcc_abi::pmac::{Definition, Kind};

/// An operator on two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

impl Bin {
    const ALL: [Self; 8] =
        [Self::Add, Self::Sub, Self::Mul, Self::Div, Self::Mod, Self::And, Self::Or, Self::Xor];

    fn sign(self) -> char {
        match self {
            Self::Add => '+',
            Self::Sub => '-',
            Self::Mul => '*',
            Self::Div => '/',
            Self::Mod => '%',
            Self::And => '&',
            Self::Or => '|',
            Self::Xor => '^',
        }
    }

    /// Whether it has the precedence of `*`, not that of `+`.
    fn binds_tight(self) -> bool {
        matches!(self, Self::Mul | Self::Div | Self::Mod | Self::And)
    }
}

/// A comparator: whether it is negated, and which.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cmp {
    /// With `!` in front.
    pub negated: bool,
    /// `=`, `>`, `<` or `~`.
    pub sign: char,
}

/// An expression.
#[derive(Clone, Debug, PartialEq)]
pub enum Expr {
    /// A literal as it is written.
    Number(String),
    /// A variable.
    Var(Kind, u32),
    /// A variable whose number is computed.
    Indirect(Kind, Box<Expr>),
    /// Unary minus.
    Neg(Box<Expr>),
    /// An operator.
    Bin(Bin, Box<Expr>, Box<Expr>),
    /// A function by its name.
    Call(&'static str, Box<Expr>),
}

/// A condition.
#[derive(Clone, Debug, PartialEq)]
pub enum Condition {
    /// A comparison.
    Cmp(Cmp, Expr, Expr),
    /// Both hold.
    And(Box<Condition>, Box<Condition>),
    /// One holds.
    Or(Box<Condition>, Box<Condition>),
}

/// A statement.
#[derive(Clone, Debug, PartialEq)]
pub enum Statement {
    /// A variable, the operator of `&=` and its kind, and the value.
    Assign(Kind, u32, Option<Bin>, Expr),
    /// The number of the variable is computed.
    Indirect(Kind, Expr, Expr),
    /// So many variables from one on.
    Range(Kind, u32, u32, Expr),
    /// Leaves 1 or 2 in a P-variable.
    If(Condition, u32),
}

/// A program: definitions and statements.
#[derive(Clone, Debug, Default)]
pub struct Statements {
    /// A PLCC, where L-variables may stand.
    pub compiled: bool,
    /// M-variables with their definitions.
    pub m: Vec<(u32, Definition)>,
    /// L-variables with theirs.
    pub l: Vec<(u32, Definition)>,
    /// Its statements.
    pub all: Vec<Statement>,
}

impl Expr {
    fn write(&self, out: &mut String) {
        match self {
            Self::Number(text) => out.push_str(text),
            Self::Var(kind, number) => {
                let _ = write!(out, "{}{number}", letter(*kind));
            }
            Self::Indirect(kind, index) => {
                let _ = write!(out, "{}(", letter(*kind));
                index.write(out);
                out.push(')');
            }
            Self::Neg(value) => {
                out.push('-');
                value.operand(matches!(**value, Self::Bin(..)), out);
            }
            Self::Bin(bin, left, right) => {
                let looser = |side: &Self, right: bool| match side {
                    Self::Bin(other, ..) if other.binds_tight() == bin.binds_tight() => right,
                    Self::Bin(other, ..) => bin.binds_tight() && !other.binds_tight(),
                    _ => false,
                };
                left.operand(looser(left, false), out);
                out.push(bin.sign());
                right.operand(looser(right, true), out);
            }
            Self::Call(name, value) => {
                let _ = write!(out, "{name}(");
                value.write(out);
                out.push(')');
            }
        }
    }

    fn operand(&self, parentheses: bool, out: &mut String) {
        if parentheses {
            out.push('(');
        }
        self.write(out);
        if parentheses {
            out.push(')');
        }
    }
}

impl std::fmt::Display for Expr {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut out = String::new();
        self.write(&mut out);
        f.write_str(&out)
    }
}

impl std::fmt::Display for Condition {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Cmp(cmp, left, right) => {
                let not = if cmp.negated { "!" } else { "" };
                write!(f, "{left}{not}{}{right}", cmp.sign)
            }
            // Any nesting is written out.
            Self::And(a, b) => write!(f, "({a}) AND ({b})"),
            Self::Or(a, b) => write!(f, "({a}) OR ({b})"),
        }
    }
}

impl std::fmt::Display for Statement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Assign(kind, number, bin, value) => {
                let sign = bin.map(|bin| bin.sign().to_string()).unwrap_or_default();
                write!(f, "{}{number}{sign}={value}", letter(*kind))
            }
            Self::Indirect(kind, index, value) => write!(f, "{}({index})={value}", letter(*kind)),
            Self::Range(kind, first, count, value) => {
                write!(f, "{}{first}..{}={value}", letter(*kind), first + count - 1)
            }
            Self::If(condition, number) => {
                write!(f, "IF({condition}) P{number}=1 ELSE P{number}=2 ENDIF")
            }
        }
    }
}

impl std::fmt::Display for Statements {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "I5=3")?;
        for (letter, list) in [('M', &self.m), ('L', &self.l)] {
            for (number, definition) in list {
                writeln!(f, "{letter}{number}->{}", Defined(*definition))?;
            }
        }
        writeln!(f, "OPEN PLC{} 1 CLEAR", if self.compiled { "C" } else { "" })?;
        for statement in &self.all {
            writeln!(f, "{statement}")?;
        }
        writeln!(f, "CLOSE")
    }
}

/// A definition as it is written.
struct Defined(Definition);

impl std::fmt::Display for Defined {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (space, address, field) = match self.0 {
            Definition::X { address, field } => ('X', address, field),
            Definition::Y { address, field } => ('Y', address, field),
            Definition::D { address } => return write!(f, "D:${address:X}"),
            Definition::Dp { address } => return write!(f, "DP:${address:X}"),
            Definition::L { address } => return write!(f, "L:${address:X}"),
            Definition::F { address } => return write!(f, "F:${address:X}"),
            Definition::Star | Definition::Tw { .. } => return write!(f, "*"),
        };
        write!(f, "{space}:${address:X},{},{},{:?}", field.offset, field.width, field.format)
    }
}

fn letter(kind: Kind) -> char {
    match kind {
        Kind::I => 'I',
        Kind::P => 'P',
        Kind::Q => 'Q',
        Kind::M => 'M',
        Kind::L => 'L',
    }
}
