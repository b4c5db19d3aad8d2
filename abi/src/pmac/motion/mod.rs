//! What compiler and executive share of a PMAC's other side: motors, coordinate systems and motion
//! programs. The tables of a download's motion, the axes, the [commands](command) for motors and
//! coordinate systems, and where their [registers] are.

pub mod axis;
pub mod command;
pub mod destination;
pub mod name;
pub mod online;
pub mod plant;
pub mod registers;
pub mod tables;

pub use axis::{Axis, AxisDefinition, AxisGroup, AxisSet};
pub use command::{Jog, JogGoal, MotionAction, MotionCommand, Query};
pub use destination::Destination;
pub use name::{MotionName, MotorValue, SystemValue};
pub use online::Online;
pub use plant::Plant;
pub use registers::{MotorRegisters, SystemRegisters};
pub use tables::{
    KinematicStep, Kinematics, LineWord, Mode, Modes, MotionKind, MotionProgram, MotionStatement,
    MotionTables, MoveWord, StartCommand, SyncOp, TimeWord, TransformationWord,
};
