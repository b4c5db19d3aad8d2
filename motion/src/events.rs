//! What the simulated motion reports.

use std::sync::Arc;

/// Why a command is refused: the controller's error numbers, and ours (guide, appendix A).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// ERR001: not while a program runs.
    Running,
    /// ERR003: a number or a motor that does not fit.
    Unfit,
    /// ERR010: both limits of a motor.
    BothLimits,
    /// ERR011: a motor moves.
    Moving,
    /// ERR012: a motor's loop is open.
    OpenLoop,
    /// ERR013: a motor is not activated.
    NotActivated,
    /// ERR014: no motors in the coordinate system.
    NoMotors,
    /// ERR015: there is no such program.
    NoProgram,
    /// ERR016: the program's structure is wrong.
    Structure,
    /// ERR017: not where the program was held.
    Elsewhere,
    /// PMAC-X9: it is not simulated.
    NotSimulated,
}

impl Error {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Running,
        Self::Unfit,
        Self::BothLimits,
        Self::Moving,
        Self::OpenLoop,
        Self::NotActivated,
        Self::NoMotors,
        Self::NoProgram,
        Self::Structure,
        Self::Elsewhere,
        Self::NotSimulated,
    ];

    /// As events name it.
    pub const fn code(self) -> &'static str {
        match self {
            Self::Running => "ERR001",
            Self::Unfit => "ERR003",
            Self::BothLimits => "ERR010",
            Self::Moving => "ERR011",
            Self::OpenLoop => "ERR012",
            Self::NotActivated => "ERR013",
            Self::NoMotors => "ERR014",
            Self::NoProgram => "ERR015",
            Self::Structure => "ERR016",
            Self::Elsewhere => "ERR017",
            Self::NotSimulated => "PMAC-X9",
        }
    }

    /// The error of a code; not simulated for what is not a code.
    pub fn of(code: &str) -> Self {
        match code {
            "ERR003" => Self::Unfit,
            _ => Self::NotSimulated,
        }
    }
}

/// What a motion program has done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// It runs.
    Started,
    /// Its calculation has come to its end.
    Ended,
    /// It was stopped.
    Stopped,
    /// It has stopped with a run-time error.
    Error,
}

impl State {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Started, Self::Ended, Self::Stopped, Self::Error];

    /// As events name it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Started => "started",
            Self::Ended => "ended",
            Self::Stopped => "stopped",
            Self::Error => "error",
        }
    }
}

/// Why a motion program has stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// A.
    Abort,
    /// Q, `/`, or S while it ran.
    Quit,
    /// K.
    Kill,
    /// A limit.
    Limit,
    /// A fatal following error.
    FollowingError,
    /// An amplifier's fault.
    AmplifierFault,
    /// STOP.
    Stop,
    /// The end of a step.
    Step,
    /// `\`.
    ProgramHold,
    /// Error: a label that is not there.
    Label,
    /// Error: a program that is not there.
    Program,
    /// Error: subroutines nest too deep.
    Depth,
    /// Error: an arc with no circle.
    Circle,
    /// Error: the next move was not calculated in time.
    Late,
    /// Error: what is not simulated.
    Unsupported,
    /// Error: HOME of a motor of another coordinate system.
    Motor,
}

impl Reason {
    /// All of them.
    pub const ALL: [Self; 16] = [
        Self::Abort,
        Self::Quit,
        Self::Kill,
        Self::Limit,
        Self::FollowingError,
        Self::AmplifierFault,
        Self::Stop,
        Self::Step,
        Self::ProgramHold,
        Self::Label,
        Self::Program,
        Self::Depth,
        Self::Circle,
        Self::Late,
        Self::Unsupported,
        Self::Motor,
    ];

    /// As events name it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Abort => "A",
            Self::Quit => "Q",
            Self::Kill => "K",
            Self::Limit => "limit",
            Self::FollowingError => "following error",
            Self::AmplifierFault => "amplifier fault",
            Self::Stop => "STOP",
            Self::Step => "step",
            Self::ProgramHold => "\\",
            Self::Label => "label",
            Self::Program => "program",
            Self::Depth => "depth",
            Self::Circle => "circle",
            Self::Late => "late",
            Self::Unsupported => "unsupported",
            Self::Motor => "motor",
        }
    }
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MotionEvent {
    /// A command was refused.
    Refused {
        /// Its text.
        text: Arc<str>,
        /// The motor, for a command of motors.
        motor: Option<u32>,
        /// The coordinate system, for one of those.
        system: Option<u32>,
        /// Why.
        error: Error,
    },
    /// The answer to a query.
    Answer {
        /// Its text.
        text: Arc<str>,
    },
    /// A motion program has started, ended or stopped.
    Program {
        /// The coordinate system.
        system: u32,
        /// The program.
        program: u32,
        /// What it did.
        state: State,
        /// Why, where it stopped.
        reason: Option<Reason>,
        /// The index of its file and its line, in all but `started`.
        place: Option<(u32, u32)>,
    },
    /// A homing search is over: the motor is at its zero.
    Home {
        /// The motor.
        motor: u32,
    },
    /// Synchronous assignments were done at once, since there was no room for them.
    SyncOverflow {
        /// The coordinate system.
        system: u32,
    },
}
