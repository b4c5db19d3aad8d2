//! Where a variable lies in the process image, and how its bytes are read there, for everything that reads
//! images without knowing the language: image files, drivers, displays.

use core::fmt;
use core::ops::RangeInclusive;

/// The value of a variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// An integer; a bit is 0 or 1.
    Int(i64),
    /// A number with a fraction.
    Float(f64),
}

impl Number {
    /// The value as a number with a fraction.
    pub fn float(self) -> f64 {
        match self {
            Self::Int(number) => number as f64,
            Self::Float(number) => number,
        }
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Int(number) => write!(f, "{number}"),
            Self::Float(number) => write!(f, "{number}"),
        }
    }
}

/// How bytes of the process image are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Type {
    /// A byte that is 0 or 1.
    Logical,
    /// A signed number of 16 bits.
    Integer,
    /// A signed number of 32 bits.
    Long,
    /// A number of 64 bits with a fraction (IEEE 754).
    Double,
    /// An unsigned number of 16 bits.
    Word,
    /// Some bits of a word of up to 32 bits, without a sign.
    Bits,
    /// Some bits of a word of up to 32 bits, the highest of which is a sign.
    SignedBits,
    /// Some bits of a word of up to 32 bits: decimal digits of four bits each.
    Bcd,
}

impl Type {
    /// All types, by their numbers in image files.
    pub const ALL: [Self; 8] = [
        Self::Logical,
        Self::Integer,
        Self::Long,
        Self::Double,
        Self::Word,
        Self::Bits,
        Self::SignedBits,
        Self::Bcd,
    ];

    /// The word for it in documentation.
    pub fn name(self) -> &'static str {
        match self {
            Self::Logical => "logical",
            Self::Integer => "integer",
            Self::Long => "long",
            Self::Double => "double",
            Self::Word => "word",
            Self::Bits => "bits",
            Self::SignedBits => "signed bits",
            Self::Bcd => "BCD",
        }
    }
}

/// Whether a variable is an input or an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Neither.
    Internal,
    /// An input: something outside gives its value.
    Input,
    /// An output: something outside takes its value.
    Output,
}

impl Direction {
    /// All directions, by their numbers in image files.
    pub const ALL: [Self; 3] = [Self::Internal, Self::Input, Self::Output];

    /// The word for it in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Internal => "a variable",
            Self::Input => "an input",
            Self::Output => "an output",
        }
    }
}

/// Where a value lies in the process image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Place {
    /// The offset of the first byte.
    pub offset: u32,
    /// How the bytes are read.
    pub ty: Type,
    /// The lowest bit, counted from the lowest one of the first byte; 0 for types of whole bytes.
    pub bit: u8,
    /// How many bits it has, from 1 to 32 for bits; 8, 16, 32 or 64 for types of whole bytes.
    pub width: u8,
}

impl Place {
    /// The place of a value that takes whole bytes, as many as its type has; one byte for the types of bits.
    pub fn bytes(offset: u32, ty: Type) -> Self {
        let width = match ty {
            Type::Integer | Type::Word => 16,
            Type::Long => 32,
            Type::Double => 64,
            Type::Logical | Type::Bits | Type::SignedBits | Type::Bcd => 8,
        };
        Self { offset, ty, bit: 0, width }
    }

    /// The place of `width` bits from bit number `bit` on, counted from the lowest bit of the byte at the offset.
    pub fn bits(offset: u32, ty: Type, bit: u8, width: u8) -> Self {
        Self { offset, ty, bit, width }
    }

    /// How many bytes of the image it touches.
    pub fn length(self) -> usize {
        (usize::from(self.bit) + usize::from(self.width)).div_ceil(8)
    }

    /// Whether the value is a single bit.
    pub fn is_bit(self) -> bool {
        match self.ty {
            Type::Logical => true,
            Type::Bits => self.width == 1,
            _ => false,
        }
    }

    /// Reads the value; `None` where it lies outside the image.
    #[inline]
    pub fn read(self, image: &[u8]) -> Option<Number> {
        let at = self.offset as usize;
        let rest = image.get(at..)?;
        let field = || -> Option<u64> {
            let length = self.length();
            let mut word = [0; 8];
            let (to, from) = (word.get_mut(..length)?, rest.get(..length)?);
            to.copy_from_slice(from);
            let mask = 1u64.checked_shl(self.width.into())?.wrapping_sub(1);
            Some(u64::from_le_bytes(word) >> self.bit & mask)
        };
        Some(match self.ty {
            Type::Logical => Number::Int((*rest.first()? != 0).into()),
            Type::Integer => Number::Int(i16::from_le_bytes(*rest.first_chunk()?).into()),
            Type::Word => Number::Int(u16::from_le_bytes(*rest.first_chunk()?).into()),
            Type::Long => Number::Int(i32::from_le_bytes(*rest.first_chunk()?).into()),
            Type::Double => Number::Float(f64::from_le_bytes(*rest.first_chunk()?)),
            Type::Bits => Number::Int(field()? as i64),
            Type::SignedBits => {
                let spare = 64 - u32::from(self.width);
                Number::Int(((field()? << spare) as i64) >> spare)
            }
            Type::Bcd => {
                let bits = field()?;
                let digit = |n: u32| (bits >> (4 * n) & 0xF) as i64 * 10_i64.pow(n);
                Number::Int((0..8).map(digit).sum())
            }
        })
    }

    /// The bits of a value in such a place, the lowest one first, where it is some bits; as many of them as it has. The value
    /// is one of [`range`](Self::range).
    pub fn bits_of(self, value: i64) -> u64 {
        match self.ty {
            Type::Bcd => {
                let digit = |n: u32| (value / 10_i64.pow(n) % 10) as u64;
                let highest = u32::from(self.width).div_ceil(4).saturating_sub(1).min(7);
                // The highest digit may have fewer than four bits.
                (0..=highest).fold(0, |bits, n| bits | digit(n) << (4 * n))
            }
            _ => value as u64,
        }
    }

    /// The place of each of its bits, the lowest one first; none for a number with a fraction.
    pub fn each_bit(self) -> impl Iterator<Item = Self> {
        let width = if self.ty == Type::Double { 0 } else { self.width };
        let first = u32::from(self.bit);
        (0..u32::from(width)).map(move |bit| {
            let bit = first + bit;
            Self::bits(self.offset.saturating_add(bit / 8), Type::Bits, (bit % 8) as u8, 1)
        })
    }

    /// The integers that such a place can hold; `None` for numbers with a fraction.
    pub fn range(self) -> Option<RangeInclusive<i64>> {
        let width = u32::from(self.width).min(32);
        Some(match self.ty {
            Type::Logical => 0..=1,
            Type::Integer => i16::MIN.into()..=i16::MAX.into(),
            Type::Word => 0..=u16::MAX.into(),
            Type::Long => i32::MIN.into()..=i32::MAX.into(),
            Type::Double => return None,
            Type::Bits => 0..=(1_i64 << width) - 1,
            Type::SignedBits => -(1_i64 << width >> 1)..=(1_i64 << width >> 1) - 1,
            Type::Bcd => {
                let (digits, rest) = (width / 4, width % 4);
                let highest = (1_i64 << rest) * 10_i64.pow(digits) - 1;
                0..=highest
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;

    #[test]
    fn values_are_read_by_their_type() {
        let image = [0x01, 0xFE, 0xFF, 0xFF, 0xFF, 0xA5, 0x92, 0, 0, 0, 0, 0, 0, 0xF8, 0x3F];
        let bytes = |offset, ty| Place::bytes(offset, ty).read(&image);
        let bits = |offset, ty, bit, width| Place::bits(offset, ty, bit, width).read(&image);
        assert_eq!(bytes(0, Type::Logical), Some(Number::Int(1)));
        assert_eq!(bytes(1, Type::Integer), Some(Number::Int(-2)));
        assert_eq!(bytes(1, Type::Word), Some(Number::Int(0xFFFE)));
        assert_eq!(bytes(1, Type::Long), Some(Number::Int(-2)));
        assert_eq!(bytes(7, Type::Double), Some(Number::Float(1.5)));
        assert_eq!(bits(5, Type::Bits, 4, 4), Some(Number::Int(0xA)));
        assert_eq!(bits(5, Type::Bits, 7, 1), Some(Number::Int(1)));
        assert_eq!(bits(5, Type::SignedBits, 0, 8), Some(Number::Int(-91)));
        assert_eq!(bits(6, Type::Bcd, 0, 8), Some(Number::Int(92)));
        assert_eq!(bits(4, Type::Bits, 4, 8), Some(Number::Int(0x5F)));
        assert_eq!(bytes(12, Type::Long), None);
        assert_eq!(bits(14, Type::Bits, 4, 8), None);
        assert_eq!(bytes(u32::MAX, Type::Logical), None);
    }

    #[test]
    fn a_place_has_bits() {
        let bits = Place::bits(3, Type::Bcd, 6, 4).each_bit();
        let bits: Vec<_> = bits.map(|bit| (bit.offset, bit.bit, bit.width)).collect();
        assert_eq!(bits, [(3, 6, 1), (3, 7, 1), (4, 0, 1), (4, 1, 1)]);
        assert_eq!(Place::bytes(0, Type::Double).each_bit().count(), 0);
        for (ty, width, value) in
            [(Type::Bcd, 8, 92), (Type::Bcd, 6, 39), (Type::SignedBits, 4, -3)]
        {
            let place = Place::bits(0, ty, 0, width);
            let image = place.bits_of(value).to_le_bytes();
            assert_eq!(place.read(&image), Some(Number::Int(value)));
        }
    }

    #[test]
    fn a_place_says_what_it_can_hold() {
        let range = |ty, width| Place::bits(0, ty, 0, width).range().unwrap();
        assert_eq!(range(Type::Bits, 4), 0..=15);
        assert_eq!(range(Type::SignedBits, 4), -8..=7);
        assert_eq!(range(Type::Bcd, 8), 0..=99);
        assert_eq!(range(Type::Bcd, 6), 0..=39);
        assert_eq!(range(Type::Bits, 32), 0..=0xFFFF_FFFF);
        assert_eq!(Place::bytes(0, Type::Double).range(), None);
    }
}
