//! What a program says to the outside.

use std::sync::Arc;

use serde::Serialize;

/// Something that happened in a tick.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Event {
    /// When, counted in base ticks from 0.
    pub tick: u64,
    /// What.
    #[serde(flatten)]
    pub body: EventBody,
}

/// What happened. The order of the fields is that of the JSON. PMAC's texts are those of its
/// program and shared, so that saying them allocates nothing.
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
    /// A PMI message (with `name`) or an NCT one (with `flag`) came or went.
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
        /// For NCT's `:198`, the register's value.
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
        text: Arc<str>,
        /// Where.
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
    },
}
