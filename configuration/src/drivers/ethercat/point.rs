//! Addresses of points of EtherCAT terminals: `INTERFACE/TERMINAL/in|out/BYTE.BIT` for bits and
//! `INTERFACE/TERMINAL/in|out/BYTE:FORMAT` for numbers, such as `eth1/1/in/0.3` and `eth1/3/in/2:i16`.

use std::sync::Arc;

use crate::{Address, Mistake, Point, ValueFormat};

/// What a point is in the process data of its terminal. Numbers have their lowest byte first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ProcessValue {
    /// A bit of a byte, by its number from 0 for the lowest.
    Bit(u8),
    /// 8 bits without a sign.
    U8,
    /// 8 bits with a sign.
    I8,
    /// 16 bits without a sign.
    U16,
    /// 16 bits with a sign.
    I16,
    /// 32 bits without a sign.
    U32,
    /// 32 bits with a sign.
    I32,
    /// A floating-point number of 32 bits (IEEE 754).
    F32,
}

impl ProcessValue {
    /// The names in a configuration.
    const NAMES: [(&str, Self); 7] = [
        ("u8", Self::U8),
        ("i8", Self::I8),
        ("u16", Self::U16),
        ("i16", Self::I16),
        ("u32", Self::U32),
        ("i32", Self::I32),
        ("f32", Self::F32),
    ];

    /// How many bits it has.
    pub fn bits(self) -> u32 {
        match self {
            Self::Bit(_) => 1,
            Self::U8 | Self::I8 => 8,
            Self::U16 | Self::I16 => 16,
            Self::U32 | Self::I32 | Self::F32 => 32,
        }
    }

    /// The lowest and the highest value that it can hold.
    pub fn range(self) -> (f64, f64) {
        match self {
            Self::Bit(_) => (0.0, 1.0),
            Self::U8 => (0.0, u8::MAX.into()),
            Self::I8 => (i8::MIN.into(), i8::MAX.into()),
            Self::U16 => (0.0, u16::MAX.into()),
            Self::I16 => (i16::MIN.into(), i16::MAX.into()),
            Self::U32 => (0.0, u32::MAX.into()),
            Self::I32 => (i32::MIN.into(), i32::MAX.into()),
            Self::F32 => (f32::MIN.into(), f32::MAX.into()),
        }
    }

    /// All that are numbers, the smaller ones first.
    fn numbers() -> impl Iterator<Item = Self> {
        Self::NAMES.into_iter().map(|(_, value)| value)
    }

    /// The name in a configuration; a bit has none.
    fn name(self) -> Option<&'static str> {
        Self::NAMES.iter().find(|(_, value)| *value == self).map(|(name, _)| *name)
    }

    /// Whether it is a single bit.
    pub fn is_bit(self) -> bool {
        matches!(self, Self::Bit(_))
    }
}

/// A point of a terminal.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct EthercatPoint {
    /// The network interface by which the terminals are reached, such as `eth1`.
    pub interface: String,
    /// The position of the terminal, from 0 for the first behind the interface.
    pub terminal: u16,
    /// Whether it belongs to the outputs of the terminal, rather than to its inputs.
    pub is_output: bool,
    /// The number of its first byte in the inputs or outputs of the terminal, from 0.
    pub byte: u16,
    /// What it is.
    pub value: ProcessValue,
}

/// Reads a number that consists of digits alone.
fn number(text: &str) -> Option<u16> {
    text.parse().ok().filter(|_| text.bytes().all(|byte| byte.is_ascii_digit()))
}

impl EthercatPoint {
    /// Reads `INTERFACE/TERMINAL/in|out/BYTE.BIT` or `INTERFACE/TERMINAL/in|out/BYTE:FORMAT`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        let expected = || {
            format!(
                "`{text}` is not an address: INTERFACE/TERMINAL/in/BYTE.BIT or \
                 INTERFACE/TERMINAL/out/BYTE:FORMAT is expected, as in eth1/1/in/0.3 and eth1/3/out/0:i16"
            )
        };
        let parts: Vec<&str> = text.split('/').collect();
        let [interface, terminal, direction, place] = *parts.as_slice() else {
            return Err(expected());
        };
        // Longer names are none of Linux (IFNAMSIZ).
        if interface.is_empty() || interface.len() > 15 {
            return Err(expected());
        }
        let terminal = number(terminal).ok_or_else(|| {
            format!("`{terminal}` is not the position of a terminal; positions count from 0")
        })?;
        let is_output = match direction {
            "in" => false,
            "out" => true,
            _ => return Err(format!("`{direction}` is neither `in` nor `out` of a terminal")),
        };
        let (byte, value) = match (place.split_once(':'), place.split_once('.')) {
            (Some((byte, format)), _) => {
                let known = ProcessValue::NAMES.iter().find(|(name, _)| *name == format);
                let value = known.map(|&(_, value)| value).ok_or_else(|| {
                    let names = ProcessValue::NAMES.map(|(name, _)| name).join(", ");
                    format!("`{format}` is not a format; the formats are {names}")
                })?;
                (byte, value)
            }
            (None, Some((byte, bit))) => {
                let bit = number(bit).and_then(|bit| u8::try_from(bit).ok()).filter(|&bit| bit < 8);
                let bit = bit.ok_or_else(|| format!("`{place}`: a byte has the bits 0 to 7"))?;
                (byte, ProcessValue::Bit(bit))
            }
            (None, None) => {
                return Err(format!(
                    "`{place}` names a byte: BYTE.BIT is a bit of it, as in 0.3, and BYTE:FORMAT a number, as in 0:i16"
                ));
            }
        };
        let byte = number(byte).ok_or_else(|| format!("`{byte}` is not the number of a byte"))?;
        Ok(Self { interface: interface.into(), terminal, is_output, byte, value })
    }

    /// The point number `index` (from 0) of a range that begins here: the next bit, or the next number. `None` beyond the
    /// last byte that can be named.
    fn after(&self, index: usize) -> Option<Self> {
        let index = u32::try_from(index).ok()?;
        let at = self.first_bit().checked_add(index.checked_mul(self.value.bits())?)?;
        let value = match self.value {
            ProcessValue::Bit(_) => ProcessValue::Bit(u8::try_from(at % 8).ok()?),
            number => number,
        };
        Some(Self { byte: u16::try_from(at / 8).ok()?, value, ..self.clone() })
    }

    /// The number of its first bit in the inputs or outputs of the terminal.
    fn first_bit(&self) -> u32 {
        let bit = if let ProcessValue::Bit(bit) = self.value { bit.into() } else { 0 };
        u32::from(self.byte) * 8 + bit
    }

    /// The number of bytes that the inputs or outputs of the terminal must have at least.
    pub fn end(&self) -> usize {
        usize::from(self.byte) + self.value.bits().div_ceil(8) as usize
    }
}

impl Address for EthercatPoint {
    fn nth(&self, index: usize) -> Option<Arc<dyn Address>> {
        Some(Arc::new(self.after(index)?))
    }

    fn written(&self) -> Option<String> {
        let Self { interface, terminal, is_output, byte, value } = self;
        let side = if *is_output { "out" } else { "in" };
        let bit = match value {
            ProcessValue::Bit(bit) => format!(".{bit}"),
            _ => String::new(),
        };
        Some(format!("{interface}/{terminal}/{side}/{byte}{bit}"))
    }

    fn unfit(&self, is_input: bool, is_bit: bool) -> Option<String> {
        let why = match (is_input, self.is_output, is_bit, self.value.is_bit()) {
            (true, true, ..) => "is given from outside, but its address is an output of a terminal",
            (false, false, ..) => "goes outside, but its address is an input of a terminal",
            (_, _, true, false) => "is a bit, which needs a bit of a byte, as in 0.3",
            (_, _, false, true) => "is a number, which needs a format, as in 0:i16",
            _ => return None,
        };
        Some(why.into())
    }

    fn formats(&self) -> Option<(ValueFormat, Vec<ValueFormat>)> {
        let format = |value: ProcessValue| {
            let (low, high) = value.range();
            Some(ValueFormat { name: value.name()?, low, high })
        };
        Some((format(self.value)?, ProcessValue::numbers().filter_map(format).collect()))
    }
}

/// Finds what is wrong with points of terminals taken together: different interfaces, and outputs that share bits. An
/// entry has one mistake of each kind, however many points it has.
pub(super) fn mistakes(points: &[Point]) -> Vec<Mistake> {
    let own = points.iter().filter_map(|point| Some((point.address::<EthercatPoint>()?, point)));
    let mut own: Vec<_> = own.collect();
    let Some(&(first, of)) = own.first() else { return vec![] };
    let elsewhere = own.iter().filter(|(at, _)| at.interface != first.interface);
    let elsewhere = elsewhere.map(|(at, other)| Mistake {
        line: other.entry.line,
        message: format!(
            "`{}` is at {}, but the entry of line {} at {}: all terminals are at one interface",
            other.symbol.name, at.interface, of.entry.line, first.interface
        ),
    });
    let mut elsewhere: Vec<Mistake> = elsewhere.collect();
    elsewhere.dedup_by_key(|mistake| mistake.line);
    own.retain(|(at, _)| at.is_output);
    own.sort_by_key(|(at, point)| (at.terminal, at.first_bit(), point.entry.line));
    let mut sharing: Vec<Mistake> = vec![];
    // Of the points so far the one that ends last.
    let mut last: Option<(&EthercatPoint, &Point)> = None;
    for (at, point) in own {
        let ends = at.first_bit() + at.value.bits();
        let before = last.filter(|(other, _)| other.terminal == at.terminal);
        let before_ends = before.map_or(0, |(other, _)| other.first_bit() + other.value.bits());
        // What is the very same point has been found before.
        if let Some((other, before)) = before
            && at.first_bit() < before_ends
            && other != at
            && !sharing.iter().any(|mistake| mistake.line == point.entry.line)
        {
            let message = format!(
                "the point of `{}` shares bits with that of `{}`, of the entry of line {}",
                point.symbol.name, before.symbol.name, before.entry.line
            );
            sharing.push(Mistake { line: point.entry.line, message });
        }
        if ends > before_ends {
            last = Some((at, point));
        }
    }
    elsewhere.append(&mut sharing);
    elsewhere
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn an_address_names_a_bit_or_a_number_of_a_terminal() {
        let bit = EthercatPoint::parse("eth1/2/in/1.6").unwrap();
        let expected = EthercatPoint {
            interface: "eth1".into(),
            terminal: 2,
            is_output: false,
            byte: 1,
            value: ProcessValue::Bit(6),
        };
        assert_eq!(bit, expected);
        let after = |index| bit.after(index).map(|next| (next.byte, next.value));
        assert_eq!(after(1), Some((1, ProcessValue::Bit(7))));
        assert_eq!(after(2), Some((2, ProcessValue::Bit(0))));
        let number = EthercatPoint::parse("enp3s0/0/out/4:i16").unwrap();
        assert_eq!((number.is_output, number.end()), (true, 6));
        assert_eq!(number.after(3).map(|next| next.byte), Some(10));
        assert_eq!(EthercatPoint::parse("e/0/in/65535.7").unwrap().after(1), None);
        assert_eq!(EthercatPoint::parse("e/0/in/65535:u8").unwrap().after(usize::MAX), None);
        for text in [
            "",
            "eth1/1/in",
            "eth1/1/in/0",
            "eth1/1/in/0.8",
            "eth1/1/in/0.+1",
            "eth1/1/in/0:bit",
            "eth1/1/in/-1.0",
            "eth1/-1/in/0.0",
            "eth1/1/inout/0.0",
            "/1/in/0.0",
            "eth1/65536/in/0.0",
            "eth1/1/in/65536.0",
            "an-interface-with-a-long-name/1/in/0.0",
        ] {
            assert!(EthercatPoint::parse(text).is_err(), "{text}");
        }
    }
}
