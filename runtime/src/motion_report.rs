//! What the simulated motion of a PMAC reports, as events.

use std::fmt;
use std::sync::Arc;

use serde::ser::SerializeMap;
use serde::{Deserialize, Serialize, Serializer};

/// A report of motors, coordinate systems and motion programs. As JSON each has a kind of its own; [`EventBody`]
/// writes it so.
///
/// [`EventBody`]: crate::EventBody
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MotionReport {
    /// A command was refused.
    Refused {
        /// The command.
        text: Arc<str>,
        /// The motor, of a command for motors.
        motor: Option<u32>,
        /// The coordinate system, of other commands.
        system: Option<u32>,
        /// The control's number of the error.
        error: Arc<str>,
    },
    /// The answer to a query.
    Answer {
        /// The answer.
        text: Arc<str>,
    },
    /// A motion program has started, ended or stopped.
    Program {
        /// The coordinate system that runs it.
        system: u32,
        /// Its number.
        program: u32,
        /// `started`, `ended`, `stopped` or `error`.
        state: Arc<str>,
        /// Why it stopped.
        reason: Option<Arc<str>>,
        /// The source with the statement that was calculated last.
        file: Option<Arc<str>>,
        /// Its line, from 1.
        line: Option<u32>,
    },
    /// A motor has come to its zero behind a homing search.
    Home {
        /// The motor.
        motor: u32,
    },
}

/// The same in a form for records.
#[derive(Serialize, Deserialize)]
enum Recorded {
    Refused(String, Option<u32>, Option<u32>, String),
    Answer(String),
    Program(u32, u32, String, Option<String>, Option<String>, Option<u32>),
    Home(u32),
}

impl Serialize for MotionReport {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let owned = |text: &Option<Arc<str>>| text.as_deref().map(str::to_owned);
        if !serializer.is_human_readable() {
            let recorded = match self {
                Self::Refused { text, motor, system, error } => {
                    Recorded::Refused(text.to_string(), *motor, *system, error.to_string())
                }
                Self::Answer { text } => Recorded::Answer(text.to_string()),
                Self::Program { system, program, state, reason, file, line } => {
                    let (reason, file) = (owned(reason), owned(file));
                    Recorded::Program(*system, *program, state.to_string(), reason, file, *line)
                }
                Self::Home { motor } => Recorded::Home(*motor),
            };
            return recorded.serialize(serializer);
        }
        let mut map = serializer.serialize_map(None)?;
        match self {
            Self::Refused { text, motor, system, error } => {
                map.serialize_entry("kind", "refused")?;
                map.serialize_entry("text", &**text)?;
                if let Some(motor) = motor {
                    map.serialize_entry("motor", motor)?;
                }
                if let Some(system) = system {
                    map.serialize_entry("system", system)?;
                }
                map.serialize_entry("error", &**error)?;
            }
            Self::Answer { text } => {
                map.serialize_entry("kind", "answer")?;
                map.serialize_entry("text", &**text)?;
            }
            Self::Program { system, program, state, reason, file, line } => {
                map.serialize_entry("kind", "program")?;
                map.serialize_entry("system", system)?;
                map.serialize_entry("program", program)?;
                map.serialize_entry("state", &**state)?;
                if let Some(reason) = reason {
                    map.serialize_entry("reason", &**reason)?;
                }
                if let Some(file) = file {
                    map.serialize_entry("file", &**file)?;
                }
                if let Some(line) = line {
                    map.serialize_entry("line", line)?;
                }
            }
            Self::Home { motor } => {
                map.serialize_entry("kind", "home")?;
                map.serialize_entry("motor", motor)?;
            }
        }
        map.end()
    }
}

impl<'de> Deserialize<'de> for MotionReport {
    /// From the form for records.
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let shared = |text: Option<String>| text.map(Into::into);
        Ok(match Recorded::deserialize(deserializer)? {
            Recorded::Refused(text, motor, system, error) => {
                Self::Refused { text: text.into(), motor, system, error: error.into() }
            }
            Recorded::Answer(text) => Self::Answer { text: text.into() },
            Recorded::Program(system, program, state, reason, file, line) => {
                let (reason, file) = (shared(reason), shared(file));
                Self::Program { system, program, state: state.into(), reason, file, line }
            }
            Recorded::Home(motor) => Self::Home { motor },
        })
    }
}

impl MotionReport {
    /// Whether it tells that something went wrong.
    pub fn is_warning(&self) -> bool {
        match self {
            Self::Refused { .. } => true,
            Self::Program { state, .. } => &**state == "error",
            Self::Answer { .. } | Self::Home { .. } => false,
        }
    }
}

impl fmt::Display for MotionReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused { text, motor, system, error } => {
                let (sign, number) = match (motor, system) {
                    (Some(motor), _) => ('#', *motor),
                    (None, system) => ('&', system.unwrap_or(1)),
                };
                write!(f, "{sign}{number}{text} refused: {error}")
            }
            Self::Answer { text } => write!(f, "answer {text}"),
            Self::Program { system, program, state, reason, file, line } => {
                write!(f, "&{system} PROG {program} {state}")?;
                if let Some(reason) = reason {
                    write!(f, ": {reason}")?;
                }
                if let (Some(file), Some(line)) = (file, line) {
                    write!(f, " at line {line} of {file}")?;
                }
                Ok(())
            }
            Self::Home { motor } => write!(f, "#{motor} is home"),
        }
    }
}
