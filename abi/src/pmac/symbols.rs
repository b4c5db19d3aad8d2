//! PMAC's variables by their place in the image.

use alloc::{format, vec, vec::Vec};

use super::{Controller, Definition, Field, Format, Kind, Layout, Place, PmacTables, Run, Space};
use crate::image::read_u64;
use crate::place;
use crate::{BitField, ImageSymbol, ImageType};

/// P, Q and I; where an M or an L lies depends on its definition, which may change.
pub(crate) fn symbols(tables: &PmacTables) -> Vec<ImageSymbol> {
    let layout = Layout::new(tables.controller);
    let place = |named: &super::Variable| {
        let number = named.number;
        let (name, offset) = match named.kind {
            Kind::P => (format!("P{number}"), layout.p_offset(number)),
            Kind::I => (format!("I{number}"), layout.i_offset(number)),
            Kind::Q => {
                let offset = layout.q_offset(layout.q_base_of(named.system) + number);
                (format!("&{}Q{number}", named.system), offset)
            }
            Kind::L | Kind::M => return None,
        };
        Some(ImageSymbol { name, ty: ImageType::Double, offset, elements: 1 })
    };
    tables.named.iter().filter_map(place).collect()
}

/// Where in the image the bits of a definition lie, and whether the highest one is a sign. `None` for what is not
/// bits of a single word of the image in binary.
pub fn field_place(layout: &Layout, definition: Definition) -> Option<place::Place> {
    let (space, address, field) = match definition {
        Definition::X { address, field } => (Space::X, address, field),
        Definition::Y { address, field } => (Space::Y, address, field),
        _ => return None,
    };
    let Place::Word(offset) = layout.place(space, address) else { return None };
    let Field { offset: first, width, format } = field;
    // A single bit has no format.
    let ty = match format {
        Format::U => place::Type::Bits,
        _ if width == 1 => place::Type::Bits,
        Format::S => place::Type::SignedBits,
        Format::D | Format::C => return None,
    };
    Some(place::Place::bits(offset, ty, first, width))
}

impl Layout {
    /// Whether a definition is one of the lines of PMAC (1) that the guide calls inputs (appendix F): DAT0 to DAT7 of the
    /// multiplexer port and the machine inputs 1 to 8, the lower bytes of Y:$FFC1 and Y:$FFC2.
    pub fn is_input(&self, definition: Definition) -> bool {
        let Definition::Y { address: 0xFFC1 | 0xFFC2, field } = definition else { return false };
        self.controller == Controller::Pmac && field.offset.saturating_add(field.width) <= 8
    }
}

/// M and L that are bits of a word in the image, as they are defined after the download.
pub(crate) fn bit_fields(tables: &PmacTables) -> Vec<BitField> {
    let layout = Layout::new(tables.controller);
    let mut image = vec![0; layout.size as usize];
    Run::unpack(&tables.initial, &mut image);
    let field = |named: &super::Variable| {
        let number = named.number;
        let (letter, definition) = match named.kind {
            Kind::M => {
                let code = read_u64(&image, layout.definition_offset(number));
                ("M", Definition::decode(code))
            }
            Kind::L => ("L", tables.l.iter().find(|(l, _)| *l == number)?.1),
            Kind::P | Kind::I | Kind::Q => return None,
        };
        let place::Place { offset, ty, bit: first, width } = field_place(&layout, definition)?;
        let signed = ty == place::Type::SignedBits;
        Some(BitField { name: format!("{letter}{number}"), offset, first, width, signed })
    };
    tables.named.iter().filter_map(field).collect()
}
