//! Faults, messages and texts (PMI 3.1.6, 3.1.7; NCT `:198`, `:199`; PMAC's SEND and DISPLAY).

use std::collections::BTreeSet;

use plcc_runtime::{DisplayedText, Event, EventBody};

use super::Session;
use crate::Refusal;
use crate::view::{Active, EventKind, EventLine, EventsView};

/// The display of a PMAC: lines and characters of a line.
const DISPLAY_LINES: usize = 2;
const DISPLAY_CHARACTERS: usize = 40;

impl Session<'_> {
    pub(super) fn events_view(&mut self) -> Result<EventsView, Refusal> {
        let shown = self.time.shown;
        self.debugger()?;
        let past: Vec<Event> =
            self.events.iter().filter(|event| event.tick <= shown).cloned().collect();
        let active = self.active(&past)?;
        let log =
            past.iter().map(|event| EventLine { time: self.time_of(event.tick), ..line(event) });
        let log = log.collect();
        let display = display(&past);
        Ok(EventsView { active, log, display })
    }

    /// How many faults and messages are on at the end of the tick that is shown. It comes from the events alone, so that it
    /// can stand around every screen.
    pub(super) fn announced(&self) -> usize {
        let mut on = BTreeSet::new();
        for event in self.events.iter().filter(|event| event.tick <= self.time.shown) {
            let (EventBody::Fault { state, .. } | EventBody::Message { state, .. }) = &event.body
            else {
                continue;
            };
            let Some(name) = name_of(&event.body) else { continue };
            if *state == "on" {
                on.insert(name);
            } else {
                on.remove(name);
            }
        }
        on.len()
    }

    /// What is announced at the end of the tick that is shown.
    fn active(&mut self, past: &[Event]) -> Result<Vec<Active>, Refusal> {
        let since = |name: &str| {
            let own = past.iter().rev().find(|event| name_of(&event.body) == Some(name))?;
            Some(own.tick)
        };
        let program = self.debugger()?.program().shared();
        if program.announces_by_image() {
            let Some(image) = self.shown_image()? else { return Ok(vec![]) };
            let active = program.announced(&image).into_iter().map(|one| Active {
                kind: if one.is_fault { EventKind::Fault } else { EventKind::Message },
                since: since(&one.name),
                text: one.text,
                name: one.name,
            });
            return Ok(active.collect());
        }
        let mut active: Vec<Active> = vec![];
        for event in past {
            let (EventBody::Message { state, text, index, .. }, Some(name)) =
                (&event.body, name_of(&event.body))
            else {
                continue;
            };
            active.retain(|one| one.name != name);
            if *state == "on" {
                let index = index.map(|index| format!(" {index:X}")).unwrap_or_default();
                active.push(Active {
                    kind: EventKind::Message,
                    name: name.to_owned(),
                    text: format!("{text}{index}"),
                    since: Some(event.tick),
                });
            }
        }
        active.sort_by(|a, b| plcc_abi::natural_cmp(&a.name, &b.name));
        Ok(active)
    }
}

fn name_of(body: &EventBody) -> Option<&str> {
    match body {
        EventBody::Fault { name, .. } => Some(name),
        EventBody::Message { name, flag, .. } => name.as_deref().or(flag.as_deref()),
        _ => None,
    }
}

/// The text that a statement has put out; `None` for a value, which is not a text of the program.
fn text_of(body: &EventBody) -> Option<&str> {
    match body {
        EventBody::Send { text, .. }
        | EventBody::Command { text, .. }
        | EventBody::Macro { text }
        | EventBody::Display { text: DisplayedText::Text(text), .. } => Some(text),
        _ => None,
    }
}

/// An event in a line.
fn line(event: &Event) -> EventLine {
    let (kind, on, text) = match &event.body {
        EventBody::Fault { name, state, text } => {
            (EventKind::Fault, Some(*state == "on"), format!("{name} {state}: {text}"))
        }
        EventBody::Message { state, text, index, .. } => {
            let name = name_of(&event.body).unwrap_or_default();
            let index = index.map(|index| format!(" {index:X}")).unwrap_or_default();
            (EventKind::Message, Some(*state == "on"), format!("{name} {state}: {text}{index}"))
        }
        EventBody::Send { text, port } => {
            let port = port.as_deref().unwrap_or_default();
            (EventKind::Text, None, format!("SEND{port} {text}"))
        }
        EventBody::Display { text, position } => {
            let position = position.map(|at| format!(" {at}")).unwrap_or_default();
            (EventKind::Text, None, format!("DISPLAY{position} {text}"))
        }
        EventBody::Command { text, error } => {
            let error = error.as_deref().map(|error| format!(": {error}")).unwrap_or_default();
            (EventKind::Command, None, format!("COMMAND {text}{error}"))
        }
        EventBody::Macro { text } => (EventKind::Command, None, format!("MACRO {text}")),
        EventBody::Simulator(event) => (EventKind::Text, None, format!("simulator: {event}")),
        EventBody::Motion(report) => (EventKind::Text, None, report.to_string()),
        EventBody::Stop { code, file, line } => {
            let place = match (file, line) {
                (Some(file), Some(line)) => format!(" at line {line} of {file}"),
                _ => String::new(),
            };
            (EventKind::Stop, None, format!("stopped: {code}{place}"))
        }
    };
    let text = plcc_abi::printable(&text).replace(['\n', '\t'], " ");
    let name = name_of(&event.body).map(str::to_owned);
    let asked = name.clone().or_else(|| text_of(&event.body).map(|text| format!("\"{text}\"")));
    EventLine { tick: event.tick, time: None, kind, name, asked, on, text }
}

/// What DISPLAY has left on the display, if it was used.
fn display(past: &[Event]) -> Vec<String> {
    let mut cells = vec![' '; DISPLAY_LINES * DISPLAY_CHARACTERS];
    let mut is_used = false;
    for event in past {
        let EventBody::Display { text, position } = &event.body else { continue };
        is_used = true;
        let from = position.and_then(|at| usize::try_from(at).ok()).unwrap_or(0);
        for (cell, c) in cells.iter_mut().skip(from).zip(text.to_string().chars()) {
            *cell = c;
        }
    }
    if !is_used {
        return vec![];
    }
    cells.chunks(DISPLAY_CHARACTERS).map(|line| line.iter().collect()).collect()
}
