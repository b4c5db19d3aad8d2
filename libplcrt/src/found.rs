//! The variables that a C program has found, by the numbers that it was given for them.

use plcc_abi::place::Place;
use plcc_runtime::VariableKey;

use crate::c::{PLCRT_LINES, PLCRT_READ, PLCRT_WRITE};
use crate::control::{Control, Settable};

/// A variable that was found.
pub(crate) enum Found {
    /// To be read: a key for each element.
    Readable(Vec<VariableKey>),
    /// To be read from its physical lines.
    Lines(Place),
    /// To be set.
    Settable(Settable),
}

impl Found {
    /// Looks a variable up for a purpose, one of those of the C interface.
    ///
    /// # Errors
    /// When there is no such variable or purpose, or the variable can't be set.
    pub(crate) fn look_up(control: &Control, name: &str, purpose: u32) -> Result<Self, String> {
        match purpose {
            PLCRT_READ | PLCRT_LINES => {
                let variable = control.find(name)?;
                let lines = (purpose == PLCRT_LINES).then(|| control.lines(variable)).flatten();
                Ok(lines.map_or_else(|| Self::Readable(control.keys(variable)), Self::Lines))
            }
            PLCRT_WRITE => Ok(Self::Settable(control.find_settable(name)?)),
            _ => Err(format!("there is no purpose {purpose}")),
        }
    }
}

/// The variable with a number.
fn get(found: &[Found], number: i64) -> Option<&Found> {
    usize::try_from(number).ok().and_then(|number| found.get(number))
}

/// The value of a variable, or of an element of an array.
///
/// # Errors
/// When the variable was not found to be read, or has no such element.
pub(crate) fn element(
    control: &Control,
    found: &[Found],
    variable: i64,
    index: u32,
) -> Result<f64, String> {
    if let Some(Found::Lines(place)) = get(found, variable)
        && index == 0
    {
        return control.read_lines(*place);
    }
    let key = keys(found, variable)?.get(index as usize);
    let number = key.and_then(|key| control.get(*key).number());
    number.ok_or_else(|| format!("the variable has no element {index}"))
}

/// The number of elements of a variable that was found to be read.
///
/// # Errors
/// When it was not.
pub(crate) fn elements(found: &[Found], variable: i64) -> Result<u32, String> {
    match get(found, variable) {
        Some(Found::Lines(_)) => Ok(1),
        _ => Ok(keys(found, variable)?.len() as u32),
    }
}

/// The keys of the elements of a variable that was found to be read.
///
/// # Errors
/// When it was not.
pub(crate) fn keys(found: &[Found], variable: i64) -> Result<&[VariableKey], String> {
    match get(found, variable) {
        Some(Found::Readable(keys)) => Ok(keys),
        Some(Found::Lines(_)) => Ok(&[]),
        Some(Found::Settable(_)) => Err("the variable was found to be set, not to be read".into()),
        None => Err(format!("no variable with the number {variable} was found")),
    }
}

/// A variable that was found to be set.
///
/// # Errors
/// When it was not.
pub(crate) fn settable(found: &[Found], variable: i64) -> Result<Settable, String> {
    match get(found, variable) {
        Some(Found::Settable(variable)) => Ok(*variable),
        _ => Err(format!("no variable with the number {variable} was found to be set")),
    }
}
