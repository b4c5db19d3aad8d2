//! Reads numbers: addresses, which have a fixed number of digits, and constants (NCT 4.5, 4.6).

use crate::nct::read::{
    cursor::Cursor,
    diagnostic::{Read, SyntaxError, error, shown},
    operand::refuse,
};

/// Which digits an address may have, and with that the error of a digit that is missing.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Digits {
    /// Decimal digits; error 19.
    Decimal,
    /// Decimal digits, but the last one of the longest form names a bit and is octal; error 9.
    Octal,
}

/// The number in an address, and how many digits it was written with.
#[derive(Clone, Copy)]
pub(crate) struct Address {
    pub(crate) value: u16,
    pub(crate) len: u8,
}

/// Reads an address of either `least` or `most` digits. `start` is the offset at which the
/// statement begins, for the place of an error.
pub(crate) fn address(
    cursor: &mut Cursor<'_>,
    start: usize,
    least: u8,
    most: u8,
    digits: Digits,
) -> Read<Address> {
    let mut value = 0_u16;
    let mut len = 0_u8;
    while len < most {
        if len == least && cursor.gap() {
            break;
        }
        let octal = digits == Digits::Octal && len + 1 == most;
        match cursor.peek().and_then(|d| d.to_digit(10)) {
            Some(digit) if digit < 8 || !octal => {
                value = value.saturating_mul(10).saturating_add(digit as u16);
                len += 1;
                cursor.bump();
            }
            _ if len == least => {
                // An 8 or 9 can't be the number of the bit, and no statement begins with a digit.
                if cursor.peek().is_some_and(|d| d.is_ascii_digit()) {
                    return Err(not_octal(cursor, start));
                }
                break;
            }
            Some(_) => return Err(not_octal(cursor, start)),
            // A name in the place of the digits is taken as a part of this statement.
            None if len == 0
                && !cursor.gap()
                && cursor.peek().is_some_and(|c| c.is_ascii_uppercase()) =>
            {
                let fail = too_few(cursor, start, least, most, digits);
                return Err(refuse(cursor, |_| fail));
            }
            None => return Err(too_few(cursor, start, least, most, digits)),
        }
    }
    Ok(Address { value, len })
}

/// The error of an 8 or 9 as the number of a bit.
fn not_octal(cursor: &Cursor<'_>, start: usize) -> SyntaxError {
    error(
        9,
        cursor.span_from(start),
        format!("the last digit names a bit and is octal, not {}", shown(cursor.peek())),
        "bits are numbered 0 to 7; 8 and 9 do not exist",
    )
}

/// The error of a digit that is missing.
fn too_few(cursor: &Cursor<'_>, start: usize, least: u8, most: u8, digits: Digits) -> SyntaxError {
    let count = if least == most { format!("{most}") } else { format!("{least} or {most}") };
    let s = if most == 1 { "" } else { "s" };
    let number = if digits == Digits::Octal { 9 } else { 19 };
    let message = format!("{count} digit{s} must be here, not {}", shown(cursor.peek()));
    let (help, meant) = match cursor.peek() {
        Some('O') => ("this is the letter O; a zero was probably meant".into(), Some("0")),
        Some('I' | 'l') => ("this is a letter; a one was probably meant".into(), Some("1")),
        _ => (format!("write the number with {count} digit{s}, with leading zeros"), None),
    };
    let error = error(number, cursor.span_from(start), message, help);
    match meant {
        Some(digit) => Box::new(error.replace_at(cursor.span_here(), digit)),
        None => error,
    }
}

/// Reads a decimal constant, 0 to 65535; a gap ends it.
pub(crate) fn decimal(cursor: &mut Cursor<'_>, start: usize) -> Read<u16> {
    let mut value = 0_u32;
    let mut len = 0;
    while let Some(digit) = cursor.peek().and_then(|d| d.to_digit(10)) {
        if len > 0 && cursor.gap() {
            break;
        }
        value = value.saturating_mul(10).saturating_add(digit);
        len += 1;
        cursor.bump();
    }
    if len == 0 {
        return Err(error(
            19,
            cursor.span_from(start),
            format!("a decimal number must be here, not {}", shown(cursor.peek())),
            "write a number from 0 to 65535, or `.` and a hexadecimal one",
        ));
    }
    u16::try_from(value).map_err(|_| {
        error(
            16,
            cursor.span_from(start),
            "the number does not fit into two bytes",
            "OP has 16 bits: 65535 is the largest number",
        )
    })
}

/// Reads a hexadecimal constant after its point: one to four digits; a gap ends it.
pub(crate) fn hexadecimal(cursor: &mut Cursor<'_>, start: usize) -> Read<u16> {
    let mut value = 0_u16;
    let mut len = 0;
    while len < 4 && !(len > 0 && cursor.gap()) {
        let Some(digit) =
            cursor.peek().filter(|d| !d.is_ascii_lowercase()).and_then(|d| d.to_digit(16))
        else {
            break;
        };
        value = value << 4 | digit as u16;
        len += 1;
        cursor.bump();
    }
    if len == 0 {
        return Err(error(
            10,
            cursor.span_from(start),
            format!("a hexadecimal number must follow the point, not {}", shown(cursor.peek())),
            "write one to four of the digits 0-9 and A-F, such as .3FFF",
        ));
    }
    Ok(value)
}
