//! The types of values.

use std::fmt;

/// A value's type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Type {
    /// A truth value; one byte of 0 or 1 in memory, in regions of bits only.
    I1,
    /// 8 bits.
    I8,
    /// 16 bits.
    I16,
    /// 32 bits.
    I32,
    /// 64 bits.
    I64,
    /// An IEEE double.
    F64,
}

impl Type {
    /// Every type.
    pub const ALL: [Self; 6] = [Self::I1, Self::I8, Self::I16, Self::I32, Self::I64, Self::F64];

    /// Bytes in memory.
    pub fn bytes(self) -> u32 {
        match self {
            Self::I1 | Self::I8 => 1,
            Self::I16 => 2,
            Self::I32 => 4,
            Self::I64 | Self::F64 => 8,
        }
    }

    /// Width in bits.
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

    /// A number brought to the form in which constants of this type are kept: sign-extended from
    /// the type's width, truth values 0 or 1.
    pub fn wrap(self, value: i64) -> i64 {
        match self {
            Self::I1 => value & 1,
            Self::I8 => i64::from(value as i8),
            Self::I16 => i64::from(value as i16),
            Self::I32 => i64::from(value as i32),
            Self::I64 | Self::F64 => value,
        }
    }

    /// The type's name in the text format.
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

    /// Finds a type by its name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|ty| ty.name() == name)
    }
}

impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
