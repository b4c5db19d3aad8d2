//! Addresses: where loads and stores go in the process image, and which local bits belong to a word.

use std::ops::Range;

use crate::{RegionId, Type, Value};

/// The part of an address that is computed at run time: an element of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Index {
    /// The number of the element, an `i32` that is taken as unsigned.
    pub value: Value,
    /// The distance between elements in bytes.
    pub scale: u32,
    /// How many elements there are, at least one. An index of `count` or more is taken as 0, so an
    /// access stays in its region whatever the index is. If an index out of bounds is an error of
    /// the language, the front end emits a comparison and a trap before the access.
    pub count: u32,
}

/// Where a load or store goes: `region:offset`, or `region:offset[index * scale, count]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Address {
    /// The region of the process image.
    pub region: RegionId,
    /// Bytes from the region's start, of element 0 where there is an index.
    pub offset: u32,
    /// The element, where the address is one in an array.
    pub index: Option<Index>,
    /// Whether the access has an effect outside the program, as one of a hardware register has.
    /// Such an access is neither moved, merged nor dropped.
    pub volatile: bool,
}

impl Address {
    /// The address of a fixed place.
    pub fn fixed(region: RegionId, offset: u32) -> Self {
        Self { region, offset, index: None, volatile: false }
    }

    /// The address of element `value` of an array of `count` elements that are `scale` bytes apart.
    pub fn indexed(region: RegionId, offset: u32, value: Value, scale: u32, count: u32) -> Self {
        Self { region, offset, index: Some(Index { value, scale, count }), volatile: false }
    }

    /// The same address, for a volatile access.
    pub fn volatile(mut self) -> Self {
        self.volatile = true;
        self
    }

    /// The bytes that an access of a type may touch, whatever its index is, as offsets from the
    /// region's start.
    pub fn extent(&self, ty: Type) -> Range<u64> {
        let start = u64::from(self.offset);
        let span = match self.index {
            Some(index) => u64::from(index.scale) * u64::from(index.count.saturating_sub(1)),
            None => 0,
        };
        start..start + span + u64::from(ty.bytes())
    }
}

/// The groups of eight bits of a word of 32 bits that are kept as [local bits](crate::FuncData::local_bits), and where these are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BitGroups {
    /// The local bit that belongs to bit 0 of the word.
    pub first: u32,
    /// The groups: bit N stands for the bits 8 N to 8 N + 7 of the word.
    pub groups: u8,
}

impl BitGroups {
    /// How many groups a word has.
    pub const COUNT: u32 = 4;

    /// The groups that have a bit of a mask.
    pub fn of_mask(first: u32, mask: u32) -> Self {
        let groups = (0..Self::COUNT).filter(|group| mask >> (8 * group) & 0xFF != 0);
        Self { first, groups: groups.fold(0, |groups, group| groups | 1 << group) }
    }

    /// The numbers of the groups, in rising order.
    pub fn iter(self) -> impl Iterator<Item = u32> {
        (0..u8::BITS).filter(move |group| self.groups >> group & 1 == 1)
    }

    /// The local bits of a group.
    pub fn bits(self, group: u32) -> Range<u64> {
        let start = u64::from(self.first) + 8 * u64::from(group);
        start..start + 8
    }

    /// The bits of the word that are in one of the groups.
    pub fn mask(self) -> u32 {
        self.iter().fold(0, |mask, group| mask | 0xFF_u32.checked_shl(8 * group).unwrap_or(0))
    }
}
