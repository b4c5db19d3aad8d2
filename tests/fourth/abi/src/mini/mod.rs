//! What the compiler and the control of MINI share: the tables of a program.

use alloc::{string::String, vec::Vec};

use serde::{Deserialize, Serialize};

use crate::{DialectTables, ImageSymbol, ImageType};

/// What a variable is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// A bit that the machine gives.
    Input,
    /// A bit that the machine takes.
    Output,
    /// A number of 32 bits.
    Number,
}

/// A variable.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Symbol {
    /// Its name, in capitals.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// Where it lies in the image: a bit is a byte of 0 or 1.
    pub offset: u32,
}

/// The tables of a program.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MiniTables {
    /// The variables, in the order of their declarations.
    pub symbols: Vec<Symbol>,
}

impl DialectTables for MiniTables {
    type Variable = u32;

    fn symbols(&self) -> Vec<ImageSymbol> {
        let place = |symbol: &Symbol| ImageSymbol {
            name: symbol.name.clone(),
            ty: match symbol.kind {
                Kind::Input | Kind::Output => ImageType::Logical,
                Kind::Number => ImageType::Long,
            },
            offset: symbol.offset,
            elements: 1,
        };
        self.symbols.iter().map(place).collect()
    }
}
