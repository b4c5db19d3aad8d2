//! What a program tells of itself while a test runs.

use plcc_runtime::{EventBody, Value};

/// The most texts and values that are remembered of a test.
const MAX_TOLD: usize = 1000;

/// What the program told in a test that was run to its end, whatever failed in it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Told {
    /// The texts of faults, messages, SEND, DISPLAY and COMMAND, each once.
    pub texts: Vec<String>,
    /// The code with which the program was stopped.
    pub stop: Option<String>,
    /// The first `never`, `always` or `after` that was broken, by its number in [`Plan::invariants`](crate::Plan::invariants).
    pub broken: Option<usize>,
    /// For each of the variables that were asked for the values that it had.
    pub values: Vec<Vec<Value>>,
}

impl Told {
    /// Nothing yet, of a test in which this many variables are looked at.
    pub(crate) fn of(variables: usize) -> Self {
        Self { values: vec![vec![]; variables], ..Self::default() }
    }

    /// An event has come, with its text.
    pub(crate) fn hear(&mut self, body: &EventBody, text: &str) {
        let is_over = matches!(
            body,
            EventBody::Fault { state: "off", .. } | EventBody::Message { state: "off", .. }
        );
        if !is_over && self.texts.len() < MAX_TOLD && !self.texts.iter().any(|told| told == text) {
            self.texts.push(text.to_owned());
        }
    }

    /// A variable has a value at the end of a tick.
    pub(crate) fn see(&mut self, variable: usize, value: Value) {
        if let Some(values) = self.values.get_mut(variable)
            && values.len() < MAX_TOLD
            && !values.contains(&value)
        {
            values.push(value);
        }
    }
}

/// The text of an event.
pub(crate) fn text_of(body: &EventBody) -> Option<String> {
    Some(match body {
        EventBody::Fault { text, .. } | EventBody::Message { text, .. } => text.to_string(),
        EventBody::Send { text, .. } | EventBody::Command { text, .. } => text.to_string(),
        EventBody::Display { text, .. } => text.to_string(),
        _ => return None,
    })
}
