//! The classes of variables: the letters in front of their names.

use plcc_abi::nct::NctName;

/// The titles of the classes, in the order in which they are shown.
pub(in crate::nct) const CLASSES: &[&str] = &[
    "Inputs I",
    "Outputs Y",
    "Flags F",
    "Registers RH",
    "Counters Q",
    "20 ms timers T",
    "Second timers H",
    "Minute timers M",
    "Constants RP",
    "Registers OP",
    "Physical lines P, O",
];

/// The title of a variable's class.
pub(in crate::nct) fn title(name: &str) -> &'static str {
    match name.parse() {
        Ok(NctName::I { .. }) => "Inputs I",
        Ok(NctName::Y { .. }) => "Outputs Y",
        Ok(NctName::Rh(_)) => "Registers RH",
        Ok(NctName::Q(_)) => "Counters Q",
        Ok(NctName::T(_)) => "20 ms timers T",
        Ok(NctName::H(_)) => "Second timers H",
        Ok(NctName::M(_)) => "Minute timers M",
        Ok(NctName::Rp(_)) => "Constants RP",
        Ok(NctName::Op(_)) => "Registers OP",
        Ok(NctName::P { .. } | NctName::O { .. }) => "Physical lines P, O",
        Ok(NctName::F { .. }) | Err(_) => "Flags F",
    }
}
