//! Serial data between the program's memory and the outside (NCT 2.2.2, Y605, Y606; cnc-side 3.25).

use serde::{Deserialize, Serialize};

use super::state::State;
use super::{Nct, Step};
use crate::event::Told;

/// How many characters go in a tick.
const CHARACTERS: u64 = 16;
/// How many bytes of memory there are.
const MEMORY: usize = 1000;

/// A transfer that lasts: from where in the memory, how many characters, and since which tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Transfer {
    first: u16,
    count: u16,
    since: u64,
}

impl Transfer {
    fn is_over(self, tick: u64) -> bool {
        tick.saturating_sub(self.since) >= u64::from(self.count).div_ceil(CHARACTERS)
    }

    fn bytes(self) -> impl Iterator<Item = usize> {
        let first = usize::from(self.first);
        first..first + usize::from(self.count)
    }
}

/// Both directions.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Serial {
    sends: Option<Transfer>,
    /// I606.
    pub(super) sent: bool,
    receives: Option<Transfer>,
    /// I607.
    pub(super) received: bool,
    /// How many characters of the table's text were received.
    taken: u32,
}

impl Nct {
    pub(super) fn serial(&self, state: &mut State, step: &mut Step<'_, '_>) {
        let tick = step.now.tick;
        let variables = &self.variables;
        let serial = &mut state.serial;
        if !step.y(60, 6) {
            (serial.sends, serial.sent) = (None, false);
        } else if !serial.sent {
            let [first, count] =
                variables.sent_record.map(|word| word.read(step.now.access) as u16);
            let sends = *serial.sends.get_or_insert(Transfer { first, count, since: tick });
            if sends.is_over(tick) {
                let read = |byte: usize| variables.memory(byte, step.now.access);
                state.sent.push(sends.bytes().take(MEMORY).map(read).collect());
                (serial.sends, serial.sent) = (None, true);
                step.now.tell(Told::Serial);
            }
        }
        if step.y(60, 7) {
            serial.received = false;
        }
        let text = self.setup.table.serial.as_ref().map_or("", |text| &text.value);
        let rest = text.chars().skip(serial.taken as usize);
        if !step.y(60, 5) {
            serial.receives = None;
        } else if !serial.received {
            let [first, count] =
                variables.received_record.map(|word| word.read(step.now.access) as u16);
            if serial.receives.is_none() && rest.clone().take(count.into()).count() >= count.into()
            {
                serial.receives = Some(Transfer { first, count, since: tick });
            }
            if let Some(receives) = serial.receives.filter(|receives| receives.is_over(tick)) {
                for (byte, character) in receives.bytes().zip(rest) {
                    // A character is a byte of Latin-1.
                    let code = u8::try_from(character).unwrap_or(b'?');
                    variables.set_memory(byte, code, step.now.access);
                }
                (serial.receives, serial.received) = (None, true);
                serial.taken = serial.taken.saturating_add(receives.count.into());
            }
        }
    }
}
