//! A checked download: flat code, nothing nested.
//!
//! Expressions and conditions stand in postfix order in one row for the whole download; a buffer
//! is a row of statements whose branches are indices into it. So nothing here needs recursion,
//! however long or deep the source was.

use plcc_abi::pmac::{Define, Definition, Kind, PlcOp, Space, Text};

use super::origin::{At, Origins};
use crate::common::Controller;

/// A mathematical function.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Func {
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
    /// Inverse tangent of the argument over Q0.
    Atan2,
    /// Square root.
    Sqrt,
    /// Natural logarithm.
    Ln,
    /// Exponential.
    Exp,
    /// Absolute value.
    Abs,
    /// The next integer below.
    Int,
}

/// Every function with its name; longer names before those that they begin with.
pub(crate) const FUNCTIONS: &[(&str, Func)] = &[
    ("ATAN2", Func::Atan2),
    ("ATAN", Func::Atan),
    ("ASIN", Func::Asin),
    ("ACOS", Func::Acos),
    ("SIN", Func::Sin),
    ("COS", Func::Cos),
    ("TAN", Func::Tan),
    ("SQRT", Func::Sqrt),
    ("LN", Func::Ln),
    ("EXP", Func::Exp),
    ("ABS", Func::Abs),
    ("INT", Func::Int),
];

/// A comparator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Cmp {
    /// `=`
    Eq,
    /// `!=`
    Ne,
    /// `>`
    Gt,
    /// `!>`
    NotGt,
    /// `<`
    Lt,
    /// `!<`
    NotLt,
    /// `~`: less than one apart.
    Near,
    /// `!~`
    NotNear,
}

/// An operation on two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Bin {
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

/// One step of an expression or condition in postfix order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Op {
    /// A literal.
    Const(f64),
    /// A variable's value.
    Var(Kind, u16),
    /// The value of the variable whose number is on top.
    Indirect(Kind),
    /// Unary minus.
    Neg,
    /// Two numbers to one.
    Bin(Bin),
    /// A function of the number on top.
    Call(Func),
    /// Two numbers to a truth value.
    Cmp(Cmp),
    /// Two truth values to one: both.
    Both,
    /// Two truth values to one: either.
    Either,
}

/// An expression or condition: a stretch of [`Download::ops`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Expr {
    /// Index of its first step.
    pub(crate) start: u32,
    /// Number of its steps.
    pub(crate) len: u32,
}

/// What an assignment writes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Target {
    /// One variable.
    Var(Kind, u16),
    /// The variable whose number the expression gives.
    Indirect(Kind, Expr),
    /// `count` variables from `first` on, `step` apart.
    Range {
        /// Their kind.
        kind: Kind,
        /// The first one's number.
        first: u16,
        /// How many.
        count: u16,
        /// From one to the next.
        step: u16,
    },
}

/// PLCs or PLCCs, a bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Plcs {
    /// PLCCs.
    pub(crate) compiled: bool,
    /// Bit n is program n.
    pub(crate) set: u32,
}

/// A statement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum What {
    /// Assignment.
    Assign(Target, Expr),
    /// Go on at the statement when the condition is false.
    If(Expr, u32),
    /// Go on at the statement: the end of a branch in front of its ELSE.
    Jump(u32),
    /// Go on behind the loop, at the statement, when the condition is false.
    While(Expr, u32),
    /// End the scan; the next starts at the statement, a `While`.
    EndWhile(u32),
    /// ENABLE and its kind.
    Plc(PlcOp, Plcs),
    /// ADDRESS: motor, coordinate system.
    Address(Option<u8>, Option<u8>),
    /// ADDRESS with a variable: the motor's number, the coordinate system's; empty ones are none.
    AddressBy(Expr, Expr),
    /// SEND, DISPLAY, COMMAND, a write to the MACRO ring: an index into [`Download::texts`], and
    /// the value that a DISPLAY shows.
    Text(u32, Option<Expr>),
    /// In a COMMAND: an index into [`Download::defines`].
    Define(u32),
    /// In a COMMAND: a value into a word of memory.
    Word(Space, u32, Expr),
    /// In a COMMAND: retained values are written.
    Save,
}

/// A statement with its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stmt {
    /// What it does.
    pub(crate) what: What,
    /// Where it stands.
    pub(crate) at: At,
    /// Computed in 24-bit integers.
    pub(crate) integer: bool,
}

/// Something done at load or by a COMMAND.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Action {
    /// Assignment.
    Assign(Target, Expr),
    /// I-variables back to their defaults: first, count, step.
    Defaults(u16, u16, u16),
    /// Definition of M-variables: first, count, where to.
    Define(u16, u16, Definition),
    /// ENABLE and its kind.
    Plc(PlcOp, Plcs),
    /// A coordinate system is addressed.
    System(u8),
    /// Values into memory.
    Write(WriteKind, u32, Vec<Expr>),
    /// Retained values are written.
    Save,
    /// Reset: definitions and variables stay but for what is not retained.
    Reset,
    /// A PLCC is erased.
    DeletePlcc(u8),
    /// For motors and coordinate systems: nothing that this controller acts on.
    Motion,
}

/// Which memory a W command writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WriteKind {
    /// X words.
    X,
    /// Y words.
    Y,
    /// Floating point.
    Long,
    /// Fixed point over X and Y.
    Double,
    /// The processor's own programs, as backups hold compiled PLCs: not memory that PLCs see.
    Program,
}

/// An on-line command of the text.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Online {
    /// What it does.
    pub(crate) action: Action,
    /// Where it stands.
    pub(crate) at: At,
}

/// A PLC or PLCC.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Buffer {
    /// Its statements.
    pub(crate) code: Vec<Stmt>,
    /// Where it was opened last; none when it never was.
    pub(crate) opened: Option<At>,
    /// Its structure is wrong, it cannot run.
    pub(crate) broken: bool,
}

/// All that was downloaded.
#[derive(Clone, Debug)]
pub(crate) struct Download {
    /// For which controller.
    pub(crate) controller: Controller,
    /// The steps of all expressions.
    pub(crate) ops: Vec<Op>,
    /// PLC 0 to 31.
    pub(crate) plcs: Vec<Buffer>,
    /// PLCC 0 to 31.
    pub(crate) plccs: Vec<Buffer>,
    /// On-line commands, in order.
    pub(crate) online: Vec<Online>,
    /// What SEND, DISPLAY, COMMAND and the MACRO ring say. A COMMAND's task is the index of its
    /// code in `commands` until tasks are numbered.
    pub(crate) texts: Vec<Text>,
    /// What COMMANDs do, where they do something.
    pub(crate) commands: Vec<Vec<Stmt>>,
    /// The definitions that COMMANDs make.
    pub(crate) defines: Vec<Define>,
    /// L-variable definitions as they stand after the text.
    pub(crate) l_defs: std::collections::BTreeMap<u16, Definition>,
    /// The way back to the sources.
    pub(crate) origins: Origins,
}

impl Download {
    /// The steps of an expression.
    pub(crate) fn ops(&self, expr: Expr) -> &[Op] {
        let start = expr.start as usize;
        self.ops.get(start..start + expr.len as usize).unwrap_or(&[])
    }

    /// The expression or condition that a statement computes.
    pub(crate) fn computed(what: &What) -> Option<Expr> {
        match *what {
            What::Assign(_, expr)
            | What::If(expr, _)
            | What::While(expr, _)
            | What::AddressBy(_, expr)
            | What::Word(_, _, expr) => Some(expr),
            What::Text(_, value) => value,
            _ => None,
        }
    }
}
