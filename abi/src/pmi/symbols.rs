//! PMI's variables by their place in the image.

use alloc::vec::Vec;

use super::{PmiTables, Type};
use crate::{ImageSymbol, ImageType};

/// Every variable of the program, with those of the executive that it uses.
pub(crate) fn symbols(tables: &PmiTables) -> Vec<ImageSymbol> {
    let place = |symbol: &super::Symbol| ImageSymbol {
        name: symbol.name.clone(),
        ty: match symbol.ty {
            Type::Logical => ImageType::Logical,
            Type::Integer => ImageType::Integer,
            Type::Long => ImageType::Long,
        },
        offset: symbol.offset,
        elements: symbol.elements.unwrap_or(1),
    };
    tables.symbols.iter().map(place).collect()
}
