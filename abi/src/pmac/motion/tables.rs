//! The motion programs of a download, and what its on-line commands did to motors and coordinate systems.

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use super::{AxisDefinition, AxisSet, MotionCommand, axis::Axis};
use crate::pmac::expression::Op;
use crate::pmac::{Kind, Run, SparseMemory};

/// How moves are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// LINEAR.
    #[default]
    Linear,
    /// RAPID.
    Rapid,
    /// CIRCLE1, clockwise.
    Circle1,
    /// CIRCLE2.
    Circle2,
    /// SPLINE1.
    Spline1,
    /// SPLINE2.
    Spline2,
    /// PVT.
    Pvt,
}

/// A statement that sets a time or a feedrate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TimeWord {
    /// TA.
    Ta,
    /// TS.
    Ts,
    /// TM.
    Tm,
    /// F.
    Feed,
    /// The time of PVT.
    Pvt,
}

/// A word of axis transformations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TransformationWord {
    /// TSELECT: one is selected, 0 for none.
    Select,
    /// TINIT: the selected one changes nothing.
    Init,
    /// ADISPLACE: three Q-variables are the displacement.
    Displace,
    /// IDISPLACE: they are added to it.
    DisplaceMore,
    /// AROTATE: nine Q-variables are the matrix, by rows.
    Rotate,
    /// IROTATE: the matrix is multiplied by them from the left.
    RotateMore,
}

/// How a synchronous assignment changes its variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SyncOp {
    /// `==`.
    Set,
    /// `&=`.
    And,
    /// `|=`.
    Or,
    /// `^=`.
    Xor,
}

/// A word of a move; each has a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum MoveWord {
    /// An axis.
    Axis(Axis),
    /// The velocity of the axis before it, in PVT.
    Velocity(Axis),
    /// How far behind the trigger the axis before it ends.
    Trigger(Axis),
    /// The radius of an arc.
    R,
    /// I, J or K: 0, 1, 2.
    Center(u8),
}

/// What a statement of motion programs does. Its values are given in the order of its words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum MotionKind {
    /// A move.
    Move(Vec<MoveWord>),
    /// LINEAR, RAPID and their kind.
    Mode(Mode),
    /// TA, TS, TM, F: one value.
    Time(TimeWord),
    /// ABS (false) or INC, and of which axes.
    Incremental(bool, AxisSet),
    /// FRAX.
    FeedrateAxes(AxisSet),
    /// NORMAL, with the components that it names.
    Normal(Vec<u8>),
    /// DWELL: one value.
    Dwell,
    /// DELAY: one value.
    Delay,
    /// HOME, of these motors: bit n - 1 is motor n.
    Home(u32),
    /// HOMEZ.
    HomeZero(u32),
    /// PSET: a value for each axis.
    Set(Vec<Axis>),
    /// WAIT.
    Wait,
    /// STOP.
    Stop,
    /// GOTO: one value.
    Goto,
    /// GOSUB: one value.
    Gosub,
    /// CALL: one value.
    Call,
    /// RETURN.
    Return,
    /// The end of a WHILE, at which it goes back to its condition.
    EndWhile,
    /// A synchronous assignment to an M-variable: one value.
    Sync(SyncOp, u32),
    /// BLOCKSTART.
    BlockStart,
    /// BLOCKSTOP.
    BlockStop,
    /// G (0), M, T or D (3) and a number: a call of program 1000, 1001, 1002 or 1003, of 1010 and so on for numbers
    /// from 100 on. One that is not there is passed over. One value.
    Code(u8),
    /// READ: words of the calling line are taken into Q-variables, bit 0 for the letter A.
    Read(u32),
    /// A word that only READ of a program that was called in front of it on the line can take. One value.
    Argument,
    /// S behind a call on its line: Q127. One value.
    Spindle,
    /// PRELUDE1: a call in front of each letter-number word from here on, of a program (`None`) or by a code as in
    /// [`Code`](Self::Code). One value.
    Prelude(Option<u8>),
    /// PRELUDE0: no such calls.
    PreludeOff,
    /// In front of a letter-number word, where PRELUDE1 may call. Its values are those of the words from there to the
    /// end of the line.
    BeforeWord,
    /// TSELECT and its kind: one value but for TINIT.
    Transformation(TransformationWord),
    /// What is not simulated: to come here is a run-time error.
    Unsupported,
}

/// A word of a line on which a program is called in front of it, so that READ there may take it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LineWord {
    /// Its letter, in capitals.
    pub letter: u8,
    /// Its number among the words of the line, from 1; 0 for one in front of the first call.
    pub ordinal: u16,
}

/// A statement of a motion program that the control's motion carries out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MotionStatement {
    /// What it does.
    pub kind: MotionKind,
    /// On a line with a call, for each value the word that it belongs to. A call has the values of the words behind it on
    /// its line behind its own one.
    pub words: Vec<LineWord>,
    /// The index of its source file.
    pub file: u32,
    /// Its line, from 1.
    pub line: u32,
}

/// A motion program.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MotionProgram {
    /// Its number.
    pub number: u32,
    /// The index of its task; `None` if its text has errors, so that it is left out.
    pub task: Option<u32>,
    /// Its labels by rising number, each with the resume point at which it goes on there. The first one of a
    /// number counts; 0 is the top.
    pub labels: Vec<(u32, u32)>,
    /// A hash of its statements.
    pub fingerprint: u64,
}

impl MotionProgram {
    /// The resume point of a label; `None` if there is no such label. 0 is the top, which is in front of any label that
    /// the text has.
    pub fn label(&self, number: u32) -> Option<u32> {
        if number == 0 {
            return Some(0);
        }
        let index = self.labels.binary_search_by_key(&number, |(label, _)| *label).ok()?;
        self.labels.get(index).map(|(_, point)| *point)
    }
}

/// A statement of a kinematic program. Branches name statements by their index in the program.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum KinematicStep {
    /// An assignment to `count` variables from `first` on, `step` apart.
    Assign {
        /// Their kind.
        kind: Kind,
        /// The first one's number.
        first: u16,
        /// How many.
        count: u16,
        /// The difference between the numbers of two neighbours.
        step: u16,
        /// The value, in postfix order.
        value: Vec<Op>,
    },
    /// An assignment to the variable whose number is computed.
    AssignIndirect {
        /// Its kind.
        kind: Kind,
        /// Its number.
        number: Vec<Op>,
        /// The value.
        value: Vec<Op>,
    },
    /// IF and WHILE: where the condition does not hold the program goes on at the statement.
    Unless(Vec<Op>, u32),
    /// The program goes on at the statement.
    Jump(u32),
}

/// A kinematic program of Turbo PMAC (OPEN FORWARD, OPEN INVERSE).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kinematics {
    /// Its coordinate system, from 1.
    pub system: u8,
    /// Whether it gives motors from axes, and not axes from motors.
    pub inverse: bool,
    /// Its statements.
    pub steps: Vec<KinematicStep>,
}

/// An on-line command of the download that moves, runs or answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StartCommand {
    /// The addressed motor.
    pub motor: u8,
    /// The addressed coordinate system.
    pub system: u8,
    /// The command.
    pub command: MotionCommand,
}

/// The modes of a coordinate system after load.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Modes {
    /// The axes in incremental mode, R among them.
    pub incremental: AxisSet,
    /// The feedrate axes.
    pub feedrate: AxisSet,
}

impl Default for Modes {
    /// Those at power-up: ABS, INC(R), FRAX(X,Y,Z).
    fn default() -> Self {
        Self { incremental: AxisSet::R, feedrate: AxisSet::XYZ }
    }
}

/// All that concerns motion.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MotionTables {
    /// The motion programs, by rising number.
    pub programs: Vec<MotionProgram>,
    /// Their statements that the control's motion carries out.
    pub statements: Vec<MotionStatement>,
    /// The kinematic programs that have statements.
    pub kinematics: Vec<Kinematics>,
    /// The commands for motors and coordinate systems in texts of COMMAND.
    pub commands: Vec<MotionCommand>,
    /// The commands of the download that are done after the load.
    pub start: Vec<StartCommand>,
    /// The definitions of axes after load, by motor from 1.
    pub definitions: Vec<(u8, AxisDefinition)>,
    /// How many axis transformations there are (DEFINE TBUF).
    pub transformations: u16,
    /// The modes of the coordinate systems after load, those that are not as at power-up.
    pub modes: Vec<(u8, Modes)>,
    /// By how the image after load differs where motion is simulated.
    pub image: Vec<Run>,
    /// Memory outside the image after load where motion is simulated.
    pub sparse: SparseMemory,
}
