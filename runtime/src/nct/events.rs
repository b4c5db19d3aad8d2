//! Message flags as events (NCT 3.5, 3.6).

use std::sync::Arc;

use plcc_abi::image::read_u16;
use plcc_abi::nct::NctTables;

use super::flag_row::FlagRow;
use crate::{Announced, AnnouncedText, Event, EventBody};

/// The bytes of the output image whose bits are messages: Y700 to Y707, indexed by RH090 to
/// RH097, then Y710 to Y897.
const BYTES: std::ops::Range<usize> = 70..90;
/// How many bytes these are.
const COUNT: usize = BYTES.end - BYTES.start;
/// The register that belongs to Y700.
const FIRST_INDEX: u32 = 90;

/// The messages of a program.
#[derive(Clone, Debug)]
pub(super) struct Messages {
    flags: FlagRow<COUNT>,
    /// Name and text of each flag, in their order.
    texts: Vec<(Arc<str>, Arc<str>)>,
}

impl Messages {
    /// The messages of the program with these tables, whose image has this size.
    pub(super) fn new(tables: &NctTables, image_size: usize) -> Self {
        let flags = FlagRow::new(tables.outputs.get(BYTES).unwrap_or_default(), image_size);
        let text = |row: usize, bit: usize| match row.checked_sub(1) {
            None => tables.texts198.get(bit),
            Some(row) => tables.texts199.get(row * 8 + bit),
        };
        let named = |(row, bit)| {
            let name = format!("Y{}{bit}", BYTES.start + row);
            (name.into(), text(row, bit).map_or("", String::as_str).into())
        };
        let all = (0..COUNT).flat_map(|row| (0..8).map(move |bit| (row, bit)));
        Self { flags, texts: all.map(named).collect() }
    }

    /// How many bytes of flags there are.
    pub(super) fn count(&self) -> usize {
        COUNT
    }

    /// The messages that are on in an image, in which RH000 has the offset `rh`. Of those whose text a register chooses, the
    /// value of that stands after the text.
    pub(super) fn on(&self, image: &[u8], rh: u32) -> Vec<Announced> {
        let bits = self.flags.read(image).into_iter().enumerate();
        let bits = bits.flat_map(|(row, byte)| (0..8).map(move |bit| (row, bit, byte >> bit & 1)));
        let on = bits.zip(&self.texts).filter(|((_, _, bit), _)| *bit != 0);
        let shown = on.map(|((row, bit, _), (name, text))| {
            let index = (row == 0).then(|| format!(" {:X}", index(image, rh, bit)));
            let text = format!("{text}{}", index.unwrap_or_default());
            Announced { is_fault: false, name: name.to_string(), text }
        });
        shown.collect()
    }

    /// Appends an event for each flag that is not as it was at the last call, in the order of the flags.
    /// `shown` holds the flags' bytes as they were then; `rh` is the offset of RH000 in the image.
    pub(super) fn update(
        &self,
        shown: &mut [u8],
        image: &[u8],
        rh: u32,
        tick: u64,
        events: &mut Vec<Event>,
    ) {
        let now = self.flags.read(image);
        if *shown == now {
            return;
        }
        for (row, (now, shown)) in now.into_iter().zip(shown).enumerate() {
            let changed = now ^ *shown;
            if changed == 0 {
                continue;
            }
            *shown = now;
            let texts = self.texts.iter().skip(row * 8).take(8).enumerate();
            for (bit, (name, text)) in texts.filter(|(bit, _)| changed >> bit & 1 != 0) {
                let index = (row == 0).then(|| index(image, rh, bit).into());
                events.push(Event {
                    tick,
                    body: EventBody::Message {
                        name: None,
                        flag: Some(Arc::clone(name)),
                        state: if now >> bit & 1 != 0 { "on" } else { "off" },
                        text: AnnouncedText::Text(Arc::clone(text)),
                        index,
                    },
                });
            }
        }
    }
}

/// The register that chooses the text of the bit of Y700 to Y707; `rh` is the offset of RH000 in the image.
fn index(image: &[u8], rh: u32, bit: usize) -> u16 {
    read_u16(image, rh + (FIRST_INDEX + bit as u32) * 2)
}
