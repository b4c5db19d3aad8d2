//! The names of what users can watch and set of simulated motors and coordinate systems.

use core::fmt;

use alloc::string::String;
use serde::{Deserialize, Serialize};

use super::axis::Axis;
use super::online::Online;
use crate::pmac::Layout;

/// A value of a motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum MotorValue {
    /// `CMD`: the commanded position in counts, without bias.
    Commanded,
    /// `ACT`: the actual position.
    Actual,
    /// `VEL`: the commanded velocity in counts/ms.
    Velocity,
    /// `FE`: the following error.
    FollowingError,
    /// `X`: the physical position, from the position at power-up.
    Physical,
    /// `FAULT`: whether its amplifier reports a fault.
    Fault,
    /// `JAM`: whether it can't move.
    Jam,
}

impl MotorValue {
    /// All, with their names.
    pub const ALL: [(Self, &'static str); 7] = [
        (Self::Commanded, "CMD"),
        (Self::Actual, "ACT"),
        (Self::Velocity, "VEL"),
        (Self::FollowingError, "FE"),
        (Self::Physical, "X"),
        (Self::Fault, "FAULT"),
        (Self::Jam, "JAM"),
    ];

    /// Whether a stimulus may set it.
    pub fn can_be_set(self) -> bool {
        matches!(self, Self::Physical | Self::Fault | Self::Jam)
    }
}

/// A value of a coordinate system.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum SystemValue {
    /// `X` and the other axes: the commanded position in user units, by the number of the axis.
    Position(u8),
    /// `VX` and its kind: the velocity in user units a second.
    Velocity(u8),
    /// `SPEED`: that of the feedrate axes together.
    Speed,
    /// `BASE`: the time base in percent.
    Base,
    /// `PROG`: the number of the motion program.
    Program,
    /// `LINE`: the line of the move that runs.
    Line,
}

/// A value of a motor or of a coordinate system, which count from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum MotionName {
    /// `#1.CMD`.
    Motor(u8, MotorValue),
    /// `&1.X`.
    System(u8, SystemValue),
    /// `#1J+`: an on-line command, which has no value and is given by setting it.
    Online(Online),
}

impl MotionName {
    /// The name in a text in capitals; `None` if it is not one. The number may be beyond the controller's last.
    pub fn parse(text: &str) -> Option<(char, u32, Self)> {
        if let Some((sign, number, command)) = Online::parse(text) {
            return Some((sign, number, Self::Online(command)));
        }
        let (owner, value) = text.split_once('.')?;
        let mut chars = owner.chars();
        let sign = chars.next()?;
        let digits = chars.as_str();
        let number: u32 =
            digits.bytes().all(|b| b.is_ascii_digit()).then(|| digits.parse().ok())??;
        let short = u8::try_from(number).unwrap_or(0);
        let name = match sign {
            '#' => {
                let (found, _) = MotorValue::ALL.into_iter().find(|(_, name)| *name == value)?;
                Self::Motor(short, found)
            }
            '&' => Self::System(short, system_value(value)?),
            _ => return None,
        };
        Some((sign, number, name))
    }

    /// Whether a controller has its motor or coordinate system.
    pub fn exists(sign: char, number: u32, layout: &Layout) -> Result<(), (&'static str, u32)> {
        let (what, last) = match sign {
            '^' => return Ok(()),
            '#' => ("#", super::registers::motors(layout.controller)),
            _ => ("&", layout.systems()),
        };
        if (1..=last).contains(&number) { Ok(()) } else { Err((what, last)) }
    }

    /// All that have a value, of a controller, in their order.
    pub fn all(layout: &Layout) -> impl Iterator<Item = Self> + use<> {
        let motors = super::registers::motors(layout.controller) as u8;
        let systems = layout.systems() as u8;
        let of_motors = (1..=motors).flat_map(|motor| {
            MotorValue::ALL.into_iter().map(move |(value, _)| Self::Motor(motor, value))
        });
        let of_systems = (1..=systems).flat_map(|system| {
            let positions = (0..9).map(SystemValue::Position);
            let velocities = (0..9).map(SystemValue::Velocity);
            let others =
                [SystemValue::Speed, SystemValue::Base, SystemValue::Program, SystemValue::Line];
            positions.chain(velocities).chain(others).map(move |value| Self::System(system, value))
        });
        of_motors.chain(of_systems)
    }
}

fn system_value(text: &str) -> Option<SystemValue> {
    let axis = |letter: &str| {
        let [letter] = letter.as_bytes() else { return None };
        Axis::from_letter(*letter).map(|axis| axis as u8)
    };
    Some(match text {
        "SPEED" => SystemValue::Speed,
        "BASE" => SystemValue::Base,
        "PROG" => SystemValue::Program,
        "LINE" => SystemValue::Line,
        _ => match (axis(text), text.strip_prefix('V').and_then(axis)) {
            (Some(axis), _) => SystemValue::Position(axis),
            (None, Some(axis)) => SystemValue::Velocity(axis),
            (None, None) => return None,
        },
    })
}

impl fmt::Display for MotionName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let letter = |axis: u8| {
            let axis = Axis::ALL.get(usize::from(axis)).copied().unwrap_or(Axis::X);
            char::from(axis.letter())
        };
        match *self {
            Self::Motor(number, value) => {
                let name = MotorValue::ALL.iter().find(|(own, _)| *own == value);
                write!(f, "#{number}.{}", name.map_or("", |(_, name)| name))
            }
            Self::System(number, value) => {
                write!(f, "&{number}.")?;
                match value {
                    SystemValue::Position(axis) => write!(f, "{}", letter(axis)),
                    SystemValue::Velocity(axis) => write!(f, "V{}", letter(axis)),
                    SystemValue::Speed => f.write_str("SPEED"),
                    SystemValue::Base => f.write_str("BASE"),
                    SystemValue::Program => f.write_str("PROG"),
                    SystemValue::Line => f.write_str("LINE"),
                }
            }
            Self::Online(command) => write!(f, "{command}"),
        }
    }
}

/// The reason why a name of motion means nothing in a run without simulation.
pub fn needs_simulation(name: &str) -> String {
    alloc::format!("{name} needs --simulate: without it motors do not move")
}

#[cfg(test)]
mod tests {
    use alloc::string::ToString;

    use super::*;
    use crate::pmac::Controller;

    #[test]
    fn every_name_reads_back() {
        for controller in [Controller::Pmac, Controller::Turbo] {
            let layout = Layout::new(controller);
            for name in MotionName::all(&layout) {
                let (sign, number, read) = MotionName::parse(&name.to_string()).unwrap();
                assert_eq!(read, name);
                assert_eq!(MotionName::exists(sign, number, &layout), Ok(()));
            }
            assert!(MotionName::exists('#', 0, &layout).is_err());
            assert!(MotionName::exists('&', 17, &layout).is_err());
        }
        for text in ["#1", "#1.", "#.CMD", "&1.Q5", "&1.VEL", "#1.SPEED", "1.CMD", "#-1.CMD"] {
            assert_eq!(MotionName::parse(text), None, "{text}");
        }
    }
}
