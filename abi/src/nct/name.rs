//! The names by which users write an NCT program's variables: `I002`, `Y40`, `RH060`.

use alloc::{
    format,
    string::{String, ToString},
};
use core::{cmp::Ordering, fmt, str::FromStr};

use serde::{Deserialize, Serialize};

/// A variable, as a stimulus, a trace or a dump names it. Bytes are 0 to 99 (P and O 0 to 39, F 0
/// to 999), `bit` is 0 to 7, or `None` for the word of that byte and the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum NctName {
    /// The input image, as the running module sees it.
    I {
        /// The byte.
        byte: u8,
        /// The bit, or the word.
        bit: Option<u8>,
    },
    /// The output image, as the program writes it.
    Y {
        /// The byte.
        byte: u8,
        /// The bit, or the word.
        bit: Option<u8>,
    },
    /// The physical input lines of the interface boards.
    P {
        /// The byte.
        byte: u8,
        /// The bit, or the word.
        bit: Option<u8>,
    },
    /// The physical output lines of the interface boards.
    O {
        /// The byte.
        byte: u8,
        /// The bit, or the word.
        bit: Option<u8>,
    },
    /// The local variables, which other controls call flags.
    F {
        /// The byte.
        byte: u16,
        /// The bit, or the word.
        bit: Option<u8>,
    },
    /// Register, 0 to 199.
    Rh(u16),
    /// Counter, 0 to 31.
    Q(u8),
    /// 20 ms timer, 0 to 49.
    T(u8),
    /// Second timer, 0 to 99.
    H(u8),
    /// Minute timer, 0 to 9.
    M(u8),
    /// PLC constant, 1 to 40.
    Rp(u8),
    /// Register OP of module :000, :001 or :002, by the module's number 0 to 2.
    Op(u8),
}

/// Why a text is not a variable's name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NctNameError {
    /// What is wrong, as the rest of a sentence that begins with the name: `has a bit above 7`.
    pub reason: String,
}

impl fmt::Display for NctNameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.reason)
    }
}

impl core::error::Error for NctNameError {}

impl NctName {
    /// The letters in front, by which names are sorted first.
    pub fn letters(self) -> &'static str {
        match self {
            Self::I { .. } => "I",
            Self::Y { .. } => "Y",
            Self::P { .. } => "P",
            Self::O { .. } => "O",
            Self::F { .. } => "F",
            Self::Rh(_) => "RH",
            Self::Q(_) => "Q",
            Self::T(_) => "T",
            Self::H(_) => "H",
            Self::M(_) => "M",
            Self::Rp(_) => "RP",
            Self::Op(_) => "OP",
        }
    }

    /// The number after the letters as written, and how many digits it has.
    fn digits(self) -> (u32, u32) {
        match self {
            Self::I { byte, bit }
            | Self::Y { byte, bit }
            | Self::P { byte, bit }
            | Self::O { byte, bit } => match bit {
                Some(bit) => (u32::from(byte) * 10 + u32::from(bit), 3),
                None => (byte.into(), 2),
            },
            Self::F { byte, bit } => match bit {
                Some(bit) => (u32::from(byte) * 10 + u32::from(bit), 4),
                None => (byte.into(), 3),
            },
            Self::Rh(n) => (n.into(), 3),
            Self::Q(n) | Self::T(n) | Self::H(n) => (n.into(), 2),
            Self::M(n) | Self::Op(n) => (n.into(), 1),
            Self::Rp(n) => (n.into(), 3),
        }
    }

    /// Whether it is a single bit.
    pub fn is_bit(self) -> bool {
        match self {
            Self::I { bit, .. }
            | Self::Y { bit, .. }
            | Self::P { bit, .. }
            | Self::O { bit, .. }
            | Self::F { bit, .. } => bit.is_some(),
            Self::Rh(_)
            | Self::Q(_)
            | Self::T(_)
            | Self::H(_)
            | Self::M(_)
            | Self::Rp(_)
            | Self::Op(_) => false,
        }
    }
}

impl fmt::Display for NctName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (number, width) = self.digits();
        write!(f, "{}{number:0width$}", self.letters(), width = width as usize)
    }
}

impl Ord for NctName {
    /// Natural order: by letters, then by number, then as plain text, so that of two spellings of
    /// one number the one with more leading zeros is first.
    fn cmp(&self, other: &Self) -> Ordering {
        let ((a, a_width), (b, b_width)) = (self.digits(), other.digits());
        let widths = if a == 0 { a_width.cmp(&b_width) } else { b_width.cmp(&a_width) };
        self.letters().cmp(other.letters()).then(a.cmp(&b)).then(widths)
    }
}

impl PartialOrd for NctName {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

fn error(reason: &str) -> NctNameError {
    NctNameError { reason: reason.to_string() }
}

/// The byte that digits name, and the bit. `wide` digits name a word, by its lower byte; one digit more
/// names a bit of the byte. There are `bytes` bytes.
fn address(digits: &str, wide: usize, bytes: u16) -> Result<(u16, Option<u8>), NctNameError> {
    let number: u16 = digits.parse().map_err(|_| error("has no number after its letter"))?;
    let (byte, bit) = match digits.len() {
        n if n == wide => (number, None),
        n if n == wide + 1 => (number / 10, Some((number % 10) as u8)),
        _ if wide == 2 => return Err(error("needs three digits for a bit or two for a word")),
        _ => return Err(error("needs four digits for a bit or three for a word")),
    };
    if bit.is_some_and(|bit| bit > 7) {
        return Err(error("has a bit above 7"));
    }
    if byte >= bytes {
        let board = byte / 10;
        return Err(error(&format!("is on interface board {board}; the boards are 0 to 3")));
    }
    Ok((byte, bit))
}

/// The number of a register, `first` to `count - 1`, written with at most as many digits as the
/// canonical name has.
fn register(digits: &str, first: u16, count: u16) -> Result<u16, NctNameError> {
    let number: u16 = digits.parse().map_err(|_| error("has no number after its letters"))?;
    let width = if count > 100 || first > 0 { 3 } else { 2 };
    if digits.len() > width || !(first..count).contains(&number) {
        let last = count - 1;
        let range = format!("{first:0width$} to {last:0width$}");
        return Err(error(&format!("has a number beyond those of its kind, {range}")));
    }
    Ok(number)
}

impl FromStr for NctName {
    type Err = NctNameError;

    /// Reads a name, in letters of any case.
    fn from_str(text: &str) -> Result<Self, NctNameError> {
        let split = text.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(text.len());
        let (letters, digits) = text.split_at(split);
        if !digits.bytes().all(|b| b.is_ascii_digit()) || digits.is_empty() {
            return Err(error("is not a name: letters and digits make one, as in I002"));
        }
        let byte_bit = |bytes| address(digits, 2, bytes).map(|(byte, bit)| (byte as u8, bit));
        let number = |first, count| register(digits, first, count);
        let is = |name| letters.eq_ignore_ascii_case(name);
        Ok(if is("I") {
            let (byte, bit) = byte_bit(100)?;
            Self::I { byte, bit }
        } else if is("Y") {
            let (byte, bit) = byte_bit(100)?;
            Self::Y { byte, bit }
        } else if is("P") {
            let (byte, bit) = byte_bit(40)?;
            Self::P { byte, bit }
        } else if is("O") {
            let (byte, bit) = byte_bit(40)?;
            Self::O { byte, bit }
        } else if is("F") {
            let (byte, bit) = address(digits, 3, 1000)?;
            Self::F { byte, bit }
        } else if is("RH") {
            Self::Rh(number(0, super::RH_COUNT)?)
        } else if is("Q") {
            Self::Q(number(0, super::Q_COUNT)? as u8)
        } else if is("T") {
            Self::T(number(0, super::T_COUNT)? as u8)
        } else if is("H") {
            Self::H(number(0, super::H_COUNT)? as u8)
        } else if is("M") {
            Self::M(number(0, super::M_COUNT)? as u8)
        } else if is("RP") {
            Self::Rp(number(1, super::RP_COUNT)? as u8)
        } else if is("OP") {
            Self::Op(number(0, 3)? as u8)
        } else if is("V") {
            return Err(error("is a change test, no variable; the input itself is called I"));
        } else {
            return Err(error("begins with letters that name no kind of variable"));
        })
    }
}

#[cfg(test)]
mod tests {
    use alloc::{string::ToString, vec::Vec};

    use super::NctName;

    #[test]
    fn canonical_names_read_back() {
        for name in [
            "I002", "I00", "Y897", "Y40", "P012", "O327", "F0103", "F020", "F999", "RH060", "Q05",
            "T49", "H00", "M3", "RP001", "OP2",
        ] {
            assert_eq!(name.parse::<NctName>().unwrap().to_string(), name);
        }
        assert_eq!("rh60".parse::<NctName>().unwrap().to_string(), "RH060");
        assert_eq!("q5".parse::<NctName>().unwrap().to_string(), "Q05");
    }

    #[test]
    fn wrong_names_are_refused() {
        for name in [
            "", "I", "I1", "I008", "I0000", "P400", "O40", "F12", "F00000", "F0008", "RH200",
            "Q32", "T50", "M10", "RP000", "RP041", "OP3", "V012", "W1", "I+01", "002", "H000",
            "Iß1",
        ] {
            assert!(name.parse::<NctName>().is_err(), "{name}");
        }
    }

    #[test]
    fn wrong_numbers_are_refused_with_what_is_right() {
        for (name, reason) in [
            ("P900", "is on interface board 9; the boards are 0 to 3"),
            ("P90", "is on interface board 9; the boards are 0 to 3"),
            ("RP041", "has a number beyond those of its kind, 001 to 040"),
            ("T50", "has a number beyond those of its kind, 00 to 49"),
        ] {
            assert_eq!(name.parse::<NctName>().unwrap_err().reason, reason, "{name}");
        }
    }

    #[test]
    fn names_sort_in_natural_order() {
        let sorted = [
            "F003", "F0030", "F0100", "I00", "I000", "I002", "I02", "M1", "OP0", "RH100", "T02",
            "Y012",
        ];
        let mut names: Vec<NctName> = sorted.iter().rev().map(|n| n.parse().unwrap()).collect();
        names.sort();
        let names: Vec<_> = names.iter().map(ToString::to_string).collect();
        assert_eq!(names, sorted);
    }
}
