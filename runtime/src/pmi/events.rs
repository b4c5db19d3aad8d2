//! Faults and messages (PMI 3.1.6, 3.1.7).

use std::fmt::Write;
use std::sync::Arc;

use plcc_abi::image::{read_i16, read_i32, read_u8};
use plcc_abi::pmi::{Announcement, TextItem, Type};

use crate::event::Line;
use crate::{AnnouncedText, Event, EventBody};

/// A fault or message, with what its events share with it.
#[derive(Clone, Debug)]
struct Announced {
    name: Arc<str>,
    is_fault: bool,
    items: Vec<TextItem>,
    /// Its text, if no value of a variable stands in it.
    fixed: Option<Arc<str>>,
}

impl Announced {
    fn new(announcement: &Announcement, is_fault: bool) -> Self {
        let Announcement { name, offset: _, text: items } = announcement;
        let is_fixed = items.iter().all(|item| matches!(item, TextItem::Text(_)));
        let fixed = is_fixed.then(|| line(items, &[]).as_str().into());
        Self { name: name.as_str().into(), is_fault, items: items.clone(), fixed }
    }

    /// Its text with the values that variables have now.
    fn text(&self, image: &[u8]) -> AnnouncedText {
        match &self.fixed {
            Some(text) => AnnouncedText::Text(Arc::clone(text)),
            None => AnnouncedText::Line(line(&self.items, image)),
        }
    }
}

/// The faults and messages of a program, faults first.
#[derive(Clone, Debug)]
pub(super) struct Announcements {
    all: Vec<Announced>,
    /// The offset of each one's variable.
    offsets: Vec<u32>,
}

impl Announcements {
    pub(super) fn new(faults: &[Announcement], messages: &[Announcement]) -> Self {
        let faults = faults.iter().map(|fault| (fault, true));
        let all = faults.chain(messages.iter().map(|message| (message, false)));
        let offsets = all.clone().map(|(announcement, _)| announcement.offset).collect();
        Self { offsets, all: all.map(|(each, is_fault)| Announced::new(each, is_fault)).collect() }
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

    /// What is on in an image.
    pub(super) fn on(&self, image: &[u8]) -> Vec<crate::Announced> {
        let each = self.all.iter().zip(&self.offsets);
        let on = each.filter(|(_, offset)| read_u8(image, **offset) != 0);
        let shown = on.map(|(announced, _)| crate::Announced {
            is_fault: announced.is_fault,
            name: announced.name.to_string(),
            text: announced.text(image).to_string(),
        });
        shown.collect()
    }

    /// The event that the announcement of a number is on or off from now on.
    fn event(&self, number: usize, on: bool, image: &[u8], tick: u64) -> Option<Event> {
        let announced = self.all.get(number)?;
        let name = Arc::clone(&announced.name);
        let state = if on { "on" } else { "off" };
        let text = announced.text(image);
        let body = if announced.is_fault {
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

/// A text with its values. Between words and a value stands one blank. It allocates no memory.
fn line(items: &[TextItem], image: &[u8]) -> Line {
    let mut line = Line::default();
    let mut behind_words = false;
    // A line takes everything; what does not fit is cut off.
    for item in items {
        match item {
            TextItem::Text(words) => {
                let _ = line.write_str(words);
            }
            TextItem::Value { ty, offset } => {
                let blank = if behind_words && !line.as_str().ends_with(' ') { " " } else { "" };
                let _ = write!(line, "{blank}{}", value(image, *ty, *offset));
            }
        }
        behind_words = matches!(item, TextItem::Text(_));
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(items: &[TextItem]) -> String {
        line(items, &[1, 5, 0, 0xFE, 0xFF, 0xFF, 0xFF]).as_str().to_owned()
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
        // Characters of four bytes are characters, too.
        assert_eq!(made(&[words(&"\u{1F6D1}".repeat(50)), number()]), "\u{1F6D1}".repeat(40));
    }
}
