//! Where in the process image the bits of a variable lie, and what they are.

use plcc_abi::pmac::layout::{ADDRESS_SIZE, WORD_SIZE};
use plcc_abi::pmac::{Definition, Field, Format, Layout, Place, Space};

/// A bit of the image: offset of its byte, and its number in it.
pub(super) type BitPlace = (u32, u8);

/// How bits are a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Coded {
    /// An integer without a sign.
    Unsigned,
    /// An integer in two's complement.
    Signed,
    /// Decimal digits of four bits; complemented where it says so.
    Decimal(bool),
    /// A double.
    Double,
    /// A format that is not followed.
    Other,
}

/// The bits of a variable, the lowest first.
#[derive(Clone, Debug)]
pub(super) struct Bits {
    pub(super) places: Vec<BitPlace>,
    pub(super) coded: Coded,
}

/// Bits of a number in the image.
pub(super) fn run(offset: u32, first: u32, count: u32) -> Vec<BitPlace> {
    (first..first + count).map(|bit| (offset + bit / 8, (bit % 8) as u8)).collect()
}

/// A double in the image.
pub(super) fn double(offset: u32) -> Bits {
    Bits { places: run(offset, 0, 64), coded: Coded::Double }
}

/// The bits of what a definition means; `number` is that of its M-variable, if it is one's. `None` for bits that do not lie in
/// the image as they are.
pub(super) fn bits(layout: &Layout, number: Option<u32>, definition: Definition) -> Option<Bits> {
    let word = |space, address| match layout.place(space, address) {
        Place::Word(offset) => Some(offset),
        _ => None,
    };
    let field = |space, address, field: Field| {
        let places = run(word(space, address)?, field.offset.into(), field.width.into());
        let coded = match field.format {
            Format::U => Coded::Unsigned,
            Format::S => Coded::Signed,
            Format::D => Coded::Decimal(false),
            Format::C => Coded::Decimal(true),
        };
        Some(Bits { places, coded })
    };
    let pair = |address, width, coded| {
        let mut places = run(word(Space::Y, address)?, 0, width);
        places.extend(run(word(Space::X, address)?, 0, width));
        Some(Bits { places, coded })
    };
    match definition {
        Definition::Star => {
            let places = run(layout.definition_offset(number?), 0, 21);
            Some(Bits { places, coded: Coded::Signed })
        }
        Definition::X { address, field: it } => field(Space::X, address, it),
        Definition::Y { address, field: it } => field(Space::Y, address, it),
        Definition::D { address } => pair(address, 24, Coded::Signed),
        Definition::Dp { address } => pair(address, 16, Coded::Signed),
        Definition::F { address } => pair(address, 16, Coded::Other),
        Definition::L { address } => match layout.place(Space::X, address) {
            Place::P(number) => Some(double(layout.p_offset(number))),
            Place::Q(number) => Some(double(layout.q_offset(number))),
            _ => pair(address, 24, Coded::Other),
        },
        Definition::Tw { .. } => Some(double(layout.thumbwheel_offset(number?))),
    }
}

/// The word of memory at an offset in the image.
pub(super) fn address(layout: &Layout, offset: u32) -> Option<(Space, u32)> {
    let index = offset.checked_sub(layout.words)? / ADDRESS_SIZE;
    let space = if offset.checked_sub(layout.words)? % ADDRESS_SIZE < WORD_SIZE {
        Space::X
    } else {
        Space::Y
    };
    // The windows lie at rising addresses, so that an address is not less than its index.
    let is_it = |address: &u32| layout.place(space, *address) == Place::Word(offset & !3);
    let windows = [0, 0x5_0000, 0x5_8000];
    windows.iter().map(|gap| index + gap).find(is_it).map(|address| (space, address))
}
