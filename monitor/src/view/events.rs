//! Faults, messages, texts.

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

/// A fault or message that is on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Active {
    /// Fault or message.
    pub kind: EventKind,
    /// The variable or flag.
    pub name: String,
    /// Its text with the present values.
    pub text: String,
    /// The tick in which it came; `None` if that is not known.
    pub since: Option<u64>,
}

/// What an event is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EventKind {
    /// A fault.
    Fault,
    /// A message.
    Message,
    /// A text that the program sent or displayed.
    Text,
    /// A command or another action of the program.
    Command,
    /// The program was stopped.
    Stop,
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
