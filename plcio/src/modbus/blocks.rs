//! Points that lie together in a table, so that they are read or written by one request.

use plcc_image::configuration::{Format, ModbusAddress, Table};

/// A point in a block: its index in the hub, and its address.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Member {
    pub(super) index: usize,
    pub(super) address: ModbusAddress,
}

/// Neighbouring points of one table of one unit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Block {
    pub(super) unit: u8,
    pub(super) table: Table,
    pub(super) start: u16,
    pub(super) count: u16,
    pub(super) members: Vec<Member>,
}

/// The most registers that a request may write, by the Modbus specification; it may read 125.
const MAX_REGISTERS: u16 = 123;
/// The most bits that a request may write, by the Modbus specification; it may read 2000.
const MAX_BITS: u16 = 1968;

/// Makes blocks of points. A point between two others that no entry names divides blocks, since a device may
/// not have it.
pub(super) fn blocks(mut members: Vec<Member>) -> Vec<Block> {
    members.sort_by_key(|Member { address, .. }| (address.unit, address.table, address.number));
    let mut blocks: Vec<Block> = vec![];
    for member in members {
        let ModbusAddress { unit, table, number, format, .. } = member.address;
        let most =
            if matches!(table, Table::Coil | Table::Discrete) { MAX_BITS } else { MAX_REGISTERS };
        let end = u32::from(number) + u32::from(format.registers());
        if let Some(last) = blocks.last_mut()
            && (last.unit, last.table) == (unit, table)
            && number >= last.start
            && u32::from(number) <= u32::from(last.start) + u32::from(last.count)
            && end - u32::from(last.start) <= u32::from(most)
        {
            last.count = last.count.max((end - u32::from(last.start)) as u16);
            last.members.push(member);
            continue;
        }
        let count = format.registers();
        blocks.push(Block { unit, table, start: number, count, members: vec![member] });
    }
    blocks
}

impl Block {
    /// The place of a member in the block.
    fn at(&self, member: &Member) -> usize {
        usize::from(member.address.number - self.start)
    }

    /// The value of a member among the registers of the block; `None` where they are too few.
    pub(super) fn value(&self, member: &Member, registers: &[u16]) -> Option<f64> {
        decode(member.address.format, registers.get(self.at(member)..)?)
    }

    /// Puts the value of a member into the registers of the block. Gives whether the registers can have it.
    pub(super) fn put(&self, member: &Member, value: f64, registers: &mut [u16]) -> bool {
        registers
            .get_mut(self.at(member)..)
            .is_some_and(|registers| encode(member.address.format, value, registers))
    }
}

/// The value that registers hold in a format; `None` where they are too few.
pub(super) fn decode(format: Format, registers: &[u16]) -> Option<f64> {
    let word = |swapped: bool| {
        let [a, b, ..] = *registers else { return None };
        let (high, low) = if swapped { (b, a) } else { (a, b) };
        Some(u32::from(high) << 16 | u32::from(low))
    };
    let first = *registers.first()?;
    Some(match format {
        Format::Bit => f64::from(first != 0),
        Format::U16 => first.into(),
        Format::I16 => (first as i16).into(),
        Format::U32(swapped) => word(swapped)?.into(),
        Format::I32(swapped) => (word(swapped)? as i32).into(),
        Format::F32(swapped) => f32::from_bits(word(swapped)?).into(),
        Format::BitOf(bit) => f64::from(first >> bit & 1),
    })
}

/// Puts a value into registers in a format. Gives whether they can have it; if not, they stay.
pub(super) fn encode(format: Format, value: f64, registers: &mut [u16]) -> bool {
    let mut put_word = |swapped: bool, word: u32| {
        let [a, b, ..] = registers else { return false };
        let (high, low) = ((word >> 16) as u16, word as u16);
        (*a, *b) = if swapped { (low, high) } else { (high, low) };
        true
    };
    let rounded = value.round();
    let within = |low: f64, high: f64| (low..=high).contains(&rounded);
    match format {
        Format::U32(swapped) => within(0.0, u32::MAX.into()) && put_word(swapped, rounded as u32),
        Format::I32(swapped) => {
            within(i32::MIN.into(), i32::MAX.into()) && put_word(swapped, rounded as i32 as u32)
        }
        Format::F32(swapped) => put_word(swapped, (value as f32).to_bits()),
        Format::Bit | Format::U16 | Format::I16 | Format::BitOf(_) => {
            let Some(first) = registers.first_mut() else { return false };
            match format {
                Format::BitOf(bit) => {
                    *first = *first & !(1 << bit) | u16::from(value != 0.0) << bit
                }
                Format::Bit => *first = u16::from(value != 0.0),
                Format::I16 if within(i16::MIN.into(), i16::MAX.into()) => {
                    *first = rounded as i16 as u16
                }
                Format::U16 if within(0.0, u16::MAX.into()) => *first = rounded as u16,
                _ => return false,
            }
            true
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing)]

    use super::*;

    fn member(index: usize, text: &str) -> Member {
        Member { index, address: ModbusAddress::parse(text, true, false).unwrap() }
    }

    #[test]
    fn neighbours_are_one_block() {
        let texts = [
            "h/1/holding/4:f32",
            "h/1/holding/2",
            "h/1/holding/3",
            "h/1/holding/9:bit3",
            "h/1/holding/9:bit4",
            "h/2/coil/0",
            "h/1/coil/0",
        ];
        let blocks = blocks(texts.iter().enumerate().map(|(n, text)| member(n, text)).collect());
        let shown: Vec<_> =
            blocks.iter().map(|b| (b.unit, b.start, b.count, b.members.len())).collect();
        assert_eq!(shown, [(1, 0, 1, 1), (1, 2, 4, 3), (1, 9, 1, 2), (2, 0, 1, 1)]);
        let many = super::blocks((0..200).map(|n| member(n, &format!("h/1/input/{n}"))).collect());
        assert_eq!(many.iter().map(|block| block.count).collect::<Vec<_>>(), [123, 77]);
    }

    #[test]
    fn values_come_back_from_registers() {
        for (format, value, registers) in [
            (Format::U16, 65535.0, [0xFFFF, 0]),
            (Format::I16, -2.0, [0xFFFE, 0]),
            (Format::U32(false), 65536.0, [1, 0]),
            (Format::U32(true), 65536.0, [0, 1]),
            (Format::I32(false), -2.0, [0xFFFF, 0xFFFE]),
            (Format::F32(false), 1.5, [0x3FC0, 0]),
            (Format::F32(true), 1.5, [0, 0x3FC0]),
            (Format::BitOf(5), 1.0, [0x20, 0]),
        ] {
            let mut made = [0; 2];
            assert!(encode(format, value, &mut made));
            assert_eq!((made, decode(format, &made)), (registers, Some(value)), "{format:?}");
        }
        let mut same = [7; 2];
        for (format, value) in [
            (Format::U16, -1.0),
            (Format::I16, 4e4),
            (Format::U32(true), -1.0),
            (Format::U16, f64::NAN),
        ] {
            assert!(!encode(format, value, &mut same));
        }
        assert_eq!((same, decode(Format::F32(true), &[1])), ([7; 2], None));
    }
}
