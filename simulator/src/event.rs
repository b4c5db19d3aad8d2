//! What a simulated control tells.

use serde::{Deserialize, Serialize};

/// Something that the simulator tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Told {
    /// A block of the part program, on this line, begins.
    Block(u32),
    /// The entered block with this number begins.
    Entry(u32),
    /// The part program has ended.
    End,
    /// A request was refused.
    Refused(Requested, Refusal),
    /// A jog has come to a limit: the axis's number, and whether in the positive direction.
    Limit(u8, bool),
    /// A block has waited for this for 500 ticks.
    Waits(Awaited),
    /// The next record of [`take_sent`](crate::Simulator::take_sent) has left the serial line.
    Serial,
}

/// What was requested.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Requested {
    /// CYCLE START.
    CycleStart,
    /// A jog of the axis with this number.
    Jog(u8),
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// The control is in E-stop.
    EStop,
    /// The mode is manual.
    Manual,
    /// Feed hold is still requested.
    FeedHoldRequest,
    /// The program runs.
    Running,
    /// There is no part program.
    NoProgram,
    /// An axis stands at a limit.
    Limit,
}

impl Refusal {
    /// All of them, in their order.
    pub const ALL: [Self; 6] = [
        Self::EStop,
        Self::Manual,
        Self::FeedHoldRequest,
        Self::Running,
        Self::NoProgram,
        Self::Limit,
    ];

    /// The word for it in an event.
    pub fn name(self) -> &'static str {
        match self {
            Self::EStop => "E-STOP",
            Self::Manual => "MANUAL",
            Self::FeedHoldRequest => "FEEDHOLD REQUEST",
            Self::Running => "RUNNING",
            Self::NoProgram => "NO PROGRAM",
            Self::Limit => "LIMIT",
        }
    }
}

/// What a block waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Awaited {
    /// The declared code with this number in the program's list is to be reset.
    Code(u16),
    /// @NEWSC is to be reset.
    SpindleSpeed,
    /// FIN, Y547.
    Finished,
    /// The feed's permission, Y650.
    Feed,
    /// The axis with this number is to be released: Y61n is to be 0.
    Axis(u8),
}
