//! The ticks of a record as bytes: what acted on the control before each, what happened in it, and the hash after it.
//!
//! The bytes of a tick are its entries, each the byte `80` (hexadecimal) and an [`Entry`] by postcard, and then two
//! bytes, the higher one first: 15 bits of the [hash](super::state_hash) after the tick. The highest
//! bit of these two is 0, which tells them from an entry. A tick in which nothing happens takes two bytes.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::MAX_TICKS;
use super::recorded_event::RecordedEvent;
use plcc_runtime::{ClockDecision, Event, Place, Setting, Stop, VariableKey};

/// The byte before an entry.
const ENTRY: u8 = 0x80;

/// What acts on a control from outside before a tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Action {
    /// A variable is set: by the stimulus, or by somebody.
    Write(VariableKey, Setting),
    /// An input or output is forced, or (`None`) its force ends.
    Force(VariableKey, Option<Setting>),
    /// So many ticks are skipped: they are not run, but their time passes.
    Skip(u64),
    /// The physical outputs take their safe values.
    SafeOutputs,
}

/// Why a program was stopped, as a record holds it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordedStop {
    /// See [`Stop::code`].
    pub code: String,
    /// See [`Stop::message`].
    pub message: String,
    /// The file and the line (from 1) of the statement that is to blame.
    pub place: Option<(String, u32)>,
}

impl From<&Stop> for RecordedStop {
    fn from(stop: &Stop) -> Self {
        Self {
            code: stop.code.clone(),
            message: stop.message.clone(),
            place: stop.place.as_ref().map(|place| (place.file.clone(), place.line)),
        }
    }
}

impl From<RecordedStop> for Stop {
    fn from(stop: RecordedStop) -> Self {
        let place = stop.place.map(|(file, line)| Place { file, line });
        Self { code: stop.code, message: stop.message, place }
    }
}

/// An entry of a tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Entry<'a> {
    /// Something acted on the control.
    Action(Action),
    /// The clock decided something.
    Clock(ClockDecision),
    /// The program or its control reported something.
    Event(RecordedEvent<'a>),
    /// The program was stopped in this tick.
    Stop(Cow<'a, RecordedStop>),
}

impl Entry<'_> {
    /// Appends the entry. It allocates nothing but more room for `out`.
    pub(super) fn write(&self, out: &mut Vec<u8>) {
        out.push(ENTRY);
        let length = out.len();
        match postcard::to_extend(self, std::mem::take(out)) {
            Ok(bytes) => *out = bytes,
            // Writing to memory does not fail.
            Err(_) => out.truncate(length.saturating_sub(1)),
        }
    }
}

/// Ends the bytes of a tick.
pub(super) fn end_tick(hash: u16, out: &mut Vec<u8>) {
    out.extend((hash & 0x7FFF).to_be_bytes());
}

/// A recorded tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TickRecord {
    /// Its number.
    pub tick: u64,
    /// What acted on the control before it, in order.
    pub actions: Vec<Action>,
    /// What the clock decided in it.
    pub decisions: Vec<ClockDecision>,
    /// What was reported in it, in order, but for the event `stop`.
    pub events: Vec<Event>,
    /// 15 bits of the hash after it.
    pub hash: u16,
    /// Why the program was stopped in it, if it was.
    pub stop: Option<RecordedStop>,
}

impl TickRecord {
    /// Whether the watchdog stopped one of its scans in the middle. Such a tick can't be replayed, since nobody
    /// knows how far the scan had come.
    pub fn is_cut(&self) -> bool {
        self.decisions.contains(&ClockDecision::Cut)
    }
}

/// Reads the ticks of a block. `next` is the number of the first one, unless skipped ticks come before it, and
/// becomes the number of the tick after the last one. `None` if the bytes are not ticks, or if they are more
/// ticks than lie between two checkpoints.
pub(super) fn read_ticks(mut bytes: &[u8], next: &mut u64) -> Option<Vec<TickRecord>> {
    let mut ticks = vec![];
    let mut now = TickRecord::default();
    while let Some((&first, rest)) = bytes.split_first() {
        if first != ENTRY {
            let (hash, rest) = bytes.split_first_chunk::<2>()?;
            now.hash = u16::from_be_bytes(*hash);
            if now.hash & !0x7FFF != 0 || ticks.len() as u64 >= MAX_TICKS {
                return None;
            }
            now.tick = *next;
            now.events.iter_mut().for_each(|event| event.tick = *next);
            *next = next.checked_add(1)?;
            ticks.push(std::mem::take(&mut now));
            bytes = rest;
            continue;
        }
        let (entry, rest): (Entry<'_>, _) = postcard::take_from_bytes(rest).ok()?;
        bytes = rest;
        match entry {
            Entry::Action(action) => {
                if let Action::Skip(count) = action {
                    *next = next.checked_add(count)?;
                }
                now.actions.push(action);
            }
            Entry::Clock(decision) => now.decisions.push(decision),
            Entry::Event(event) => now.events.push(Event { tick: 0, body: event.into() }),
            Entry::Stop(stop) => now.stop = Some(stop.into_owned()),
        }
    }
    // Actions after the last tick belong to the end of the run; `read_trailing` reads them.
    Some(ticks)
}

/// Reads what acted on a control after its last tick, and why it was stopped then, if it was. `None` if the
/// bytes are something else.
pub(super) fn read_trailing(mut bytes: &[u8]) -> Option<(Vec<Action>, Option<RecordedStop>)> {
    let (mut actions, mut stopped) = (vec![], None);
    while let Some((&first, rest)) = bytes.split_first() {
        if first != ENTRY {
            return None;
        }
        let (entry, rest): (Entry<'_>, _) = postcard::take_from_bytes(rest).ok()?;
        bytes = rest;
        match entry {
            Entry::Action(action) => actions.push(action),
            Entry::Stop(stop) => stopped = Some(stop.into_owned()),
            Entry::Clock(_) | Entry::Event(_) => {}
        }
    }
    Some((actions, stopped))
}
