//! Faults, messages and texts (PMI 3.1.6, 3.1.7; NCT `:198`, `:199`; PMAC's SEND and DISPLAY).

use std::collections::BTreeSet;

use plcc_abi::Tables;
use plcc_abi::pmi::{Announcement, TextItem, Type};
use plcc_runtime::{Event, EventBody};

use super::Session;
use crate::Refusal;
use crate::view::{Active, EventKind, EventLine, EventsView};

/// The characters of a fault's text that are shown (PMI 3.1.6).
const MAX_CHARACTERS: usize = 40;
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
        let log = past.iter().map(line).collect();
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
        if let Some(Tables::Pmi(tables)) = self.tables() {
            let (faults, messages) = (tables.faults.clone(), tables.messages.clone());
            let (tick, executive_tick) = (self.time.shown, self.executive_tick);
            let debugger = self.debugger()?;
            if tick >= debugger.history().known() {
                return Ok(vec![]);
            }
            let image = if executive_tick == Some(tick) {
                debugger.history_mut().executive().image().to_vec()
            } else {
                debugger.go_to_end_of_tick(tick)?;
                debugger.image()?
            };
            if executive_tick != Some(tick) {
                self.executive_tick = None;
            }
            let of = |list: Vec<Announcement>, kind: EventKind| {
                let image = &image;
                let is_on =
                    move |one: &Announcement| integer(image, one.offset, Type::Logical) != 0;
                list.into_iter().filter(is_on).map(move |one| (one, kind)).collect::<Vec<_>>()
            };
            let mut active = of(faults, EventKind::Fault);
            active.extend(of(messages, EventKind::Message));
            return Ok(active
                .into_iter()
                .map(|(one, kind)| Active {
                    kind,
                    since: since(&one.name),
                    text: text_of(&one.text, &image),
                    name: one.name,
                })
                .collect());
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

/// The text of a fault or message with the present values.
fn text_of(items: &[TextItem], image: &[u8]) -> String {
    let mut text = String::new();
    for item in items {
        match item {
            TextItem::Text(words) => text.push_str(words),
            TextItem::Value { ty, offset } => {
                if !text.is_empty() && !text.ends_with(' ') {
                    text.push(' ');
                }
                text.push_str(&integer(image, *offset, *ty).to_string());
            }
        }
    }
    text.chars().take(MAX_CHARACTERS).collect()
}

fn integer(image: &[u8], offset: u32, ty: Type) -> i64 {
    let bytes = |count: usize| image.get(offset as usize..)?.get(..count);
    match ty {
        Type::Logical => bytes(1).and_then(|b| b.first().copied()).map_or(0, i64::from),
        Type::Integer => {
            let two = bytes(2).and_then(|bytes| bytes.try_into().ok());
            two.map_or(0, |bytes| i64::from(i16::from_le_bytes(bytes)))
        }
        Type::Long => {
            let four = bytes(4).and_then(|bytes| bytes.try_into().ok());
            four.map_or(0, |bytes| i64::from(i32::from_le_bytes(bytes)))
        }
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
        EventBody::Stop { code, file, line } => {
            let place = match (file, line) {
                (Some(file), Some(line)) => format!(" at line {line} of {file}"),
                _ => String::new(),
            };
            (EventKind::Stop, None, format!("stopped: {code}{place}"))
        }
    };
    let text = text.chars().map(|c| if c.is_control() { '\u{FFFD}' } else { c }).collect();
    EventLine { tick: event.tick, kind, on, text }
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
