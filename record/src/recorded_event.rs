//! Events as a record holds them. It has the values of PMAC's DISPLAY as numbers, since making a text of
//! them allocates memory, which the thread that runs the ticks must not do.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use plcc_runtime::event::MotionReport;
use plcc_runtime::{DisplayedText, EventBody, SimulatorEvent};

/// An event's body; the fields are those of [`EventBody`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum RecordedEvent<'a> {
    Fault {
        name: Cow<'a, str>,
        on: bool,
        text: Cow<'a, str>,
    },
    Message {
        name: Option<Cow<'a, str>>,
        flag: Option<Cow<'a, str>>,
        on: bool,
        text: Cow<'a, str>,
        index: Option<i64>,
    },
    Send {
        text: Cow<'a, str>,
        port: Option<Cow<'a, str>>,
    },
    Display {
        text: Cow<'a, str>,
        position: Option<i64>,
    },
    DisplayValue {
        value: f64,
        width: u32,
        decimals: u32,
        position: Option<i64>,
    },
    Command {
        text: Cow<'a, str>,
        error: Option<Cow<'a, str>>,
    },
    Macro {
        text: Cow<'a, str>,
    },
    SimulatorBlock {
        line: Option<u32>,
        entry: Option<u32>,
    },
    SimulatorEnd,
    SimulatorRefused {
        requested: Cow<'a, str>,
        why: Cow<'a, str>,
    },
    SimulatorLimit {
        axis: Cow<'a, str>,
        positive: bool,
    },
    SimulatorWaits {
        awaited: Cow<'a, str>,
    },
    Motion(MotionReport),
    SimulatorSerial {
        data: Cow<'a, str>,
    },
    Stop {
        code: Cow<'a, str>,
        file: Option<Cow<'a, str>>,
        line: Option<u32>,
    },
}

fn borrowed(text: &str) -> Cow<'_, str> {
    Cow::Borrowed(text)
}

fn state(on: bool) -> &'static str {
    if on { "on" } else { "off" }
}

impl<'a> From<&'a EventBody> for RecordedEvent<'a> {
    fn from(body: &'a EventBody) -> Self {
        match body {
            EventBody::Fault { name, state, text } => {
                Self::Fault { name: borrowed(name), on: *state == "on", text: borrowed(text) }
            }
            EventBody::Message { name, flag, state, text, index } => Self::Message {
                name: name.as_deref().map(borrowed),
                flag: flag.as_deref().map(borrowed),
                on: *state == "on",
                text: borrowed(text),
                index: *index,
            },
            EventBody::Send { text, port } => {
                Self::Send { text: borrowed(text), port: port.as_deref().map(borrowed) }
            }
            EventBody::Display { text: DisplayedText::Text(text), position } => {
                Self::Display { text: borrowed(text), position: *position }
            }
            EventBody::Display {
                text: DisplayedText::Value { value, width, decimals },
                position,
            } => Self::DisplayValue {
                value: *value,
                width: *width,
                decimals: *decimals,
                position: *position,
            },
            EventBody::Command { text, error } => {
                Self::Command { text: borrowed(text), error: error.as_deref().map(borrowed) }
            }
            EventBody::Macro { text } => Self::Macro { text: borrowed(text) },
            EventBody::Simulator(event) => match event {
                SimulatorEvent::Block { line, entry } => {
                    Self::SimulatorBlock { line: *line, entry: *entry }
                }
                SimulatorEvent::End => Self::SimulatorEnd,
                SimulatorEvent::Refused { requested, why } => {
                    Self::SimulatorRefused { requested: borrowed(requested), why: borrowed(why) }
                }
                SimulatorEvent::Limit { axis, direction } => {
                    Self::SimulatorLimit { axis: borrowed(axis), positive: *direction == "+" }
                }
                SimulatorEvent::Waits { awaited } => {
                    Self::SimulatorWaits { awaited: borrowed(awaited) }
                }
                SimulatorEvent::Serial { data } => Self::SimulatorSerial { data: borrowed(data) },
            },
            EventBody::Motion(report) => Self::Motion(report.clone()),
            EventBody::Stop { code, file, line } => Self::Stop {
                code: borrowed(code),
                file: file.as_deref().map(borrowed),
                line: *line,
            },
        }
    }
}

impl From<RecordedEvent<'_>> for EventBody {
    fn from(event: RecordedEvent<'_>) -> Self {
        let owned = |text: Option<Cow<'_, str>>| text.map(Cow::into_owned);
        let shared = |text: Option<Cow<'_, str>>| text.map(|text| (*text).into());
        match event {
            RecordedEvent::Fault { name, on, text } => {
                Self::Fault { name: (*name).into(), state: state(on), text: (&*text).into() }
            }
            RecordedEvent::Message { name, flag, on, text, index } => Self::Message {
                name: shared(name),
                flag: shared(flag),
                state: state(on),
                text: (&*text).into(),
                index,
            },
            RecordedEvent::Send { text, port } => {
                Self::Send { text: (*text).into(), port: shared(port) }
            }
            RecordedEvent::Display { text, position } => {
                Self::Display { text: (&*text).into(), position }
            }
            RecordedEvent::DisplayValue { value, width, decimals, position } => {
                Self::Display { text: DisplayedText::Value { value, width, decimals }, position }
            }
            RecordedEvent::Command { text, error } => {
                Self::Command { text: (*text).into(), error: shared(error) }
            }
            RecordedEvent::Macro { text } => Self::Macro { text: (*text).into() },
            RecordedEvent::SimulatorBlock { line, entry } => {
                Self::Simulator(SimulatorEvent::Block { line, entry })
            }
            RecordedEvent::SimulatorEnd => Self::Simulator(SimulatorEvent::End),
            RecordedEvent::SimulatorRefused { requested, why } => {
                let (requested, why) = ((*requested).into(), (*why).into());
                Self::Simulator(SimulatorEvent::Refused { requested, why })
            }
            RecordedEvent::SimulatorLimit { axis, positive } => {
                let direction = if positive { "+" } else { "-" };
                Self::Simulator(SimulatorEvent::Limit { axis: (*axis).into(), direction })
            }
            RecordedEvent::SimulatorWaits { awaited } => {
                Self::Simulator(SimulatorEvent::Waits { awaited: (*awaited).into() })
            }
            RecordedEvent::SimulatorSerial { data } => {
                Self::Simulator(SimulatorEvent::Serial { data: (*data).into() })
            }
            RecordedEvent::Motion(report) => Self::Motion(report),
            RecordedEvent::Stop { code, file, line } => {
                Self::Stop { code: code.into(), file: owned(file), line }
            }
        }
    }
}
