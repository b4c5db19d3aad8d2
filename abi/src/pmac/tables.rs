//! What the executive of a PMAC knows of a download.

use alloc::{string::String, vec::Vec};

use serde::{Deserialize, Serialize};

use super::{
    controller::Controller, definition::Definition, expression::Op, layout::Run,
    motion::MotionTables, range::Range, sparse_memory::SparseMemory,
};

/// What a statement does to PLCs. The numbers are the argument of the host function.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u32)]
pub enum PlcOp {
    /// ENABLE: the PLC runs from its top.
    Enable = 0,
    /// DISABLE: the PLC no longer runs.
    Disable = 1,
    /// PAUSE: a PLC that is enabled stops where it is.
    Pause = 2,
    /// RESUME: a PLC that is paused goes on where it was.
    Resume = 3,
}

impl PlcOp {
    /// The operation with a number; `None` if there is none.
    pub fn from_number(number: u32) -> Option<Self> {
        match number {
            0 => Some(Self::Enable),
            1 => Some(Self::Disable),
            2 => Some(Self::Pause),
            3 => Some(Self::Resume),
            _ => None,
        }
    }
}

/// A PLC or PLCC. Those without statements are not in the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Program {
    /// Its number, 0 to 31.
    pub number: u32,
    /// Whether it is a PLCC rather than a PLC.
    pub compiled: bool,
    /// The index of its task among those of the program.
    pub task: u32,
    /// Whether it is enabled after load.
    pub enabled: bool,
    /// Whether it is paused after load: only RESUME starts it then.
    pub paused: bool,
    /// A hash of its statements and all that they name by a number. Two programs with the same one have
    /// the same WHILE statements at the same resume points, whatever else is in their downloads.
    pub fingerprint: u64,
}

/// Something that a statement sends to the world outside: a text, a value or a command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Text {
    /// SEND; the port is `S` or `P` for SENDS and SENDP.
    Send {
        /// What is sent.
        text: String,
        /// Where, if not to the active port.
        port: Option<String>,
    },
    /// DISPLAY of a text.
    Show {
        /// The text.
        text: String,
        /// The position of its first character.
        position: u32,
    },
    /// DISPLAY of a value.
    Value {
        /// The position of the field's first character.
        position: u32,
        /// The field's characters, the point among them.
        width: u32,
        /// Digits after the point.
        decimals: u32,
    },
    /// COMMAND.
    Command {
        /// The command.
        text: String,
        /// Why it is not valid, if so: `ERR003`.
        error: Option<String>,
        /// What it does, in order.
        steps: Vec<CommandStep>,
    },
    /// A write to the MACRO ring.
    Macro {
        /// The statement.
        text: String,
    },
}

/// A part of what a COMMAND does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum CommandStep {
    /// A task is run, which does what concerns variables and PLCs.
    Task(u32),
    /// A command for motors or coordinate systems: its index in the tables of motion.
    Motion(u32),
}

/// A definition that a COMMAND makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Define {
    /// The first M-variable.
    pub first: u32,
    /// The last.
    pub last: u32,
    /// What they become.
    pub definition: Definition,
}

/// A kind of variable, in the order of the alphabet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Kind {
    /// Initialisation variables.
    I,
    /// Integer variables of PLCCs.
    L,
    /// Pointers into memory.
    M,
    /// Global variables.
    P,
    /// Variables of a coordinate system.
    Q,
}

impl Kind {
    /// The number by which compiled code names the kind to the host.
    pub const fn number(self) -> u32 {
        self as u32
    }

    /// The kind with a [number](Self::number); `None` if there is none.
    pub const fn from_number(number: u32) -> Option<Self> {
        match number {
            0 => Some(Self::I),
            1 => Some(Self::L),
            2 => Some(Self::M),
            3 => Some(Self::P),
            4 => Some(Self::Q),
            _ => None,
        }
    }
}

/// A variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Variable {
    /// Of what kind.
    pub kind: Kind,
    /// Its number, of a Q as written.
    pub number: u32,
    /// A Q's coordinate system, from 1; 1 for all others.
    pub system: u32,
}

/// A physical output: a place in I/O memory that the download writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Output {
    /// The M- or L-variable by which it is written; `None` where it is written by its address, or is
    /// one of the outputs that the guide names.
    pub variable: Option<Variable>,
    /// Where it is: bits of a single word, or the variable's thumbwheel line.
    pub definition: Definition,
}

/// A statement of a PLC that names M-variables, as the host function `pmac_statement` executes it. General
/// code calls that while one of these variables has another definition than code assumes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statement {
    /// The kind and number of the variable to which the value is assigned; `None` for a condition, which
    /// holds if its value is not 0.
    pub target: Option<(Kind, u16)>,
    /// The value, in postfix order.
    pub value: Vec<Op>,
}

/// The tables of a PMAC download.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PmacTables {
    /// The controller that the download is for.
    pub controller: Controller,
    /// The PLCs and PLCCs.
    pub programs: Vec<Program>,
    /// What `pmac_event` says, by its index.
    pub texts: Vec<Text>,
    /// What `pmac_define` does, by its index.
    pub defines: Vec<Define>,
    /// What `pmac_statement` executes, by its index.
    pub statements: Vec<Statement>,
    /// The ranges of I-variables, by rising number; others take any value.
    pub ranges: Vec<(u32, Range)>,
    /// The definitions of L-variables, by rising number: `X` and `Y` only.
    pub l: Vec<(u32, Definition)>,
    /// The variables that a dump has.
    pub named: Vec<Variable>,
    /// The image after load.
    pub initial: Vec<Run>,
    /// Memory outside the image after load.
    pub sparse: SparseMemory,
    /// Whether the text itself says SAVE.
    pub save: bool,
    /// The physical outputs.
    pub outputs: Vec<Output>,
    /// What concerns motors, coordinate systems and motion programs.
    pub motion: MotionTables,
}
