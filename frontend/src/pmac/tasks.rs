//! The tasks of a download: which there are, in which order, and whose coordinate system each
//! addresses.
//!
//! A task is what an engine runs by its index: the PLCs with statements by rising number, then the
//! PLCCs, then what each COMMAND does. Lowering, the statement interpreter and the executive's
//! tables all number tasks by this list.

use plcc_abi::pmac::{COMMAND_CONTEXT, layout};

use super::analyse::load::Loaded;
use super::ast::{Download, Stmt};

/// What a task belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TaskKind {
    /// A PLC or PLCC.
    Plc {
        /// A PLCC.
        compiled: bool,
        /// Its number, 0 to 31.
        number: u32,
    },
    /// What a COMMAND does: its index in [`Download::commands`].
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

    /// The number of the context in which it addresses a coordinate system. Every PLC and PLCC has
    /// its own; all commands share one, which the executive sets before each of them to what the
    /// PLC addressed that gave the command.
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
