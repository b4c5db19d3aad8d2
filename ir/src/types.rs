//! The types of values: truth values, four widths of integers, and doubles. Integers are neither
//! signed nor unsigned; the operations are.

use std::fmt;

/// The type of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Type {
    /// A truth value. In the process image it is a byte that is 0 or 1, in regions of bits only.
    I1,
    /// An integer of 8 bits.
    I8,
    /// An integer of 16 bits.
    I16,
    /// An integer of 32 bits.
    I32,
    /// An integer of 64 bits.
    I64,
    /// An IEEE double.
    F64,
}

impl Type {
    /// Every type.
    pub const ALL: [Self; 6] = [Self::I1, Self::I8, Self::I16, Self::I32, Self::I64, Self::F64];

    /// Its size in the process image, in bytes.
    pub fn bytes(self) -> u32 {
        match self {
            Self::I1 | Self::I8 => 1,
            Self::I16 => 2,
            Self::I32 => 4,
            Self::I64 | Self::F64 => 8,
        }
    }

    /// Its width in bits; 1 for a truth value.
    pub fn bits(self) -> u32 {
        match self {
            Self::I1 => 1,
            other => other.bytes() * 8,
        }
    }

    /// Whether it is an integer, truth values included.
    pub fn is_int(self) -> bool {
        self != Self::F64
    }

    /// A number cut to the type's width, in the form in which constants are kept: an integer is
    /// extended with its sign to 64 bits, a truth value is 0 or 1, and a double is its bits.
    pub fn wrap(self, value: i64) -> i64 {
        match self {
            Self::I1 => value & 1,
            Self::I8 => i64::from(value as i8),
            Self::I16 => i64::from(value as i16),
            Self::I32 => i64::from(value as i32),
            Self::I64 | Self::F64 => value,
        }
    }

    /// Its name in the [text form](crate::text).
    pub fn name(self) -> &'static str {
        match self {
            Self::I1 => "i1",
            Self::I8 => "i8",
            Self::I16 => "i16",
            Self::I32 => "i32",
            Self::I64 => "i64",
            Self::F64 => "f64",
        }
    }

    /// The type with this name; `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|ty| ty.name() == name)
    }
}

impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
