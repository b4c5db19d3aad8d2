//! The table of symbols: what each variable is called, what it is, and where it lies.
//!
//! An entry has [`SYMBOL_SIZE`] bytes:
//!
//! | offset | bytes | holds |
//! | --- | --- | --- |
//! | `0x00` | 4 | offset of the name in the file |
//! | `0x04` | 4 | length of the name in bytes |
//! | `0x08` | 8 | place of the value: offset in the process image (32 bits), type, first bit, width in bits, 0 |
//! | `0x10` | 8 | place of the physical lines, the same; a width of 0 where there are none |
//! | `0x18` | 4 | number of elements |
//! | `0x1C` | 4 | number of the slot for inputs plus one; 0 where the variable can't be given |
//! | `0x20` | 1 | direction |
//! | `0x21` | 1 | class: 0 a bit, 1 an integer, 2 a number with a fraction |
//! | `0x22` | 2 | 0 |
//! | `0x24` | 4 | length in bytes of the aliases, which follow the name in the file, with a blank between two |
//! | `0x28` | 4 | offset of the unit's name in the file |
//! | `0x2C` | 4 | length of the unit's name in bytes |

pub use plcc_abi::place::{Direction, Number, Place, Type};

use crate::layout::SYMBOL_SIZE;

/// A place as the eight bytes of an entry.
fn encode_place(place: Place) -> [u8; 8] {
    let [a, b, c, d] = place.offset.to_le_bytes();
    let ty = Type::ALL.iter().position(|&ty| ty == place.ty).unwrap_or(0) as u8;
    [a, b, c, d, ty, place.bit, place.width, 0]
}

/// The place in the eight bytes at the beginning of `bytes`; `None` where they are not valid.
fn decode_place(bytes: &[u8]) -> Option<Place> {
    let [a, b, c, d, ty, bit, width, _] = *bytes.first_chunk()?;
    let ty = *Type::ALL.get(usize::from(ty))?;
    let valid = match ty {
        Type::Bits | Type::SignedBits | Type::Bcd => {
            (1..=32).contains(&width) && bit.saturating_add(width) <= 40
        }
        _ => true,
    };
    let offset = u32::from_le_bytes([a, b, c, d]);
    valid.then_some(Place { offset, ty, bit, width })
}

/// A variable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Symbol {
    /// The name in the language's canonical spelling.
    pub name: String,
    /// Other names: those that people gave to it, the one that is shown first, and that of its line.
    pub aliases: Vec<String>,
    /// Where the value lies that the program sees.
    pub value: Place,
    /// Where the physical lines of an input or an output lie, if they are another place than the value. The
    /// lines of an output have its safe value when the program has been stopped.
    pub line: Option<Place>,
    /// How many elements follow one another; 1 for a variable that is not an array.
    pub elements: u32,
    /// Whether it is an input, an output, or neither.
    pub direction: Direction,
    /// By which slot another process can give the value, if it can.
    pub slot: Option<u32>,
    /// The unit of the value; empty where none is known.
    pub unit: String,
}

impl Symbol {
    /// The place that drivers read or write: the physical lines of an input or output, or the value if there are
    /// none.
    pub fn outside(&self) -> Place {
        self.line.unwrap_or(self.value)
    }

    /// Whether it is called so: by its name, or by an alias.
    pub fn is_called(&self, name: &str) -> bool {
        self.name == name || self.aliases.iter().any(|alias| alias == name)
    }

    /// The class: 0 a bit, 1 an integer, 2 a number with a fraction.
    pub fn class(&self) -> u8 {
        match self.value.ty {
            Type::Double => 2,
            _ => u8::from(!self.value.is_bit()),
        }
    }

    /// Whether a value can be given for it: an integer within the range of its lines, or any finite number
    /// where it has a fraction.
    pub fn takes(&self, value: Number) -> bool {
        match (self.outside().range(), value) {
            (Some(range), Number::Int(number)) => range.contains(&number),
            (None, number) => number.float().is_finite(),
            (Some(_), Number::Float(_)) => false,
        }
    }

    /// Appends the entry to `entries`, and its texts to `texts`, which will begin at `texts_at` in the
    /// file.
    pub fn encode(&self, entries: &mut Vec<u8>, texts: &mut Vec<u8>, texts_at: usize) {
        let mut text = |text: &str| {
            let at = (texts_at + texts.len()) as u32;
            texts.extend(text.as_bytes());
            [at.to_le_bytes(), (text.len() as u32).to_le_bytes()]
        };
        let name = text(&self.name);
        let [_, aliases] = text(&self.aliases.join(" "));
        let unit = text(&self.unit);
        let direction = Direction::ALL.iter().position(|&one| one == self.direction).unwrap_or(0);
        entries.extend(name.concat());
        entries.extend(encode_place(self.value));
        entries.extend(self.line.map_or([0; 8], encode_place));
        entries.extend(self.elements.to_le_bytes());
        entries.extend(self.slot.map_or(0, |slot| slot + 1).to_le_bytes());
        entries.extend([direction as u8, self.class(), 0, 0]);
        entries.extend(aliases);
        entries.extend(unit.concat());
    }

    /// Reads an entry; `text` gives the text at an offset of the file, of a length. `None` where the entry
    /// is not valid.
    pub(crate) fn decode(entry: &[u8], text: impl Fn(u32, u32) -> Vec<u8>) -> Option<Self> {
        if entry.len() != SYMBOL_SIZE {
            return None;
        }
        let number = |at: usize| {
            let bytes = entry.get(at..).and_then(|tail| tail.first_chunk());
            bytes.map_or(0, |bytes| u32::from_le_bytes(*bytes))
        };
        let aliases =
            String::from_utf8(text(number(0).saturating_add(number(4)), number(0x24))).ok()?;
        let text = |at: usize| String::from_utf8(text(number(at), number(at + 4))).ok();
        let line = entry.get(0x10..).filter(|line| line.get(6).is_some_and(|&width| width != 0));
        let line = match line {
            Some(line) => Some(decode_place(line)?),
            None => None,
        };
        Some(Self {
            name: text(0)?,
            aliases: aliases.split_whitespace().map(str::to_owned).collect(),
            value: decode_place(entry.get(0x08..)?)?,
            line,
            elements: number(0x18),
            slot: number(0x1C).checked_sub(1),
            direction: *Direction::ALL.get(usize::from(*entry.get(0x20)?))?,
            unit: text(0x28)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_read_back() {
        let symbols = [
            Symbol {
                name: "READY".into(),
                aliases: vec!["GO".into(), "START".into()],
                value: Place::bytes(7, Type::Logical),
                line: Some(Place::bits(64, Type::Bits, 3, 1)),
                elements: 1,
                direction: Direction::Input,
                slot: Some(0),
                unit: String::new(),
            },
            Symbol {
                name: "@FRO".into(),
                aliases: vec![],
                value: Place::bytes(8, Type::Integer),
                line: None,
                elements: 4,
                direction: Direction::Internal,
                slot: None,
                unit: "%".into(),
            },
        ];
        let (mut entries, mut texts) = (vec![], vec![]);
        symbols.iter().for_each(|symbol| symbol.encode(&mut entries, &mut texts, 100));
        assert_eq!(entries.len(), 2 * SYMBOL_SIZE);
        let text = |at: u32, length: u32| texts[at as usize - 100..][..length as usize].to_vec();
        let read: Vec<_> =
            entries.chunks(SYMBOL_SIZE).map(|entry| Symbol::decode(entry, text).unwrap()).collect();
        assert_eq!(read, symbols);
        assert!(symbols[0].takes(Number::Int(1)) && !symbols[0].takes(Number::Int(2)));
        assert!(!symbols[1].takes(Number::Float(1.0)));
        entries[0x0C] = 99;
        assert_eq!(Symbol::decode(&entries[..SYMBOL_SIZE], text), None);
    }
}
