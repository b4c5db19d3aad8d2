//! The names that users give PMI's variables: in a stimulus, a trace or a dump.
//!
//! | name | what it is |
//! | --- | --- |
//! | `LS27`, `@FRO`, `A` | a variable; of an array, all of its elements |
//! | `A[3]` | an element of an array |
//! | `TC#COUNT` | the counter of the timer whose control contact is TC |
//! | `PORT1.0` | a port line: port and bit |

use alloc::{borrow::ToOwned, string::String};
use core::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

use super::PORTS;

/// A variable as users name it. Whether the program has it, its tables say.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PmiName {
    /// A variable, in capitals; of an array, all of its elements.
    Variable(String),
    /// An element of an array, by its index.
    Element(String, u32),
    /// The counter of the timer that a variable controls.
    Counter(String),
    /// A port line: the port, below [`PORTS`], and the bit, 0 to 7.
    Line(u16, u8),
}

/// What a name is in a program: a place in its tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum PmiVariable {
    /// The symbol with this index, of an array all of it.
    Symbol(u32),
    /// An element of an array: the index of its symbol, and the element's.
    Element(u32, u32),
    /// The counter of the timer with this index.
    Counter(u32),
    /// A physical line: port and bit.
    Line(u16, u8),
}

/// Why a text is not a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PmiNameError {
    /// It begins as a port line does, but there is no such port or bit.
    Line,
    /// What is after this variable is not an index of an element and not `#COUNT`.
    Index(String),
}

/// Decimal digits as a number; `None` for anything else, and beyond the type's range.
fn decimal<T: FromStr>(text: &str) -> Option<T> {
    text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse().ok())?
}

impl FromStr for PmiName {
    type Err = PmiNameError;

    /// Reads a name, in letters of any case, with spaces around it.
    fn from_str(text: &str) -> Result<Self, PmiNameError> {
        let name = text.trim().to_ascii_uppercase();
        if let Some((port, bit)) = name.strip_prefix("PORT").and_then(|rest| rest.split_once('.')) {
            let port = decimal(port).filter(|&port: &u16| u32::from(port) < PORTS);
            let bit = decimal(bit).filter(|&bit: &u8| bit < 8);
            return match port.zip(bit) {
                Some((port, bit)) => Ok(Self::Line(port, bit)),
                None => Err(PmiNameError::Line),
            };
        }
        let Some((variable, suffix)) = name.find(['[', '#']).map(|at| name.split_at(at)) else {
            return Ok(Self::Variable(name));
        };
        let variable = variable.to_owned();
        if suffix == "#COUNT" {
            return Ok(Self::Counter(variable));
        }
        let digits = suffix.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
        match digits.and_then(decimal) {
            Some(index) => Ok(Self::Element(variable, index)),
            None => Err(PmiNameError::Index(variable)),
        }
    }
}

impl fmt::Display for PmiName {
    /// The one spelling that traces and dumps use.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Variable(variable) => f.write_str(variable),
            Self::Element(variable, index) => write!(f, "{variable}[{index}]"),
            Self::Counter(variable) => write!(f, "{variable}#COUNT"),
            Self::Line(port, bit) => write!(f, "PORT{port}.{bit}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use alloc::string::ToString;

    use super::*;

    #[test]
    fn names_have_one_spelling() {
        for (text, spelling) in [
            ("ls27", "LS27"),
            (" @fro ", "@FRO"),
            ("a[03]", "A[3]"),
            ("tc#count", "TC#COUNT"),
            ("port007.1", "PORT7.1"),
            ("PORT", "PORT"),
        ] {
            let name: PmiName = text.parse().unwrap();
            assert_eq!(name.to_string(), spelling);
            assert_eq!(spelling.parse(), Ok(name));
        }
    }

    #[test]
    fn what_is_no_name_says_which_part_is_wrong() {
        for text in ["PORT2048.0", "PORT1.8", "PORT.1", "PORT1.", "PORT-1.0"] {
            assert_eq!(text.parse::<PmiName>(), Err(PmiNameError::Line), "{text}");
        }
        for text in ["A[", "A[]", "A[x]", "A[-1]", "A[4294967296]", "A#COUNTS", "A#"] {
            assert_eq!(text.parse::<PmiName>(), Err(PmiNameError::Index("A".into())), "{text}");
        }
    }
}
