//! PMAC's variables by their place in the image.

use alloc::{format, vec::Vec};

use super::{Kind, Layout, PmacTables};
use crate::{ImageSymbol, ImageType};

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
