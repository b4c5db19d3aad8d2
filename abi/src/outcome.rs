//! How a scan ends: at its end, suspended, or stopped by a trap with a code.

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
    BadLabel = 0, "bad_label";
    /// An array index out of bounds (PMI 2.2.7: `NO PMI DATA`).
    ArrayBounds = 1, "array_bounds";
    /// The time, or number of safepoints, of a module is used up (NCT 1.4: `PLC TIMEOUT`).
    Timeout = 2, "timeout";
    /// Calls nested too deep (NCT: `CALL DEPTH`).
    CallDepth = 3, "call_depth";
    /// A host function panicked: an error in plcc, never in a program (`INTERNAL ERROR`).
    HostPanic = 4, "host_panic";
}

impl TrapCode {
    /// The code with a name of the IR's text form; `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|code| code.name() == name)
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
    Trap(TrapCode),
}

impl Outcome {
    /// Where the task's next scan begins: at a resume point, or at the top (`None`).
    pub fn resume_point(self) -> Option<ResumePoint> {
        match self {
            Self::Suspended(point) => Some(point),
            Self::End | Self::Trap(_) => None,
        }
    }
}
