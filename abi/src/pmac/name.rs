//! The names that users give a PMAC's variables: in a stimulus, a trace or a dump.
//!
//! | name | what it is |
//! | --- | --- |
//! | `P1`, `M11`, `I15`, `L3` | a variable |
//! | `Q5`, `&2Q5` | a Q-variable of coordinate system 1, and of system 2 |
//! | `X:$0700`, `Y:65474` | a word of memory |
//! | `Y:$FFC2,8`, `Y:$FFC2,8,4` | a bit of a word, and several bits from one on |
//! | `D:$28`, `DP:$D200`, `L:$1001`, `F:$D200` | two words of memory, in that format |
//! | `#1.CMD`, `&1.X` | a value of a simulated motor or coordinate system: [`MotionName`] |
//! | `#1J+`, `&1B10`, `^A` | an on-line command for them: [`Online`](super::motion::Online) |
//! | `PLC3`, `PLCC3` | whether a PLC or PLCC is enabled: see [`PlcOp`](super::PlcOp) for what setting it does |

use alloc::{format, string::String};
use core::fmt;

use serde::{Deserialize, Serialize};

use super::motion::MotionName;
use super::{Controller, Definition, Field, Kind, Layout, Variable};

/// A variable or a place of memory, as users name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum PmacName {
    /// A variable.
    Variable(Variable),
    /// Memory: an `X:` or `Y:` word or bits of one, or two words as `D:`, `DP:`, `L:` or `F:` take them.
    Memory(Definition),
    /// The state of a PLC: 0 disabled, 1 enabled, 2 paused.
    Plc {
        /// Whether it is a PLCC.
        compiled: bool,
        /// Its number, 0 to 31.
        number: u32,
    },
    /// A value of a simulated motor or coordinate system.
    Motion(MotionName),
}

/// The highest number of a PLC.
const LAST_PLC: u32 = 31;

impl Default for PmacName {
    /// P0.
    fn default() -> Self {
        Self::Variable(Variable { kind: Kind::P, number: 0, system: 1 })
    }
}

/// Why a text is not a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PmacNameError {
    /// It does not look like a name.
    Malformed,
    /// Its number, address or coordinate system is beyond the controller's last; the message follows
    /// the name.
    Beyond(String),
}

impl PmacName {
    /// Reads a name, in letters of any case, with spaces anywhere. Whether an L-variable is defined,
    /// the program's tables say.
    ///
    /// # Errors
    /// When the text is not a name, or `layout`'s controller has no such variable or address.
    pub fn parse(text: &str, layout: &Layout) -> Result<Self, PmacNameError> {
        let upper: String = text
            .chars()
            .filter(|c| !c.is_ascii_whitespace())
            .map(|c| c.to_ascii_uppercase())
            .collect();
        if let Some((sign, number, name)) = MotionName::parse(&upper) {
            return match MotionName::exists(sign, number, layout) {
                Ok(()) => Ok(Self::Motion(name)),
                Err((what, last)) => Err(beyond(layout, &format!("{what}{last}"))),
            };
        }
        if let Some((space, address)) = upper.split_once(':') {
            let (address, bits) = match address.split_once(',') {
                Some((address, bits)) => (address, Some(bits)),
                None => (address, None),
            };
            let address = address_of(address).ok_or(PmacNameError::Malformed)?;
            if address > layout.address_mask() {
                return Err(beyond(layout, &format!("address ${:X}", layout.address_mask())));
            }
            let field = match bits {
                None => Field::WORD,
                Some(bits) if matches!(space, "X" | "Y") => bits_of(bits)?,
                Some(_) => return Err(PmacNameError::Malformed),
            };
            return Ok(Self::Memory(match space {
                "X" => Definition::X { address, field },
                "Y" => Definition::Y { address, field },
                "D" => Definition::D { address },
                "DP" => Definition::Dp { address },
                "L" => Definition::L { address },
                "F" => Definition::F { address },
                _ => return Err(PmacNameError::Malformed),
            }));
        }
        if let Some(rest) = upper.strip_prefix("PLC") {
            let (compiled, digits) =
                rest.strip_prefix('C').map_or((false, rest), |rest| (true, rest));
            let number = decimal(digits).ok_or(PmacNameError::Malformed)?;
            if number > LAST_PLC {
                return Err(PmacNameError::Beyond(format!(
                    "is beyond PLC{LAST_PLC}, the last one"
                )));
            }
            return Ok(Self::Plc { compiled, number });
        }
        let (system, rest) = match upper.strip_prefix('&') {
            Some(rest) => {
                let split = rest.find('Q').and_then(|at| rest.split_at_checked(at));
                let (system, rest) = split.ok_or(PmacNameError::Malformed)?;
                let system = decimal(system).ok_or(PmacNameError::Malformed)?;
                if !(1..=layout.systems()).contains(&system) {
                    let last = format!("coordinate system {}", layout.systems());
                    return Err(beyond(layout, &last));
                }
                (system, rest)
            }
            None => (1, upper.as_str()),
        };
        let mut chars = rest.chars();
        let kind = match chars.next() {
            Some('I') => Kind::I,
            Some('L') => Kind::L,
            Some('M') => Kind::M,
            Some('P') => Kind::P,
            Some('Q') => Kind::Q,
            _ => return Err(PmacNameError::Malformed),
        };
        let number = decimal(chars.as_str()).ok_or(PmacNameError::Malformed)?;
        if number >= layout.count {
            return Err(beyond(layout, &format!("{kind:?}{}", layout.count - 1)));
        }
        Ok(Self::Variable(Variable { kind, number, system }))
    }

    /// The order of lines: by words, then by bits.
    pub fn line_order(&self) -> (bool, u32, u8) {
        match *self {
            Self::Memory(Definition::X { address, field }) => (false, address, field.offset),
            Self::Memory(Definition::Y { address, field }) => (true, address, field.offset),
            _ => (false, 0, 0),
        }
    }

    /// The order of a dump: Q-variables of the coordinate systems from 2 on, then the others by
    /// letter and number. A dump has neither places of memory nor PLCs; by address and number they come
    /// among the Q-variables and the P-variables.
    pub fn dump_order(&self) -> (u32, Kind, u32) {
        match *self {
            Self::Variable(Variable { kind, number, system }) => {
                (if system > 1 { system } else { u32::MAX }, kind, number)
            }
            Self::Memory(definition) => (u32::MAX, Kind::Q, definition.address()),
            Self::Plc { compiled, number } => (u32::MAX, Kind::P, 2 * number + u32::from(compiled)),
            Self::Motion(MotionName::Motor(number, _)) => (0, Kind::I, u32::from(number)),
            Self::Motion(MotionName::System(number, _)) => (0, Kind::L, u32::from(number)),
            Self::Motion(MotionName::Online(command)) => (0, Kind::M, u32::from(command.number)),
        }
    }
}

impl fmt::Display for PmacName {
    /// The one spelling that traces and dumps use.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Variable(Variable { kind, number, system }) => {
                if system > 1 {
                    write!(f, "&{system}")?;
                }
                write!(f, "{kind:?}{number}")
            }
            Self::Memory(definition) => {
                let prefix = match definition {
                    Definition::X { .. } => "X",
                    Definition::Y { .. } => "Y",
                    Definition::D { .. } => "D",
                    Definition::Dp { .. } => "DP",
                    Definition::L { .. } => "L",
                    Definition::F { .. } => "F",
                    Definition::Star | Definition::Tw { .. } => "M",
                };
                write!(f, "{prefix}:${:X}", definition.address())?;
                match definition {
                    Definition::X { field, .. } | Definition::Y { field, .. }
                        if field != Field::WORD =>
                    {
                        match field.width {
                            1 => write!(f, ",{}", field.offset),
                            width => write!(f, ",{},{width}", field.offset),
                        }
                    }
                    _ => Ok(()),
                }
            }
            Self::Plc { compiled, number } => {
                write!(f, "{}{number}", if compiled { "PLCC" } else { "PLC" })
            }
            Self::Motion(name) => write!(f, "{name}"),
        }
    }
}

/// What is beyond the controller's last, with the help that Turbo PMAC has more.
fn beyond(layout: &Layout, last: &str) -> PmacNameError {
    let help = match layout.controller {
        Controller::Pmac => "; --controller turbo has more",
        Controller::Turbo => "",
    };
    PmacNameError::Beyond(format!("is beyond {last}, the controller's last{help}"))
}

/// The name that was probably meant: `P3` for `P[3]` and `P(3)`, as other languages write it.
pub fn suggest(text: &str) -> Option<String> {
    let mut chars = text.chars();
    let letter = chars.next().filter(char::is_ascii_alphabetic)?.to_ascii_uppercase();
    let digits: String = chars.filter(char::is_ascii_digit).collect();
    let number = decimal(&digits)?;
    "ILMPQ".contains(letter).then(|| format!("{letter}{number}"))
}

/// The bits behind the address of a word: the first one, and how many there are if they are several.
fn bits_of(text: &str) -> Result<Field, PmacNameError> {
    let (offset, width) = text.split_once(',').unwrap_or((text, "1"));
    let number = |text| decimal(text).and_then(|number| u8::try_from(number).ok());
    let (offset, width) = number(offset).zip(number(width)).ok_or(PmacNameError::Malformed)?;
    if width == 0 || offset.checked_add(width).is_none_or(|end| end > 24) {
        return Err(PmacNameError::Beyond(
            "has bits beyond those of a word, which are 0 to 23".into(),
        ));
    }
    Ok(Field { offset, width, ..Field::WORD })
}

fn decimal(text: &str) -> Option<u32> {
    text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse().ok())?
}

/// An address in decimal, or in hexadecimal after `$`.
fn address_of(text: &str) -> Option<u32> {
    match text.strip_prefix('$') {
        Some(hex) if hex.bytes().all(|byte| byte.is_ascii_hexdigit()) => {
            u32::from_str_radix(hex, 16).ok()
        }
        Some(_) => None,
        None => decimal(text),
    }
}

#[cfg(test)]
mod tests {
    use alloc::string::ToString;

    use super::*;

    #[test]
    fn names_have_one_spelling() {
        let layout = Layout::new(Controller::Pmac);
        for (text, spelling) in [
            ("P1", "P1"),
            ("p0197", "P197"),
            ("I00", "I0"),
            ("L3", "L3"),
            ("Q5", "Q5"),
            ("&1Q5", "Q5"),
            ("&02q5", "&2Q5"),
            ("X:$0700", "X:$700"),
            ("y:65474", "Y:$FFC2"),
            ("y:$ffc2, 08", "Y:$FFC2,8"),
            ("X:$700,4,4", "X:$700,4,4"),
            ("X:$700,0,24", "X:$700"),
            ("L:$1001", "L:$1001"),
            ("d p:$d2 00", "DP:$D200"),
            ("plc 3", "PLC3"),
            ("PLCC031", "PLCC31"),
        ] {
            let name = PmacName::parse(text, &layout).unwrap();
            assert_eq!(name.to_string(), spelling);
            assert_eq!(PmacName::parse(spelling, &layout), Ok(name));
        }
    }

    #[test]
    fn a_wrong_name_is_refused_with_the_reason() {
        let pmac = Layout::new(Controller::Pmac);
        for text in [
            "",
            "P",
            "P-1",
            "P1.5",
            "PUMP",
            "&2P5",
            "&Q5",
            "X:",
            "X:$G",
            "Z:0",
            "L:0,1",
            "X:0,",
            "X:0,1,",
            "P4294967296",
        ] {
            let error = PmacName::parse(text, &pmac);
            assert_eq!(error, Err(PmacNameError::Malformed), "{text}");
        }
        let turbo = Layout::new(Controller::Turbo);
        for text in ["PLC32", "PLCC99"] {
            let error = PmacName::parse(text, &pmac);
            assert!(matches!(error, Err(PmacNameError::Beyond(_))), "{text}");
        }
        for text in ["PLC", "PLCC", "PLCD1", "PLC-1"] {
            assert_eq!(PmacName::parse(text, &pmac), Err(PmacNameError::Malformed), "{text}");
        }
        for text in ["X:$700,24", "Y:0,20,5", "X:0,3,0"] {
            let error = PmacName::parse(text, &pmac);
            assert!(matches!(error, Err(PmacNameError::Beyond(_))), "{text}");
        }
        for text in ["P1024", "&9Q1", "X:$10000"] {
            let error = PmacName::parse(text, &pmac);
            assert!(matches!(error, Err(PmacNameError::Beyond(_))), "{text}");
            assert!(PmacName::parse(text, &turbo).is_ok(), "{text}");
        }
    }
}
