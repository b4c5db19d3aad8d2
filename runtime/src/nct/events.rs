//! Message flags as events (NCT 3.5, 3.6).

use plcc_abi::image::read_u16;
use plcc_abi::nct::NctTables;

use super::flag_row::FlagRow;
use crate::{Event, EventBody};

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
    indexed: Vec<String>,
    plain: Vec<String>,
    flags: FlagRow<COUNT>,
}

impl Messages {
    /// The messages of the program with these tables, whose image has this size.
    pub(super) fn new(tables: &NctTables, image_size: usize) -> Self {
        let flags = FlagRow::new(tables.outputs.get(BYTES).unwrap_or_default(), image_size);
        Self { indexed: tables.texts198.clone(), plain: tables.texts199.clone(), flags }
    }

    /// How many bytes of flags there are.
    pub(super) fn count(&self) -> usize {
        COUNT
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
            for bit in (0..8).filter(|bit| changed >> bit & 1 != 0) {
                let (texts, number) = match row.checked_sub(1) {
                    None => (&self.indexed, bit),
                    Some(row) => (&self.plain, row * 8 + bit),
                };
                let index =
                    (row == 0).then(|| read_u16(image, rh + (FIRST_INDEX + bit as u32) * 2).into());
                events.push(Event {
                    tick,
                    body: EventBody::Message {
                        name: None,
                        flag: Some(format!("Y{}{bit}", BYTES.start + row)),
                        state: if now >> bit & 1 != 0 { "on" } else { "off" },
                        text: texts.get(number).cloned().unwrap_or_default(),
                        index,
                    },
                });
            }
        }
    }
}
