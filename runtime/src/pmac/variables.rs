//! What users call a PMAC's variables: `P1`, `M11`, `I15`, `L3`, `Q5`, `&2Q5`, `X:$0700`.

use std::fmt;

use plcc_abi::pmac::{Controller, Definition, Field, Kind, Layout, PmacTables, Variable};

use crate::{NameError, ValueError};

/// Something with a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Name {
    /// A variable.
    Variable(Variable),
    /// Memory: an `X:` or `Y:` word, or two words as `D:`, `DP:`, `L:` or `F:` take them.
    Place(Definition),
}

impl Default for Name {
    fn default() -> Self {
        Self::Variable(Variable { kind: Kind::P, number: 0, system: 1 })
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Variable(Variable { kind, number, system }) => {
                if system > 1 {
                    write!(f, "&{system}")?;
                }
                write!(f, "{kind:?}{number}")
            }
            Self::Place(definition) => {
                let prefix = match definition {
                    Definition::X { .. } => "X",
                    Definition::Y { .. } => "Y",
                    Definition::D { .. } => "D",
                    Definition::Dp { .. } => "DP",
                    Definition::L { .. } => "L",
                    Definition::F { .. } => "F",
                    Definition::Star | Definition::Tw { .. } => "M",
                };
                write!(f, "{prefix}:${:X}", definition.address())
            }
        }
    }
}

/// Where a variable stands in a dump: `&2Q5` before letters, numbers by value.
pub(super) fn natural(name: &Name) -> (u32, Kind, u32) {
    match *name {
        Name::Variable(Variable { kind, number, system }) => {
            (if system > 1 { system } else { u32::MAX }, kind, number)
        }
        Name::Place(definition) => (u32::MAX, Kind::Q, definition.address()),
    }
}

/// Finds what a name means.
pub(super) fn parse(name: &str, layout: &Layout, tables: &PmacTables) -> Result<Name, NameError> {
    let unknown = || NameError::Unknown { name: name.into(), suggestion: suggest(name) };
    let unfit = |reason: String| NameError::Unfit { name: name.into(), reason };
    let upper: String =
        name.chars().filter(|c| !c.is_ascii_whitespace()).collect::<String>().to_ascii_uppercase();
    if let Some((space, address)) = upper.split_once(':') {
        let address = address_of(address).ok_or_else(unknown)?;
        if address > layout.address_mask() {
            return Err(unfit(beyond(layout, &format!("address ${:X}", layout.address_mask()))));
        }
        let field = Field::WORD;
        return Ok(Name::Place(match space {
            "X" => Definition::X { address, field },
            "Y" => Definition::Y { address, field },
            "D" => Definition::D { address },
            "DP" => Definition::Dp { address },
            "L" => Definition::L { address },
            "F" => Definition::F { address },
            _ => return Err(unknown()),
        }));
    }
    let (system, rest) = match upper.strip_prefix('&') {
        Some(rest) => {
            let at = rest.find('Q').ok_or_else(unknown)?;
            let (system, rest) = rest.split_at_checked(at).ok_or_else(unknown)?;
            let system = decimal(system).ok_or_else(unknown)?;
            if !(1..=layout.systems()).contains(&system) {
                let last = format!("coordinate system {}", layout.systems());
                return Err(unfit(beyond(layout, &last)));
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
        _ => return Err(unknown()),
    };
    let number = decimal(chars.as_str()).ok_or_else(unknown)?;
    if number >= layout.count {
        return Err(unfit(beyond(layout, &format!("{kind:?}{}", layout.count - 1))));
    }
    if kind == Kind::L && tables.l.binary_search_by_key(&number, |(number, _)| *number).is_err() {
        return Err(unfit("is an L-variable that the program does not define".into()));
    }
    Ok(Name::Variable(Variable { kind, number, system }))
}

fn beyond(layout: &Layout, last: &str) -> String {
    let help = match layout.controller {
        Controller::Pmac => "; --controller turbo has more",
        Controller::Turbo => "",
    };
    format!("is beyond {last}, the controller's last{help}")
}

/// `P[3]` and `P(3)` are how other languages write it.
fn suggest(name: &str) -> Option<String> {
    let mut chars = name.chars();
    let letter = chars.next().filter(char::is_ascii_alphabetic)?.to_ascii_uppercase();
    let digits: String = chars.filter(char::is_ascii_digit).collect();
    let number = decimal(&digits)?;
    "ILMPQ".contains(letter).then(|| format!("{letter}{number}"))
}

fn decimal(text: &str) -> Option<u32> {
    text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse().ok())?
}

fn address_of(text: &str) -> Option<u32> {
    match text.strip_prefix('$') {
        Some(hex) if hex.bytes().all(|byte| byte.is_ascii_hexdigit()) => {
            u32::from_str_radix(hex, 16).ok()
        }
        Some(_) => None,
        None => decimal(text),
    }
}

/// A value of a stimulus: an optional sign, then digits with or without a fraction, or `$hex`.
pub(super) fn number(text: &str) -> Result<f64, ValueError> {
    let error = || ValueError {
        value: text.into(),
        reason: "is no number: digits with or without a fraction, or $ and hexadecimal".into(),
    };
    let trimmed = text.trim();
    let (negative, digits) = match trimmed.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, trimmed.strip_prefix('+').unwrap_or(trimmed)),
    };
    let value = match digits.strip_prefix('$') {
        Some(hex) => {
            if hex.is_empty() || !hex.bytes().all(|byte| byte.is_ascii_hexdigit()) {
                return Err(error());
            }
            hex.bytes().fold(0.0, |sum, byte| {
                sum * 16.0 + f64::from(char::from(byte).to_digit(16).unwrap_or(0))
            })
        }
        None => {
            let plain = digits.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
            if !plain || !digits.bytes().any(|byte| byte.is_ascii_digit()) {
                return Err(error());
            }
            digits.parse::<f64>().map_err(|_| error())?
        }
    };
    Ok(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(name: &str) -> Result<String, String> {
        let tables = PmacTables { l: vec![(3, Definition::Star)], ..PmacTables::default() };
        parse(name, &Layout::new(Controller::Pmac), &tables)
            .map(|name| name.to_string())
            .map_err(|error| error.to_string())
    }

    #[test]
    fn names_have_one_spelling() {
        for (name, canonical) in [
            ("P1", "P1"),
            ("p0197", "P197"),
            ("I00", "I0"),
            ("L3", "L3"),
            ("Q5", "Q5"),
            ("&1Q5", "Q5"),
            ("&02q5", "&2Q5"),
            ("X:$0700", "X:$700"),
            ("y:65474", "Y:$FFC2"),
            ("L:$1001", "L:$1001"),
        ] {
            assert_eq!(found(name).as_deref(), Ok(canonical));
        }
    }

    #[test]
    fn a_wrong_name_is_refused_with_the_reason() {
        for name in
            ["", "P", "P-1", "P1.5", "PUMP", "&2P5", "&Q5", "X:", "X:$G", "Z:0", "P4294967296"]
        {
            assert!(found(name).is_err(), "{name}");
        }
        assert!(found("P1024").is_err_and(|error| error.contains("--controller turbo")));
        assert!(found("&9Q1").is_err());
        assert!(found("X:$10000").is_err());
        assert!(found("L4").is_err_and(|error| error.contains("does not define")));
        assert!(found("P[3]").is_err_and(|error| error.contains("did you mean `P3`?")));
    }

    #[test]
    fn values_of_a_stimulus_are_numbers_of_pmac() {
        for (text, value) in
            [("1", 1.0), ("-2.5", -2.5), ("$FF", 255.0), ("-$a", -10.0), (" .5 ", 0.5), ("+3", 3.0)]
        {
            assert_eq!(number(text), Ok(value));
        }
        for text in ["", "-", "1e5", "0x1", "$", "$G", "1.2.3", "nan", "inf", ".", "1 2", "--1"] {
            assert!(number(text).is_err(), "{text}");
        }
    }
}
