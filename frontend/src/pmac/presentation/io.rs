//! Inputs and outputs: M-variables that are defined as bits of the I/O memory.

use plcc_abi::image::read_u64;
use plcc_abi::pmac::{Definition, Field, Format, Kind, Layout, Output, PmacName, Space};

use crate::presentation::IoPoint;

/// Those among the variables `names` that the definitions in an image put there.
pub(super) fn points(
    layout: &Layout,
    outputs: &[Output],
    names: &[String],
    image: &[u8],
) -> Vec<IoPoint> {
    let definition = |name: &str| -> Option<Definition> {
        let PmacName::Variable(variable) = PmacName::parse(name, layout).ok()? else {
            return None;
        };
        (variable.kind == Kind::M).then(|| definition(image, layout, variable.number))
    };
    let mut points = vec![];
    for name in names {
        let Some(definition) = definition(name) else { continue };
        let bits = match definition {
            Definition::X { address, field } if layout.is_io(Space::X, address) => field.width,
            Definition::Y { address, field } if layout.is_io(Space::Y, address) => field.width,
            _ => continue,
        };
        let is_output = |output: &Output| output.definition == definition;
        points.push(IoPoint {
            name: name.clone(),
            bit: bits == 1,
            place: definition_text(definition),
            output: outputs.iter().any(is_output),
            lines: vec![],
        });
    }
    points
}

/// The definition of an M-variable in an image. Its number wraps.
pub(super) fn definition(image: &[u8], layout: &Layout, number: u32) -> Definition {
    let number = number & (layout.count - 1);
    Definition::decode(read_u64(image, layout.definition_offset(number)))
}

/// A definition as a PMAC answers it.
pub(super) fn definition_text(definition: Definition) -> String {
    let field = |space: char, address: u32, field: Field| {
        let format = match field.format {
            Format::U => "",
            Format::S => ",S",
            Format::D => ",D",
            Format::C => ",C",
        };
        match field.width {
            1 => format!("{space}:${address:X},{}", field.offset),
            24 if field.offset == 0 => format!("{space}:${address:X},24{format}"),
            width => format!("{space}:${address:X},{},{width}{format}", field.offset),
        }
    };
    match definition {
        Definition::Star => "*".into(),
        Definition::X { address, field: bits } => field('X', address, bits),
        Definition::Y { address, field: bits } => field('Y', address, bits),
        Definition::D { address } => format!("D:${address:X}"),
        Definition::Dp { address } => format!("DP:${address:X}"),
        Definition::L { address } => format!("L:${address:X}"),
        Definition::F { address } => format!("F:${address:X}"),
        Definition::Tw { address } => format!("TW:{address}"),
    }
}
