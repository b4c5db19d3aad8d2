//! The terminals that a configuration expects, in their order, so that a terminal that was swapped is refused.

use std::fmt;

/// What the configuration says of a terminal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ExpectedTerminal {
    /// `*`: any terminal.
    Any,
    /// A name, as it stands in the terminal's memory.
    Name(String),
    /// `VENDOR:PRODUCT[:REVISION]`, hexadecimal.
    Numbers(u32, u32, Option<u32>),
}

impl ExpectedTerminal {
    /// Reads an element of `ethercat-terminals`; `None` if it can't be one.
    pub fn parse(text: &str) -> Option<Self> {
        if text == "*" {
            return Some(Self::Any);
        }
        if !text.contains(':') {
            return (!text.is_empty()).then(|| Self::Name(text.into()));
        }
        let number = |part: &str| {
            let digits = part.strip_prefix("0x").unwrap_or(part);
            let fits = digits.bytes().all(|digit| digit.is_ascii_hexdigit());
            fits.then(|| u32::from_str_radix(digits, 16).ok()).flatten()
        };
        let parts: Option<Vec<u32>> = text.split(':').map(number).collect();
        match *parts?.as_slice() {
            [vendor, product] => Some(Self::Numbers(vendor, product, None)),
            [vendor, product, revision] => Some(Self::Numbers(vendor, product, Some(revision))),
            _ => None,
        }
    }
}

impl fmt::Display for ExpectedTerminal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Any => f.write_str("any terminal"),
            Self::Name(name) => f.write_str(name),
            Self::Numbers(vendor, product, None) => write!(f, "0x{vendor:x}:0x{product:x}"),
            Self::Numbers(vendor, product, Some(revision)) => {
                write!(f, "0x{vendor:x}:0x{product:x}:0x{revision:x}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_terminal_is_refused() {
        for text in ["", "2:", "2:x", "1:2:3:4", "2:+3", "100000000:1"] {
            assert_eq!(ExpectedTerminal::parse(text), None, "{text}");
        }
    }
}
