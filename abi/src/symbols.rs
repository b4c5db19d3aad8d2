//! Where a program's variables lie in its image, in one form for all languages. The layout in an
//! object file is made of it.

use alloc::string::String;

/// The type of a variable in the image, little endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImageType {
    /// A byte that is 0 or 1.
    Logical,
    /// A signed number of 16 bits.
    Integer,
    /// A signed number of 32 bits.
    Long,
    /// An IEEE 754 number of 64 bits.
    Double,
    /// Eight flags in one byte; flag 0 is its lowest bit.
    Byte,
    /// Eight flags in eight bytes of 0 or 1; flag 0 is the first byte.
    Bits,
}

impl ImageType {
    /// The word for it in a layout's text: `logical`, `integer`, `long`, `double`, `byte`, `bits`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Logical => "logical",
            Self::Integer => "integer",
            Self::Long => "long",
            Self::Double => "double",
            Self::Byte => "byte",
            Self::Bits => "bits",
        }
    }

    /// Bytes of one element.
    pub fn size(self) -> u32 {
        match self {
            Self::Logical | Self::Byte => 1,
            Self::Integer => 2,
            Self::Long => 4,
            Self::Double | Self::Bits => 8,
        }
    }
}

/// A variable, or a byte of flags, that has a place of its own in the image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageSymbol {
    /// The name in the language's canonical spelling.
    pub name: String,
    /// What one element is.
    pub ty: ImageType,
    /// Offset of the first element in bytes.
    pub offset: u32,
    /// How many elements follow one another, 1 for a variable that is not an array.
    pub elements: u32,
}

/// A variable that is a part of a word of 32 bits in the image, little endian.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BitField {
    /// The name in the language's canonical spelling.
    pub name: String,
    /// Offset of the word in bytes.
    pub offset: u32,
    /// The lowest of its bits, counted from the word's lowest.
    pub first: u8,
    /// How many bits it has, at least one; with `first` at most 32.
    pub width: u8,
    /// Whether the highest of them is a sign.
    pub signed: bool,
}
