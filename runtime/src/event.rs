//! Events (`--events`): what a program and its control report to the outside, each a JSON object.

use std::fmt;
use std::sync::Arc;

use serde::{Serialize, Serializer};

use crate::pmac::display;

/// Something that happened in a tick.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Event {
    /// The base tick in which it happened, counted from 0.
    pub tick: u64,
    /// What happened.
    #[serde(flatten)]
    pub body: EventBody,
}

/// What happened. The fields stand in the order in which JSON has them. PMAC's texts are shared with
/// the program's tables, so that making an event allocates no memory.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum EventBody {
    /// A PMI fault came or went.
    Fault {
        /// Its variable.
        name: String,
        /// `on` or `off`.
        state: &'static str,
        /// Its text.
        text: String,
    },
    /// A PMI message (which has a `name`) or an NCT message (which has a `flag`) came or went.
    Message {
        /// The PMI variable.
        #[serde(skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// The NCT flag.
        #[serde(skip_serializing_if = "Option::is_none")]
        flag: Option<String>,
        /// `on` or `off`.
        state: &'static str,
        /// Its text.
        text: String,
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
        /// Digits behind the point.
        decimals: u32,
    },
}

impl fmt::Display for DisplayedText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Value { value, width, decimals } => {
                f.write_str(&display::field(*value, *width, *decimals))
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
