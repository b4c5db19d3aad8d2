//! The tasks of a download: which there are, their order, and where each keeps the coordinate
//! system that it addresses.
//!
//! An engine runs a task by its index. First come the PLCs that have statements, by rising number,
//! then such PLCCs, then one task for each COMMAND that executes statements. Lowering, the
//! statement interpreter and the executive's tables all number tasks by this list.

use plcc_abi::pmac::{COMMAND_CONTEXT, layout};

use super::analyse::load::Loaded;
use super::ast::{Download, Stmt};

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
}

impl TaskKind {
    /// The name of the task: `PLC3`, `PLCC0`, `COMMAND12`.
    pub(crate) fn name(self) -> String {
        match self {
            Self::Plc { compiled: false, number } => format!("PLC{number}"),
            Self::Plc { compiled: true, number } => format!("PLCC{number}"),
            Self::Command(index) => format!("COMMAND{index}"),
        }
    }

    /// The number of the task's context: the place in the image where its addressed coordinate
    /// system is kept. Every PLC and PLCC has its own. All commands share one, which the executive
    /// sets before each command to the coordinate system of the PLC that gave it.
    pub(crate) fn context(self) -> u32 {
        match self {
            Self::Plc { compiled, number } => layout::context(compiled, number),
            Self::Command(_) => COMMAND_CONTEXT,
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
    tasks
}
