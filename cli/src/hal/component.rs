//! The text of a component: C and its makefile, from the templates beside this file.

use std::fmt::Write;

use super::pins::{Direction, Pin, Type};

/// The interface of libplcrt, which goes with the component.
pub(crate) const HEADER: &str = include_str!("../../../libplcrt/include/plcrt.h");

/// Checks the name of a component. It is a name of C in small letters, as names in HAL are, and so short that the
/// names of pins have room beside it.
///
/// # Errors
/// When the name is not of this form; the message says what is.
pub(crate) fn check_name(name: &str) -> Result<(), String> {
    let mut chars = name.chars();
    let begins = chars.next().is_some_and(|c| c.is_ascii_lowercase());
    let goes_on = chars.all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    match begins && goes_on && name.len() <= 20 {
        true => Ok(()),
        false => Err(format!(
            "`{name}` is not a name of a component: write --name with at most 20 small letters, digits \
             and `_`, a letter first"
        )),
    }
}

/// The text of the component in C. `name` is the name of the component, `source` that of the program's file.
pub(crate) fn source_text(name: &str, source: &str, pins: &[Pin]) -> String {
    let mut lines = String::new();
    for Pin { variable, name, ty, direction, meaning: _, range: (low, high) } in pins {
        let ty = match ty {
            Type::Bit => "HAL_BIT",
            Type::S32 => "HAL_S32",
            Type::Float => "HAL_FLOAT",
        };
        let direction = match direction {
            Direction::In => "HAL_IN",
            Direction::Out => "HAL_OUT",
            Direction::Io => "HAL_IO",
        };
        let _ = writeln!(
            lines,
            "    {{ \"{variable}\", \"{name}\", {ty}, {direction}, {low:?}, {high:?} }},"
        );
    }
    // The source's name is text in a comment and in a string of C.
    let source: String = source
        .chars()
        .map(|c| if c.is_ascii_graphic() && !"\"\\*?".contains(c) { c } else { '_' })
        .collect();
    let text = include_str!("component.c").replace("SOURCE", &source).replace("COMPONENT", name);
    text.replace("PINS}", &format!("{lines}}}"))
}

/// The makefile.
pub(crate) fn makefile(name: &str) -> String {
    include_str!("Makefile.in").replace("COMPONENT", name)
}
