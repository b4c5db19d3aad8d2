//! Points that lie together in a table, so that they are read or written by one request.

use std::ops::Range;

use plcc_configuration::drivers::modbus::{ModbusAddress, Table};

use super::registers::{decode, encode};

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
    /// The places of a member's registers in the block.
    fn place(&self, member: &Member) -> Range<usize> {
        let at = usize::from(member.address.number - self.start);
        at..at + usize::from(member.address.format.registers())
    }

    /// The value of a member among the registers of the block; `None` where they are too few, or hold no number.
    pub(super) fn value(&self, member: &Member, registers: &[u16]) -> Option<f64> {
        decode(member.address.format, registers.get(self.place(member))?)
    }

    /// Puts the value of a member into the registers of the block. Returns whether the registers can have it.
    pub(super) fn put(&self, member: &Member, value: f64, registers: &mut [u16]) -> bool {
        registers
            .get_mut(self.place(member))
            .is_some_and(|registers| encode(member.address.format, value, registers))
    }

    /// The places in the block that some of its members, in their order, take up together: those that follow each other
    /// are one piece, or with `single` only those that share a register.
    pub(super) fn pieces<'a>(
        &self,
        members: impl Iterator<Item = &'a Member>,
        single: bool,
    ) -> Vec<Range<usize>> {
        let mut pieces: Vec<Range<usize>> = vec![];
        for place in members.map(|member| self.place(member)) {
            match pieces.last_mut() {
                Some(last) if place.start < last.end || place.start == last.end && !single => {
                    last.end = last.end.max(place.end);
                }
                _ => pieces.push(place),
            }
        }
        pieces
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
    fn what_is_left_out_divides_a_block() {
        let texts =
            ["h/1/holding/2", "h/1/holding/3:f32", "h/1/holding/5:bit3", "h/1/holding/5:bit4"];
        let blocks = blocks(texts.iter().enumerate().map(|(n, text)| member(n, text)).collect());
        let block = &blocks[0];
        let pieces = |without: usize, single| {
            let members = block.members.iter().filter(|member| member.index != without);
            block.pieces(members, single)
        };
        let all = std::slice::from_ref(&(0..4)).to_vec();
        assert_eq!(pieces(9, false), all);
        assert_eq!(pieces(1, false), [0..1, 3..4]);
        assert_eq!(pieces(2, false), all);
        assert_eq!(pieces(9, true), [0..1, 1..3, 3..4]);
    }
}
