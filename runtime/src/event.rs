//! Events (`--events`): what a program and its control report to the outside, each a JSON object.
//!
//! Making an event allocates no memory, since the thread that runs the ticks does it: names and texts are
//! shared with what the executive keeps, and a text with values in it has room of a fixed size.

use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

use serde::{Serialize, Serializer};

use crate::display_field;
pub use crate::motion_report::MotionReport;

/// Something that happened in a tick.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Event {
    /// The base tick in which it happened, counted from 0.
    pub tick: u64,
    /// What happened.
    #[serde(flatten)]
    pub body: EventBody,
}

impl Event {
    /// The event with another name for its variable, where it has one and `rename` knows another.
    pub fn renamed(mut self, rename: impl Fn(&str) -> Option<String>) -> Self {
        let (name, flag) = match &mut self.body {
            EventBody::Fault { name, .. } => (Some(name), None),
            EventBody::Message { name, flag, .. } => (name.as_mut(), flag.as_mut()),
            _ => (None, None),
        };
        for name in name.into_iter().chain(flag) {
            if let Some(other) = rename(name) {
                *name = other.into();
            }
        }
        self
    }
}

/// What happened. The fields stand in the order in which JSON has them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum EventBody {
    /// A PMI fault came or went.
    Fault {
        /// Its variable.
        name: Arc<str>,
        /// `on` or `off`.
        state: &'static str,
        /// Its text.
        text: AnnouncedText,
    },
    /// A PMI message (which has a `name`) or an NCT message (which has a `flag`) came or went.
    Message {
        /// The PMI variable.
        #[serde(skip_serializing_if = "Option::is_none")]
        name: Option<Arc<str>>,
        /// The NCT flag.
        #[serde(skip_serializing_if = "Option::is_none")]
        flag: Option<Arc<str>>,
        /// `on` or `off`.
        state: &'static str,
        /// Its text.
        text: AnnouncedText,
        /// For texts of NCT's `:198`, the value of the register that chooses the text.
        #[serde(skip_serializing_if = "Option::is_none")]
        index: Option<i64>,
    },
    /// PMAC's SEND.
    Send {
        /// What is sent.
        text: Arc<str>,
        /// The port, for SENDS and SENDP.
        #[serde(skip_serializing_if = "Option::is_none")]
        port: Option<Arc<str>>,
    },
    /// PMAC's DISPLAY.
    Display {
        /// What is shown.
        text: DisplayedText,
        /// The number of the character on the display at which the text begins.
        #[serde(skip_serializing_if = "Option::is_none")]
        position: Option<i64>,
    },
    /// PMAC's COMMAND.
    Command {
        /// The command.
        text: Arc<str>,
        /// Why it was refused.
        #[serde(skip_serializing_if = "Option::is_none")]
        error: Option<Arc<str>>,
    },
    /// A write to PMAC's MACRO ring.
    Macro {
        /// What is written.
        text: Arc<str>,
    },
    /// The simulated other side tells something (`--simulate`).
    Simulator(SimulatorEvent),
    /// The program was stopped.
    Stop {
        /// Why.
        code: String,
        /// The source with the statement that is to blame.
        #[serde(skip_serializing_if = "Option::is_none")]
        file: Option<String>,
        /// Its line, from 1.
        #[serde(skip_serializing_if = "Option::is_none")]
        line: Option<u32>,
    },
    /// What a PMAC's simulated motion reports (`--simulate`). It has kinds of its own.
    #[serde(untagged)]
    Motion(MotionReport),
}

/// What the simulated other side tells. The fields stand in the order in which JSON has them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "what", rename_all = "lowercase")]
pub enum SimulatorEvent {
    /// A block begins.
    Block {
        /// Its line in the part program.
        #[serde(skip_serializing_if = "Option::is_none")]
        line: Option<u32>,
        /// The number of an entered block.
        #[serde(skip_serializing_if = "Option::is_none")]
        entry: Option<u32>,
    },
    /// The part program has ended.
    End,
    /// A request was refused.
    Refused {
        /// What was requested.
        #[serde(rename = "for")]
        requested: Arc<str>,
        /// Why it was refused.
        why: Arc<str>,
    },
    /// A jog has come to a limit.
    Limit {
        /// The axis.
        axis: Arc<str>,
        /// `+` or `-`.
        direction: &'static str,
    },
    /// A block has waited for this for 500 ticks.
    Waits {
        /// A variable's name.
        #[serde(rename = "for")]
        awaited: Arc<str>,
    },
    /// The serial line has sent a record (NCT).
    Serial {
        /// Its bytes, two hexadecimal digits each.
        data: Arc<str>,
    },
}

impl fmt::Display for SimulatorEvent {
    /// For people.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Block { line: Some(line), .. } => write!(f, "block of line {line}"),
            Self::Block { entry, .. } => write!(f, "entered block {}", entry.unwrap_or(0)),
            Self::End => f.write_str("end of the part program"),
            Self::Refused { requested, why } => write!(f, "{requested} is refused: {why}"),
            Self::Limit { axis, direction } => write!(f, "{axis} is at its limit {direction}"),
            Self::Waits { awaited } => write!(f, "the block waits for {awaited}"),
            Self::Serial { data } => write!(f, "the serial line sends {data}"),
        }
    }
}

/// The text of a fault or message.
#[derive(Clone, Debug)]
pub enum AnnouncedText {
    /// A text of the program.
    Text(Arc<str>),
    /// A text with values of variables in it.
    Line(Line),
}

impl Deref for AnnouncedText {
    type Target = str;

    fn deref(&self) -> &str {
        match self {
            Self::Text(text) => text,
            Self::Line(line) => line.as_str(),
        }
    }
}

impl fmt::Display for AnnouncedText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self)
    }
}

impl PartialEq for AnnouncedText {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl Eq for AnnouncedText {}

impl From<&str> for AnnouncedText {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl Serialize for AnnouncedText {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self)
    }
}

/// A line of at most 40 characters, as the control's screen shows it (PMI 3.1.6). What is written after the
/// 40th is cut off.
#[derive(Clone, Debug)]
pub struct Line {
    /// The characters in UTF-8.
    bytes: [u8; Self::WIDTH * 4],
    length: u8,
    characters: u8,
}

impl Line {
    /// How many characters a line has room for.
    pub const WIDTH: usize = 40;

    /// The characters that were written.
    pub fn as_str(&self) -> &str {
        let bytes = self.bytes.get(..usize::from(self.length)).unwrap_or_default();
        // Only whole characters are put into it.
        std::str::from_utf8(bytes).unwrap_or_default()
    }
}

impl Default for Line {
    fn default() -> Self {
        Self { bytes: [0; Self::WIDTH * 4], length: 0, characters: 0 }
    }
}

impl fmt::Write for Line {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let room = Self::WIDTH - usize::from(self.characters);
        for character in text.chars().take(room) {
            let at = usize::from(self.length);
            // No character has more than four bytes, so that all of them have room.
            if let Some(place) = self.bytes.get_mut(at..at + character.len_utf8()) {
                character.encode_utf8(place);
                self.length += character.len_utf8() as u8;
                self.characters += 1;
            }
        }
        Ok(())
    }
}

/// What PMAC's DISPLAY shows. A value is converted to text when the event is written, since that
/// allocates memory, which a scan must not do.
#[derive(Clone, Debug)]
pub enum DisplayedText {
    /// A text of the program.
    Text(Arc<str>),
    /// A value.
    Value {
        /// The value.
        value: f64,
        /// The characters of its field, the point among them.
        width: u32,
        /// Digits after the point.
        decimals: u32,
    },
}

impl fmt::Display for DisplayedText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Value { value, width, decimals } => {
                f.write_str(&display_field::field(*value, *width, *decimals))
            }
        }
    }
}

impl PartialEq for DisplayedText {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Text(a), Self::Text(b)) => a == b,
            _ => self.to_string() == other.to_string(),
        }
    }
}

impl Eq for DisplayedText {}

impl From<&str> for DisplayedText {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl Serialize for DisplayedText {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Text(text) => serializer.serialize_str(text),
            Self::Value { .. } => serializer.collect_str(self),
        }
    }
}
