//! A checked download.
//!
//! Nothing here is nested. All expressions and conditions of a download are in postfix order in
//! one array of operations ([`Download::ops`]). A buffer is an array of statements, and a branch
//! names its target by the index in that array. So nothing that walks a program needs recursion,
//! however long the source is or however deep it nests.
//!
//! | source | in the download |
//! | --- | --- |
//! | `P1+P2*3` | `Var(P, 1)`, `Var(P, 2)`, `Const(3)`, `Bin(Mul)`, `Bin(Add)` |
//! | `IF (P1=1) P2=0 ENDIF P3=0` | 0: `If(P1=1, 2)`, 1: `Assign(P2, 0)`, 2: `Assign(P3, 0)` |

pub(crate) use plcc_abi::pmac::expression::{Bin, Cmp, Func, Op};
use plcc_abi::pmac::motion::{LineWord, MotionCommand, MotionKind};
use plcc_abi::pmac::{Define, Definition, Kind, PlcOp, Space, Text};

use super::origin::{Origins, TextRange};
use crate::common::Controller;

/// Every function with its name. A name comes before the names that it begins with (`ATAN2`
/// before `ATAN`), so that the first match is the right one.
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

/// An expression or condition: its place in [`Download::ops`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Expr {
    /// Index of its first operation.
    pub(crate) start: u32,
    /// Number of its operations.
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
        /// The difference between the numbers of two neighbours.
        step: u16,
    },
}

impl Target {
    /// The variables that it names by their numbers, each with its kind.
    pub(crate) fn named(self) -> impl Iterator<Item = (Kind, u16)> {
        let (kind, first, count, step) = match self {
            Self::Var(kind, number) => (kind, number, 1, 1),
            Self::Range { kind, first, count, step } => (kind, first, count, step),
            Self::Indirect(kind, _) => (kind, 0, 0, 0),
        };
        (0..count).map(move |k| (kind, first.wrapping_add(k.wrapping_mul(step))))
    }

    /// The expression that gives the variable's number, if one does.
    pub(crate) fn index(self) -> Option<Expr> {
        match self {
            Self::Indirect(_, index) => Some(index),
            Self::Var(..) | Self::Range { .. } => None,
        }
    }
}

/// A set of PLCs or PLCCs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PlcSet {
    /// Whether they are PLCCs.
    pub(crate) compiled: bool,
    /// Bit n is 1 if the set holds program n.
    pub(crate) bits: u32,
}

/// What a statement does. Branch targets are indices of statements in the same buffer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum StmtKind {
    /// Assignment.
    Assign(Target, Expr),
    /// IF: when the condition is false, execution goes on at the target.
    If(Expr, u32),
    /// Execution goes on at the target. It is where ELSE is, at the end of the statements
    /// that are executed when the condition is true.
    Jump(u32),
    /// WHILE: when the condition is false, execution goes on at the target, after the ENDWHILE.
    While(Expr, u32),
    /// ENDWHILE: the scan ends, and the next one starts at the target, which is the `While`.
    EndWhile(u32),
    /// ENABLE, DISABLE, PAUSE or RESUME.
    Plc(PlcOp, PlcSet),
    /// ADDRESS with numbers: the motor and the coordinate system, `None` where it names none.
    Address(Option<u8>, Option<u8>),
    /// ADDRESS with a variable: the number of the motor and that of the coordinate system. An
    /// empty expression means that the statement names none.
    AddressBy(Expr, Expr),
    /// SEND, DISPLAY, COMMAND, or a write to the MACRO ring: an index into [`Download::texts`], and
    /// the value that a DISPLAY shows or the ring is sent.
    Text(u32, Option<Expr>),
    /// A definition of M-variables in a COMMAND: an index into [`Download::defines`].
    Define(u32),
    /// A word of memory that a COMMAND writes: its space, its address and the value.
    Word(Space, u32, Expr),
    /// SAVE in a COMMAND.
    Save,
    /// A statement of motion: an index into [`Download::motion`], and the operations of all its values together.
    Motion(u32, Expr),
    /// The end of a WHILE in a motion program: the index of the `While`, and of the statement of motion.
    Loop(u32, u32),
}

impl StmtKind {
    /// The expressions and conditions that it has, those for variables' numbers among them.
    pub(crate) fn expressions(&self) -> impl Iterator<Item = Expr> {
        let expressions = match *self {
            Self::Assign(target, value) => [target.index(), Some(value)],
            Self::If(expr, _)
            | Self::While(expr, _)
            | Self::Word(_, _, expr)
            | Self::Motion(_, expr) => [Some(expr), None],
            Self::AddressBy(motor, system) => [Some(motor), Some(system)],
            Self::Text(_, value) => [value, None],
            Self::Jump(_)
            | Self::EndWhile(_)
            | Self::Plc(..)
            | Self::Address(..)
            | Self::Define(_)
            | Self::Save
            | Self::Loop(..) => [None, None],
        };
        expressions.into_iter().flatten()
    }
}

/// A statement of a buffer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stmt {
    /// What it does.
    pub(crate) kind: StmtKind,
    /// Where it is in the preprocessed text.
    pub(crate) at: TextRange,
    /// Whether it is computed in 24-bit integers, as statements of L-variables alone are.
    pub(crate) integer: bool,
}

/// What an on-line command does, at load or when a COMMAND gives it. Resets such as `$$$` do nothing here and have
/// none.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Action {
    /// Assignment.
    Assign(Target, Expr),
    /// I-variables get their defaults: the first one's number, how many there are, and the
    /// difference between the numbers of two neighbours.
    Defaults(u16, u16, u16),
    /// M-variables get a definition: the first one's number, and how many there are.
    Define(u16, u16, Definition),
    /// ENABLE, DISABLE, PAUSE or RESUME.
    Plc(PlcOp, PlcSet),
    /// A coordinate system is addressed.
    System(u8),
    /// Values are written to memory from an address on, one to each address.
    Write(WriteKind, u32, Vec<Expr>),
    /// SAVE.
    Save,
    /// A PLCC is erased.
    DeletePlcc(u8),
    /// Something that motors or coordinate systems do, where they are simulated.
    Motion(MotionCommand),
}

/// Which memory a W command writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WriteKind {
    /// X words.
    X,
    /// Y words.
    Y,
    /// The 48 bits of an X and a Y word, as `L:` names them.
    Long,
    /// The 48 bits of an X and a Y word, as `D:` names them.
    Double,
    /// The processor's program memory, where backups put compiled PLCs. PLCs can't see it.
    Program,
}

/// An on-line command that is in the download outside of buffers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Online {
    /// What it does.
    pub(crate) action: Action,
    /// Where it is in the preprocessed text.
    pub(crate) at: TextRange,
}

/// A statement of motion.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MotionStmt {
    /// What it does.
    pub(crate) kind: MotionKind,
    /// Its values, in order.
    pub(crate) values: Vec<Expr>,
    /// On a line with a call, the words to which they belong.
    pub(crate) words: Vec<LineWord>,
}

/// A PLC, a PLCC or a motion program.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Buffer {
    /// Its statements.
    pub(crate) code: Vec<Stmt>,
    /// Where it was opened last; `None` if it never was.
    pub(crate) opened: Option<TextRange>,
    /// Whether its IF and WHILE do not match their ends, or a motion program has other errors. It has no statements
    /// then.
    pub(crate) broken: bool,
    /// The labels of a motion program in the order of the text: number, index of the statement behind it, and place.
    pub(crate) labels: Vec<(u32, u32, TextRange)>,
}

impl Buffer {
    /// The statements of a motion program at which it can go on, by rising index: its top, labels, the conditions
    /// of WHILE, the statements of motion and those behind them.
    pub(crate) fn resume_points(&self) -> Vec<u32> {
        resume_points(&self.code, &self.labels)
    }
}

/// See [`Buffer::resume_points`].
pub(crate) fn resume_points(code: &[Stmt], labels: &[(u32, u32, TextRange)]) -> Vec<u32> {
    let mut points = vec![0];
    points.extend(labels.iter().map(|(_, index, _)| *index));
    for (index, stmt) in (0u32..).zip(code) {
        match stmt.kind {
            StmtKind::Motion(..) => points.extend([index, index + 1]),
            StmtKind::Loop(head, _) => points.push(head),
            _ => {}
        }
    }
    points.sort_unstable();
    points.dedup();
    points
}

/// The name of a program, as a statement writes it: `PLC 3`.
pub(crate) fn program_name(compiled: bool, number: u32) -> String {
    format!("{} {number}", if compiled { "PLCC" } else { "PLC" })
}

/// A download: everything that was sent to the control as one text.
#[derive(Clone, Debug)]
pub(crate) struct Download {
    /// For which controller.
    pub(crate) controller: Controller,
    /// The operations of all expressions and conditions.
    pub(crate) ops: Vec<Op>,
    /// PLC 0 to 31.
    pub(crate) plcs: Vec<Buffer>,
    /// PLCC 0 to 31.
    pub(crate) plccs: Vec<Buffer>,
    /// The motion programs, by number.
    pub(crate) progs: std::collections::BTreeMap<u32, Buffer>,
    /// The kinematic programs, by coordinate system and whether they are inverse ones.
    pub(crate) kinematics: std::collections::BTreeMap<(u8, bool), Buffer>,
    /// The statements of motion of all motion programs.
    pub(crate) motion: Vec<MotionStmt>,
    /// On-line commands, in order.
    pub(crate) online: Vec<Online>,
    /// The texts of SEND, DISPLAY, COMMAND and writes to the MACRO ring. The tasks among the steps of a COMMAND
    /// are indices into `commands` here; [`tables::program`](super::tables::program) makes them indices of tasks.
    pub(crate) texts: Vec<Text>,
    /// The commands for motors and coordinate systems that COMMANDs give.
    pub(crate) motion_commands: Vec<MotionCommand>,
    /// The statements that COMMANDs execute, for those that execute any.
    pub(crate) commands: Vec<Vec<Stmt>>,
    /// The definitions that COMMANDs make.
    pub(crate) defines: Vec<Define>,
    /// The definitions of L-variables by number. The last one in the text counts.
    pub(crate) l_defs: std::collections::BTreeMap<u16, Definition>,
    /// Where the preprocessed text is in the sources.
    pub(crate) origins: Origins,
}

impl Download {
    /// The operations of an expression.
    pub(crate) fn ops(&self, expr: Expr) -> &[Op] {
        let start = expr.start as usize;
        self.ops.get(start..start + expr.len as usize).unwrap_or(&[])
    }

    /// The value of an expression that is a number, perhaps with minus signs in front of it.
    pub(crate) fn constant(&self, expr: Expr) -> Option<f64> {
        let (Op::Const(value), signs) = self.ops(expr).split_first()? else { return None };
        let minus = signs.iter().all(|op| matches!(op, Op::Neg));
        minus.then_some(if signs.len() % 2 == 1 { -value } else { *value })
    }

    /// The PLCs, then the PLCCs, each with its number and whether it is a PLCC.
    pub(crate) fn programs(&self) -> impl Iterator<Item = (bool, u32, &Buffer)> {
        let plcs = (0..).zip(&self.plcs).map(|(number, buffer)| (false, number, buffer));
        let plccs = (0..).zip(&self.plccs).map(|(number, buffer)| (true, number, buffer));
        plcs.chain(plccs)
    }

    /// All statements: of PLCs, of PLCCs, of motion programs, of kinematic programs, and those that COMMANDs execute.
    pub(crate) fn statements(&self) -> impl Iterator<Item = &Stmt> {
        self.statements_of_buffers().chain(self.commands.iter().flatten())
    }

    /// The same without those that COMMANDs execute, whose places are those of the COMMANDs.
    pub(crate) fn statements_of_buffers(&self) -> impl Iterator<Item = &Stmt> {
        let plcs = self.programs().map(|(_, _, buffer)| &buffer.code);
        let buffers = self.progs.values().chain(self.kinematics.values());
        let motion = buffers.map(|buffer| &buffer.code);
        plcs.chain(motion).flatten()
    }

    /// All assignments, those of on-line commands first: target, value and place.
    pub(crate) fn assignments(&self) -> impl Iterator<Item = (Target, Expr, TextRange)> {
        let online = self.online.iter().filter_map(|online| match online.action {
            Action::Assign(target, expr) => Some((target, expr, online.at)),
            _ => None,
        });
        online.chain(self.statements().filter_map(|stmt| match stmt.kind {
            StmtKind::Assign(target, expr) => Some((target, expr, stmt.at)),
            _ => None,
        }))
    }

    /// The expression or condition that a statement computes, `None` if it computes none.
    pub(crate) fn computed(kind: &StmtKind) -> Option<Expr> {
        match *kind {
            StmtKind::Assign(_, expr)
            | StmtKind::If(expr, _)
            | StmtKind::While(expr, _)
            | StmtKind::AddressBy(_, expr)
            | StmtKind::Word(_, _, expr) => Some(expr),
            StmtKind::Text(_, value) => value,
            StmtKind::Jump(_)
            | StmtKind::EndWhile(_)
            | StmtKind::Plc(..)
            | StmtKind::Address(..)
            | StmtKind::Define(_)
            | StmtKind::Save
            | StmtKind::Motion(..)
            | StmtKind::Loop(..) => None,
        }
    }
}
