//! Definitions: which register, or which of its bits, an M- or L-variable stands for.

use serde::{Deserialize, Serialize};

use super::layout::Space;

/// How the bits of a register are read (guide, M-Variables).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Format {
    /// Unsigned.
    U,
    /// Signed.
    S,
    /// Binary coded decimal.
    D,
    /// Complemented binary coded decimal.
    C,
}

/// A part of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Field {
    /// Its lowest bit, 0 to 23.
    pub offset: u8,
    /// Its number of bits, 1 to 24.
    pub width: u8,
    /// How it is read.
    pub format: Format,
}

impl Field {
    /// The whole word, unsigned.
    pub const WORD: Self = Self { offset: 0, width: 24, format: Format::U };
}

/// An M-variable's definition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Definition {
    /// `*`, and what was never defined: a value of 21 bits where the definition itself stands.
    #[default]
    Star,
    /// `X:`: bits of an X word.
    X {
        /// The word's address.
        address: u32,
        /// Which bits.
        field: Field,
    },
    /// `Y:`: bits of a Y word.
    Y {
        /// The word's address.
        address: u32,
        /// Which bits.
        field: Field,
    },
    /// `D:`: 48 bits signed, X high.
    D {
        /// The words' address.
        address: u32,
    },
    /// `DP:`: 32 bits signed, the low 16 of X high and of Y low.
    Dp {
        /// The words' address.
        address: u32,
    },
    /// `L:`: 48 bits floating point.
    L {
        /// The words' address.
        address: u32,
    },
    /// `F:`: 32 bits floating point in the low 16 bits of X and Y.
    F {
        /// The words' address.
        address: u32,
    },
    /// `TWD:`, `TWB:`, `TWS:`, `TWR:`: behind the multiplexer port; holds what was last written.
    Tw {
        /// The multiplexer's address.
        address: u32,
    },
}

const STAR: u8 = 0;
const X: u8 = 1;
const Y: u8 = 2;
const D: u8 = 3;
const DP: u8 = 4;
const L: u8 = 5;
const F: u8 = 6;
const TW: u8 = 7;

impl Definition {
    /// The definition of a single word's bits.
    pub fn word(space: Space, address: u32, field: Field) -> Self {
        match space {
            Space::X => Self::X { address, field },
            Space::Y => Self::Y { address, field },
        }
    }

    /// The address it holds; 0 for `*`.
    pub fn address(self) -> u32 {
        match self {
            Self::Star => 0,
            Self::X { address, .. }
            | Self::Y { address, .. }
            | Self::D { address }
            | Self::Dp { address }
            | Self::L { address }
            | Self::F { address }
            | Self::Tw { address } => address,
        }
    }

    /// The definition as the region `mdef` of the image holds it: the address (of `*`: the value) in the low 32 bits,
    /// above it a byte each of kind, lowest bit, width and format.
    pub fn encode(self) -> u64 {
        let (kind, field) = match self {
            Self::Star => (STAR, None),
            Self::X { field, .. } => (X, Some(field)),
            Self::Y { field, .. } => (Y, Some(field)),
            Self::D { .. } => (D, None),
            Self::Dp { .. } => (DP, None),
            Self::L { .. } => (L, None),
            Self::F { .. } => (F, None),
            Self::Tw { .. } => (TW, None),
        };
        let (offset, width, format) = match field {
            Some(field) => (field.offset, field.width, field.format as u8),
            None => (0, 0, 0),
        };
        let [a0, a1, a2, a3] = self.address().to_le_bytes();
        u64::from_le_bytes([a0, a1, a2, a3, kind, offset, width, format])
    }

    /// The definition that [`encode`](Self::encode) has made a code of. A code that it never makes gives
    /// some valid definition.
    pub fn decode(code: u64) -> Self {
        let [a0, a1, a2, a3, kind, offset, width, format] = code.to_le_bytes();
        let address = u32::from_le_bytes([a0, a1, a2, a3]);
        let field = Field {
            offset: offset.min(23),
            width: width.clamp(1, 24 - offset.min(23)),
            format: match format {
                1 => Format::S,
                2 => Format::D,
                3 => Format::C,
                _ => Format::U,
            },
        };
        match kind {
            X => Self::X { address, field },
            Y => Self::Y { address, field },
            D => Self::D { address },
            DP => Self::Dp { address },
            L => Self::L { address },
            F => Self::F { address },
            TW => Self::Tw { address },
            _ => Self::Star,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn definitions_survive_encoding() {
        let field = Field { offset: 8, width: 16, format: Format::C };
        for definition in [
            Definition::Star,
            Definition::X { address: 0xC003, field },
            Definition::Y { address: 0xFF_FFFF, field: Field::WORD },
            Definition::D { address: 0x28 },
            Definition::Dp { address: 0xD201 },
            Definition::L { address: 0x822 },
            Definition::F { address: 0xD7FF },
            Definition::Tw { address: 4 },
        ] {
            assert_eq!(Definition::decode(definition.encode()), definition);
        }
        assert_eq!(Definition::Star.encode(), 0);
        assert_eq!(Definition::decode(0x7F << 32), Definition::Star);
        let odd = Definition::decode(0x09FF_FF01_0000_0000);
        assert_eq!(
            odd,
            Definition::X { address: 0, field: Field { offset: 23, width: 1, format: Format::U } }
        );
    }
}
