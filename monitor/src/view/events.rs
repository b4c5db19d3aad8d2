//! Faults, messages, texts.

use plcc_protocol::{Active, EventKind};
use serde::{Deserialize, Serialize};

/// What is announced now, and what has happened.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EventsView {
    /// Faults and messages that are on, in the order of the program.
    pub active: Vec<Active>,
    /// Events of the ticks that were looked at, the newest last.
    pub log: Vec<EventLine>,
    /// What PMAC's DISPLAY has left on the display, a line of text each.
    pub display: Vec<String>,
}

/// An event.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EventLine {
    /// The tick.
    pub tick: u64,
    /// The time of day at which that began, where it is known (UTC).
    pub time: Option<String>,
    /// What it is.
    pub kind: EventKind,
    /// The variable or flag of a fault or message.
    pub name: Option<String>,
    /// What a question about it names: the variable or flag, or a text in quotes that the program put out.
    pub asked: Option<String>,
    /// `on` or `off` of a fault or message.
    pub on: Option<bool>,
    /// The event in words.
    pub text: String,
}
