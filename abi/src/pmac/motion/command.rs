//! On-line commands for motors and coordinate systems, as the compiler has read them.

use alloc::string::String;

use serde::{Deserialize, Serialize};

use super::{AxisGroup, AxisSet, axis::Axis};

/// Where a jog goes (guide, appendix C, J commands).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum JogGoal {
    /// `J+`: on and on.
    Positive,
    /// `J-`.
    Negative,
    /// `J/`: it stops.
    Stop,
    /// `J=`: to the pre-jog position.
    PreJog,
    /// `J=c`.
    To(f64),
    /// `J==c`: the same, and that becomes the pre-jog position.
    ToAndKeep(f64),
    /// `J=*`: to the position in the register of the variable jog.
    ToVariable,
    /// `J:c`: by a distance from the commanded position.
    By(f64),
    /// `J:*`.
    ByVariable,
    /// `J^c`: by a distance from the actual position.
    FromActual(f64),
    /// `J^*`.
    FromActualVariable,
    /// `J!`: the commanded position becomes whole.
    Whole,
}

/// A jog.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Jog {
    /// Where it goes.
    pub goal: JogGoal,
    /// For a jog until a trigger, how far behind the trigger it ends, in counts.
    pub trigger: Option<f64>,
}

/// What is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Query {
    /// `P`: the position of the addressed motor.
    Position,
    /// `V`: its velocity.
    Velocity,
    /// `F`: its following error.
    FollowingError,
    /// `?`: its status.
    MotorStatus,
    /// `??`: that of the addressed coordinate system.
    SystemStatus,
    /// `???`: that of the card.
    GlobalStatus,
    /// `%`: the time base.
    TimeBase,
    /// `&`: the addressed coordinate system.
    System,
    /// `#`: the addressed motor.
    Motor,
    /// `^P`: the positions of all motors.
    Positions,
    /// `^V`: their velocities.
    Velocities,
    /// `^F`: their following errors.
    FollowingErrors,
    /// `^B`: the status of all motors.
    MotorStatuses,
    /// `^C`: that of all coordinate systems.
    SystemStatuses,
    /// `^G`: that of the card.
    GlobalStatuses,
}

/// What a command does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum MotionAction {
    /// `#n`: a motor is addressed for the rest of the text.
    Motor(u8),
    /// `&n`: a coordinate system is addressed for the rest of the text.
    System(u8),
    /// A jog.
    Jog(Jog),
    /// `HM`.
    Home,
    /// `HMZ`.
    HomeZero,
    /// `K`.
    Kill,
    /// `O` and a percentage.
    OpenLoop(f64),
    /// `#n->…`: the motor, its axes with their scale factors, and the offset in counts; no axes for `->0`.
    Define {
        /// The motor.
        motor: u8,
        /// The axes.
        group: Option<AxisGroup>,
        /// The scale factors.
        scales: [f64; 3],
        /// The offset, if one is given.
        offset: Option<f64>,
    },
    /// `UNDEFINE`, of the addressed coordinate system or of all.
    Undefine {
        /// Whether of all.
        all: bool,
    },
    /// `B`: the motion program and the label, 0 for the top.
    Begin {
        /// The program.
        program: u32,
        /// The label.
        label: u32,
    },
    /// `R`.
    Run,
    /// `S`.
    Step,
    /// `A`.
    Abort,
    /// `H`.
    Hold,
    /// `Q`.
    Quit,
    /// `/`.
    Halt,
    /// `\`.
    ProgramHold,
    /// `%n`.
    TimeBase(f64),
    /// `DEFINE TBUF`: how many axis transformations there are.
    Transformations(u16),
    /// `PMATCH`.
    Match,
    /// `MFLUSH`.
    Flush,
    /// `ABS` or `INC`, and of which axes.
    Incremental(bool, AxisSet),
    /// `FRAX`: these are the feedrate axes.
    FeedrateAxes(AxisSet),
    /// `X=c`: the axis is there.
    SetAxis(Axis, f64),
    /// `Z`: all axes are at 0.
    ZeroAxes,
    /// `^A`.
    AbortAll,
    /// `^K`.
    KillAll,
    /// `^O`.
    HoldAll,
    /// `^Q`.
    QuitAll,
    /// `^R`.
    RunAll,
    /// `^S`.
    StepAll,
    /// A query.
    Query(Query),
    /// Something that is refused with this error whenever it is given.
    Refused(String),
    /// `$`, `$*`, `$$` and their kind.
    Nothing,
}

/// A command with its text.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionCommand {
    /// The text, as the program wrote it.
    pub text: String,
    /// What it does.
    pub action: MotionAction,
}
