//! The simulated machine: axes, small machines, keys and lamps, the block that runs, and ways in a plane.

use serde::{Deserialize, Serialize};

use super::PanelCell;

/// The machine. What is not known of a tick, such as a variable that the control does not give, is `None`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MachineView {
    /// Of which moment the values are, for people.
    pub moment: String,
    /// The axes or motors that are in use.
    pub axes: Vec<AxisView>,
    /// The small machines.
    pub devices: Vec<DeviceView>,
    /// The keys that the program looks at. Its [`command`](PanelCell::command) presses one and lets it go a moment later; its
    /// [`variable`](PanelCell::variable), set to 1 or 0, holds it or lets it go. Both are `None` while the past is shown.
    pub keys: Vec<PanelCell>,
    /// Lamps without a key.
    pub lamps: Vec<PanelCell>,
    /// The programs that make axes move.
    pub programs: Vec<ProgramView>,
    /// Ways in a plane.
    pub paths: Vec<PathView>,
}

/// An axis or a motor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisView {
    /// `X`, `#1`.
    pub name: String,
    /// The unit of all its numbers.
    pub unit: String,
    /// Where it is.
    pub actual: Option<f64>,
    /// Where it is to be.
    pub commanded: Option<f64>,
    /// The difference between the two: lag, following error.
    pub error: Option<f64>,
    /// The ends of its travel, where they are known.
    pub travel: Option<(f64, f64)>,
}

impl AxisView {
    /// Where it is in its travel, from 0 to 1; `None` where one of the two is not known.
    pub fn part(&self) -> Option<f64> {
        let (low, high) = self.travel?;
        let part = (self.actual? - low) / (high - low);
        part.is_finite().then(|| part.clamp(0.0, 1.0))
    }
}

/// A small machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeviceView {
    /// Its name.
    pub name: String,
    /// What it is: `relay`, `cylinder`, `turret`, `pump`, `switch`.
    pub kind: String,
    /// Where it is, from 0 to 1: a stroke, a pressure, a part of a turn; 0 or 1 for on and off.
    pub part: Option<f64>,
    /// The same in words.
    pub text: String,
    /// How many stations a turret has.
    pub stations: Option<u32>,
    /// Its lines.
    pub lines: Vec<DeviceLine>,
    /// The key that holds it where it is while it is 1. `None` while the past is shown.
    pub jam: Option<String>,
}

/// A line of a small machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeviceLine {
    /// The key of the table that names it: `extend`, `input`.
    pub role: String,
    /// The variable, with `!` in front of one that is inverted.
    pub name: String,
    /// Its value as it is, before it is inverted.
    pub value: Option<f64>,
}

/// A program that makes axes move.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProgramView {
    /// `part program`, `&1`.
    pub name: String,
    /// The number of the program, where it has one.
    pub number: Option<f64>,
    /// The time base in percent.
    pub base: Option<f64>,
    /// The line that is carried out; 0 for none, below 0 an entered block.
    pub line: Option<f64>,
    /// The lines around it.
    pub lines: Vec<ProgramLine>,
}

/// A line of such a program.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProgramLine {
    /// Its number.
    pub number: u32,
    /// Its text.
    pub text: String,
    /// Whether it is carried out.
    pub current: bool,
}

/// A way in a plane up to the tick that is shown, or up to the newest one that was run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathView {
    /// `&1 X Y`.
    pub name: String,
    /// Its points, the oldest first.
    pub points: Vec<[f64; 2]>,
    /// The ticks of the first and of the last point.
    pub ticks: (u64, u64),
}
