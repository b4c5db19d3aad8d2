//! Faults and messages (PMI 3.1.6, 3.1.7).

use plcc_abi::image::{read_i16, read_i32, read_u8};
use plcc_abi::pmi::{Announcement, TextItem, Type};

use crate::{Event, EventBody};

/// Characters that a fault's line on the screen has.
const WIDTH: usize = 40;

/// The faults and messages of a program.
#[derive(Clone, Debug)]
pub(super) struct Announcements {
    /// Faults first, then messages.
    all: Vec<Announcement>,
    /// How many of them are faults.
    faults: usize,
    /// The offset of each one's variable.
    offsets: Vec<u32>,
}

impl Announcements {
    pub(super) fn new(faults: &[Announcement], messages: &[Announcement]) -> Self {
        let all = [faults, messages].concat();
        let offsets = all.iter().map(|announcement| announcement.offset).collect();
        Self { all, faults: faults.len(), offsets }
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.all.len()
    }

    /// Tells what has changed since the scan before; `were_on` says which of them were on then,
    /// faults first.
    pub(super) fn update(
        &self,
        were_on: &mut [bool],
        image: &[u8],
        tick: u64,
        events: &mut Vec<Event>,
    ) {
        for ((number, &offset), was_on) in self.offsets.iter().enumerate().zip(were_on) {
            let on = read_u8(image, offset) != 0;
            if on != *was_on {
                *was_on = on;
                events.extend(self.event(number, on, image, tick));
            }
        }
    }

    /// The event that the announcement of a number is on or off from now on.
    fn event(&self, number: usize, on: bool, image: &[u8], tick: u64) -> Option<Event> {
        let announcement = self.all.get(number)?;
        let name = announcement.name.clone();
        let state = if on { "on" } else { "off" };
        let text = text(&announcement.text, image);
        let body = if number < self.faults {
            EventBody::Fault { name, state, text }
        } else {
            EventBody::Message { name: Some(name), flag: None, state, text, index: None }
        };
        Some(Event { tick, body })
    }
}

/// A variable's value.
pub(super) fn value(image: &[u8], ty: Type, offset: u32) -> i32 {
    match ty {
        Type::Logical => read_u8(image, offset).into(),
        Type::Integer => read_i16(image, offset).into(),
        Type::Long => read_i32(image, offset),
    }
}

/// A text with its values. Between words and a value stands one blank.
fn text(items: &[TextItem], image: &[u8]) -> String {
    let mut line = String::new();
    let mut behind_words = false;
    for item in items {
        match item {
            TextItem::Text(words) => line.push_str(words),
            TextItem::Value { ty, offset } => {
                if behind_words && !line.ends_with(' ') {
                    line.push(' ');
                }
                line.push_str(&value(image, *ty, *offset).to_string());
            }
        }
        behind_words = matches!(item, TextItem::Text(_));
    }
    match line.char_indices().nth(WIDTH) {
        Some((end, _)) => line.get(..end).unwrap_or_default().to_owned(),
        None => line,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(items: &[TextItem]) -> String {
        text(items, &[1, 5, 0, 0xFE, 0xFF, 0xFF, 0xFF])
    }

    fn words(words: &str) -> TextItem {
        TextItem::Text(words.into())
    }

    #[test]
    fn one_blank_stands_between_words_and_value() {
        let five = || TextItem::Value { ty: Type::Integer, offset: 1 };
        assert_eq!(made(&[words("ERROR CHANGING TOOL"), five()]), "ERROR CHANGING TOOL 5");
        assert_eq!(made(&[words("AREA "), five(), words("%")]), "AREA 5%");
        assert_eq!(made(&[five(), five()]), "55");
        let on = TextItem::Value { ty: Type::Logical, offset: 0 };
        let low = TextItem::Value { ty: Type::Long, offset: 3 };
        assert_eq!(made(&[words("A"), on, words(" B"), low]), "A 1 B -2");
    }

    #[test]
    fn a_text_ends_at_forty_characters() {
        let long = "Ä".repeat(39);
        let number = || TextItem::Value { ty: Type::Long, offset: 3 };
        assert_eq!(made(&[words(&long), number()]), format!("{long} "));
        assert_eq!(made(&[words(&"x".repeat(100))]), "x".repeat(40));
        assert_eq!(made(&[words(&"x".repeat(40))]), "x".repeat(40));
    }
}
