//! The tasks of a download: which there are, their order, and where each keeps the coordinate
//! system that it addresses.
//!
//! An engine runs a task by its index. First come the PLCs that have statements, by rising number,
//! then such PLCCs, then one task for each COMMAND that executes statements, then the motion programs. Lowering, the
//! statement interpreter and the executive's tables all number tasks by this list.

use plcc_abi::pmac::{COMMAND_CONTEXT, MOTION_CONTEXT, layout};

use super::analyse::load::Loaded;
use super::ast::{Buffer, Download, Stmt, StmtKind};

/// What a task belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TaskKind {
    /// A PLC or PLCC.
    Plc {
        /// Whether it is a PLCC.
        compiled: bool,
        /// Its number, 0 to 31.
        number: u32,
    },
    /// The statements of a COMMAND: their index in [`Download::commands`].
    Command(u32),
    /// A motion program, by its number.
    Motion(u32),
}

impl TaskKind {
    /// The name of the task: `PLC3`, `PLCC0`, `COMMAND12`.
    pub(crate) fn name(self) -> String {
        match self {
            Self::Plc { compiled: false, number } => format!("PLC{number}"),
            Self::Plc { compiled: true, number } => format!("PLCC{number}"),
            Self::Command(index) => format!("COMMAND{index}"),
            Self::Motion(number) => format!("PROG{number}"),
        }
    }

    /// The number of the task's context: the place in the image where its addressed coordinate
    /// system is kept. Every PLC and PLCC has its own. All commands share one, which the executive
    /// sets before each command to the coordinate system of the PLC that gave it; so do motion programs.
    pub(crate) fn context(self) -> u32 {
        match self {
            Self::Plc { compiled, number } => layout::context(compiled, number),
            Self::Command(_) => COMMAND_CONTEXT,
            Self::Motion(_) => MOTION_CONTEXT,
        }
    }
}

/// Every task with its statements, in the order of the tasks' indices. PLCs without statements and
/// erased PLCCs have none.
pub(crate) fn tasks<'a>(download: &'a Download, loaded: &Loaded) -> Vec<(TaskKind, &'a [Stmt])> {
    let mut tasks = Vec::new();
    for (compiled, buffers) in [(false, &download.plcs), (true, &download.plccs)] {
        for (number, buffer) in (0u32..).zip(buffers) {
            let erased = compiled && loaded.erased & (1 << number) != 0;
            if !buffer.code.is_empty() && !erased {
                tasks.push((TaskKind::Plc { compiled, number }, buffer.code.as_slice()));
            }
        }
    }
    for (index, code) in (0u32..).zip(&download.commands) {
        tasks.push((TaskKind::Command(index), code.as_slice()));
    }
    for (&number, buffer) in &download.progs {
        if !buffer.code.is_empty() {
            tasks.push((TaskKind::Motion(number), buffer.code.as_slice()));
        }
    }
    tasks
}

/// The statements of a task at which a suspended scan can go on, by rising index: of a motion program those that
/// [`Buffer::resume_points`](super::ast::Buffer::resume_points) gives, of others the conditions of their WHILE.
pub(crate) fn resume_points(download: &Download, kind: TaskKind, code: &[Stmt]) -> Vec<u32> {
    if let TaskKind::Motion(number) = kind {
        return download.progs.get(&number).map(Buffer::resume_points).unwrap_or_default();
    }
    let heads = (0..).zip(code).filter(|(_, stmt)| matches!(stmt.kind, StmtKind::While(..)));
    heads.map(|(index, _)| index).collect()
}
