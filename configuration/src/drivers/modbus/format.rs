//! How registers of a Modbus device make a value: a bit, an integer, a floating-point number or decimal digits, in one of
//! the four orders of bytes that devices have.

/// What a number in registers is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Coding {
    /// 16 bits without a sign.
    U16,
    /// 16 bits with a sign.
    I16,
    /// 32 bits without a sign.
    U32,
    /// 32 bits with a sign.
    I32,
    /// A floating-point number of 32 bits (IEEE 754).
    F32,
    /// 64 bits without a sign.
    U64,
    /// 64 bits with a sign.
    I64,
    /// A floating-point number of 64 bits (IEEE 754).
    F64,
    /// Four decimal digits of four bits each.
    Bcd16,
    /// Eight decimal digits of four bits each.
    Bcd32,
}

impl Coding {
    const NAMES: [(&str, Self); 10] = [
        ("u16", Self::U16),
        ("i16", Self::I16),
        ("u32", Self::U32),
        ("i32", Self::I32),
        ("f32", Self::F32),
        ("u64", Self::U64),
        ("i64", Self::I64),
        ("f64", Self::F64),
        ("bcd16", Self::Bcd16),
        ("bcd32", Self::Bcd32),
    ];

    /// All of them, the smaller ones first.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        Self::NAMES.into_iter().map(|(_, coding)| coding)
    }

    /// The name in a configuration.
    pub(super) fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, coding)| *coding == self).map_or("", |(name, _)| name)
    }

    /// How many registers it takes.
    pub fn registers(self) -> u16 {
        match self {
            Self::U16 | Self::I16 | Self::Bcd16 => 1,
            Self::U32 | Self::I32 | Self::F32 | Self::Bcd32 => 2,
            Self::U64 | Self::I64 | Self::F64 => 4,
        }
    }

    /// Whether it has a fraction.
    pub fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// The lowest and the highest number that it can hold. Of 64 bits it is the highest one that a floating-point number of
    /// 64 bits, as which values come and go, can hold too.
    pub fn range(self) -> (f64, f64) {
        match self {
            Self::U16 => (0.0, u16::MAX.into()),
            Self::I16 => (i16::MIN.into(), i16::MAX.into()),
            Self::U32 => (0.0, u32::MAX.into()),
            Self::I32 => (i32::MIN.into(), i32::MAX.into()),
            Self::F32 => (f32::MIN.into(), f32::MAX.into()),
            Self::U64 => (0.0, (u64::MAX as f64).next_down()),
            Self::I64 => (i64::MIN as f64, (i64::MAX as f64).next_down()),
            Self::F64 => (f64::MIN, f64::MAX),
            Self::Bcd16 => (0.0, 9999.0),
            Self::Bcd32 => (0.0, 99_999_999.0),
        }
    }
}

/// The order of the bytes of a number, where `A` is the highest of four.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Order {
    /// Whether the lowest register comes first (`CDAB`), rather than the highest one, as in `ABCD`.
    pub is_low_word_first: bool,
    /// Whether the low byte of each register comes first (`BADC`), rather than the high one, as Modbus has it.
    pub is_low_byte_first: bool,
}

impl Order {
    /// What stands after a format and a `-`. `swapped` is another word for `cdab`.
    const NAMES: [(&str, bool, bool); 5] = [
        ("abcd", false, false),
        ("cdab", true, false),
        ("badc", false, true),
        ("dcba", true, true),
        ("swapped", true, false),
    ];

    fn parse(text: &str) -> Option<Self> {
        let found = Self::NAMES.iter().find(|(name, ..)| *name == text);
        found.map(|&(_, is_low_word_first, is_low_byte_first)| Self {
            is_low_word_first,
            is_low_byte_first,
        })
    }
}

/// How registers make a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// A single bit of a table of bits.
    Bit,
    /// A bit of a register, by its number from 0 for the lowest.
    BitOf(u8),
    /// A number.
    Number(Coding, Order),
}

impl Format {
    /// The format of a register whose address has none.
    pub const DEFAULT: Self =
        Self::Number(Coding::U16, Order { is_low_word_first: false, is_low_byte_first: false });

    /// Reads a format of registers, such as `u16`, `f32-dcba` or `bit3`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let bit = text.strip_prefix("bit").and_then(|bit| bit.parse().ok());
        if let Some(bit) = bit.filter(|&bit: &u8| bit < 16) {
            return Ok(Self::BitOf(bit));
        }
        let (plain, order) = match text.split_once('-') {
            Some((plain, order)) => (plain, Some(order)),
            None => (text, None),
        };
        let coding = Coding::NAMES.iter().find(|(name, _)| *name == plain);
        let Some(&(_, coding)) = coding else {
            let names = Coding::NAMES.map(|(name, _)| name).join(", ");
            return Err(format!(
                "`{text}` is not a format; the formats are {names}, and bit0 to bit15"
            ));
        };
        let Some(order) = order else { return Ok(Self::Number(coding, Order::default())) };
        let Some(parsed) = Order::parse(order) else {
            return Err(format!(
                "`{text}`: `{order}` is not an order of bytes; the orders are abcd, cdab (or swapped), badc and dcba"
            ));
        };
        if coding.registers() == 1 && parsed.is_low_word_first {
            return Err(format!(
                "`{text}`: a single register has no words to swap; its bytes are swapped by {plain}-badc"
            ));
        }
        Ok(Self::Number(coding, parsed))
    }

    /// How many registers it takes.
    pub fn registers(self) -> u16 {
        match self {
            Self::Bit | Self::BitOf(_) => 1,
            Self::Number(coding, _) => coding.registers(),
        }
    }

    /// Whether it is a single bit.
    pub fn is_bit(self) -> bool {
        matches!(self, Self::Bit | Self::BitOf(_))
    }

    /// The lowest and the highest value that it can hold.
    pub fn range(self) -> (f64, f64) {
        match self {
            Self::Bit | Self::BitOf(_) => (0.0, 1.0),
            Self::Number(coding, _) => coding.range(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_format_has_an_order_of_bytes() {
        let order =
            |is_low_word_first, is_low_byte_first| Order { is_low_word_first, is_low_byte_first };
        for (text, format) in [
            ("u16", Format::DEFAULT),
            ("i16-badc", Format::Number(Coding::I16, order(false, true))),
            ("f32", Format::Number(Coding::F32, order(false, false))),
            ("f32-abcd", Format::Number(Coding::F32, order(false, false))),
            ("f32-swapped", Format::Number(Coding::F32, order(true, false))),
            ("u32-cdab", Format::Number(Coding::U32, order(true, false))),
            ("i64-dcba", Format::Number(Coding::I64, order(true, true))),
            ("bcd32-badc", Format::Number(Coding::Bcd32, order(false, true))),
            ("bit15", Format::BitOf(15)),
        ] {
            assert_eq!(Format::parse(text), Ok(format), "{text}");
        }
        for (text, part) in [
            ("u8", "`u8` is not a format; the formats are u16, "),
            ("", "is not a format"),
            ("bit16", "is not a format"),
            ("bit1-badc", "is not a format"),
            ("f32-abdc", "`abdc` is not an order of bytes; the orders are abcd, "),
            ("f32-", "is not an order of bytes"),
            ("u16-swapped", "its bytes are swapped by u16-badc"),
            ("bcd16-dcba", "its bytes are swapped by bcd16-badc"),
        ] {
            let why = Format::parse(text).err().unwrap_or_default();
            assert!(why.contains(part), "{text}: {why}");
        }
    }

    #[test]
    fn the_highest_numbers_of_64_bits_are_below_their_powers_of_2() {
        assert_eq!(Coding::U64.range(), (0.0, 18_446_744_073_709_549_568.0));
        assert_eq!(
            Coding::I64.range(),
            (-9_223_372_036_854_775_808.0, 9_223_372_036_854_774_784.0)
        );
    }
}
