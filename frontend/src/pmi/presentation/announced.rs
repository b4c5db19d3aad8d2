//! Faults and messages (PMI 3.1.6, 3.1.7).

use plcc_abi::pmi::{Announcement, PmiTables, TextItem, Type};

use crate::presentation::Announced;

/// The characters of a text that are shown (PMI 3.1.6).
const MAX_CHARACTERS: usize = 40;

/// What is on in an image: faults, then messages.
pub(super) fn announced(tables: &PmiTables, image: &[u8]) -> Vec<Announced> {
    let of = |list: &[Announcement], is_fault: bool| -> Vec<Announced> {
        let on = list.iter().filter(|one| integer(image, one.offset, Type::Logical) != 0);
        let shown = on.map(|one| Announced {
            is_fault,
            name: one.name.clone(),
            text: text_of(&one.text, image),
        });
        shown.collect()
    };
    [of(&tables.faults, true), of(&tables.messages, false)].concat()
}

/// All faults and messages, with the words of their texts.
pub(super) fn announcements(tables: &PmiTables) -> Vec<Announced> {
    let of = |list: &[Announcement], is_fault: bool| -> Vec<Announced> {
        let words = |item: &TextItem| match item {
            TextItem::Text(words) => Some(words.trim().to_owned()),
            TextItem::Value { .. } => None,
        };
        let shown = list.iter().map(|one| Announced {
            is_fault,
            name: one.name.clone(),
            text: one.text.iter().filter_map(words).collect::<Vec<_>>().join(" "),
        });
        shown.collect()
    };
    [of(&tables.faults, true), of(&tables.messages, false)].concat()
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
