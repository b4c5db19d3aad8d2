//! How a scan ends: at its end, suspended, or stopped by a trap, which says why and where.

use serde::{Deserialize, Serialize};

use crate::ResumePoint;

macro_rules! trap_codes {
    ($($(#[$doc:meta])* $name:ident = $number:literal, $text:literal;)*) => {
        /// Why a program was stopped by its own code or while a host function ran.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
        #[repr(u32)]
        pub enum TrapCode {
            $($(#[$doc])* $name = $number,)*
        }

        impl TrapCode {
            /// Every trap code.
            pub const ALL: &[Self] = &[$(Self::$name,)*];

            /// The code's name in the IR's text form.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)*
                }
            }

            /// The code with a number, as compiled code returns it; `None` if there is none.
            pub fn from_number(number: u32) -> Option<Self> {
                match number {
                    $($number => Some(Self::$name),)*
                    _ => None,
                }
            }
        }
    };
}

trap_codes! {
    /// An engine met what cannot be, for example a label that does not exist: an error in plcc,
    /// never in a program (`INTERNAL ERROR`).
    Internal = 0, "internal";
    /// An array index out of bounds (PMI 2.2.7: `NO PMI DATA`).
    ArrayBounds = 1, "array_bounds";
    /// The time, or number of safepoints, of a module is used up (NCT 1.4: `PLC TIMEOUT`).
    Timeout = 2, "timeout";
    /// Calls nested too deep (NCT: `CALL DEPTH`).
    CallDepth = 3, "call_depth";
    /// A host function panicked: an error in plcc, never in a program (`INTERNAL ERROR`).
    HostPanic = 4, "host_panic";
    /// The scan took longer than the watchdog allows (`WATCHDOG`; NCT: `PLC TIMEOUT`).
    Watchdog = 5, "watchdog";
}

impl TrapCode {
    /// The code with a name of the IR's text form; `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|code| code.name() == name)
    }
}

/// A line of a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct SourceLine {
    /// The file, an index into [`Program::files`](crate::Program::files).
    pub file: u32,
    /// The line, from 1.
    pub line: u32,
}

/// An element that a program accessed and that its array does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct OutOfBoundsAccess {
    /// The array, by the offset of its first element in the process image.
    pub array: u32,
    /// The index, which is an INTEGER of 16 bits (PMI 2.2.7).
    pub index: i16,
}

/// Why a program was stopped, and what in it is to blame. All engines give the same trap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Trap {
    /// Why.
    pub code: TrapCode,
    /// The statement that was executed, by the line at which it begins; `None` where no statement is
    /// to blame. For [`TrapCode::Watchdog`] it is the one that called the host function which took too
    /// long, otherwise the one before which the scan was stopped.
    pub statement: Option<SourceLine>,
    /// The element that does not exist, for [`TrapCode::ArrayBounds`].
    pub element: Option<OutOfBoundsAccess>,
}

impl Trap {
    /// A trap for which no statement is to blame.
    pub const fn new(code: TrapCode) -> Self {
        Self { code, statement: None, element: None }
    }

    /// The trap of a scan that took longer than the watchdog allows, at or before a statement, if that is
    /// known.
    pub const fn late(statement: Option<SourceLine>) -> Self {
        Self { code: TrapCode::Watchdog, statement, element: None }
    }
}

/// A place of compiled code at which a program may be stopped. [`CodeParts`](crate::CodeParts) has a
/// table of them, so that code returns no more than a place's number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct TrapSite {
    /// Why the program is stopped there.
    pub code: TrapCode,
    /// The statement that the code belongs to.
    pub statement: SourceLine,
    /// The array that is accessed, as [`OutOfBoundsAccess::array`] says, for
    /// [`TrapCode::ArrayBounds`].
    pub array: Option<u32>,
}

impl TrapSite {
    /// The trap at this place. The low 16 bits of `index` are the index with which the array was
    /// accessed; without an array they mean nothing.
    pub fn trap(&self, index: u32) -> Trap {
        let element = self.array.map(|array| OutOfBoundsAccess { array, index: index as i16 });
        Trap { code: self.code, statement: Some(self.statement), element }
    }
}

/// How one call of a task ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The scan is over; the next starts at the top.
    End,
    /// The scan was interrupted; the task's next one goes on at the resume point.
    Suspended(ResumePoint),
    /// The program is stopped.
    Trap(Trap),
}

impl Outcome {
    /// A [trap](Trap::new) for which no statement is to blame.
    pub const fn trap(code: TrapCode) -> Self {
        Self::Trap(Trap::new(code))
    }

    /// Where the task's next scan begins: at a resume point, or at the top (`None`).
    pub fn resume_point(self) -> Option<ResumePoint> {
        match self {
            Self::Suspended(point) => Some(point),
            Self::End | Self::Trap(_) => None,
        }
    }
}
