//! Events as people read them.

use plcc_runtime::{Event, EventBody};

/// An event in a line.
pub(super) fn shown(event: &Event) -> String {
    let tick = event.tick;
    match &event.body {
        EventBody::Fault { name, state, text } => {
            format!("tick {tick}: fault {name} {state}: {text}")
        }
        EventBody::Message { name, flag, state, text, .. } => {
            let name = name.as_deref().or(flag.as_deref()).unwrap_or_default();
            format!("tick {tick}: message {name} {state}: {text}")
        }
        EventBody::Send { text, .. } => format!("tick {tick}: SEND {text}"),
        EventBody::Display { text, .. } => format!("tick {tick}: DISPLAY {text}"),
        EventBody::Command { text, error } => match error {
            Some(error) => format!("tick {tick}: COMMAND {text}: {error}"),
            None => format!("tick {tick}: COMMAND {text}"),
        },
        EventBody::Macro { text } => format!("tick {tick}: MACRO {text}"),
        EventBody::Simulator(event) => format!("tick {tick}: simulator: {event}"),
        EventBody::Motion(report) => format!("tick {tick}: {report}"),
        EventBody::Stop { code, .. } => format!("tick {tick}: stopped: {code}"),
    }
}
