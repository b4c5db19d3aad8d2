//! Reads declarations of digital inputs and outputs (PMI 3.1.2).

use plcc_abi::pmi::{Format, Lines};

use crate::pmi::read::{
    cursor::Cursor,
    declaration::{end, expect, new_name, number},
    diagnostic::{HelpIfNone, Result, error},
    syntax::PortLines,
    token::Kind,
};

/// The last port's number: there are 128 ports on each of 16 MAX boards.
const LAST_PORT: i64 = 2047;

/// `v = port/bit` or `v = port/bit1-bit2/type` (PMI 3.1.2).
pub(super) fn port_lines(cursor: &mut Cursor<'_>, found: &mut PortLines) -> Result {
    found.name = Some(new_name(cursor)?);
    expect(cursor, Kind::Eq, "=")?;
    let (port, port_span) = number(cursor)?;
    if !(0..=LAST_PORT).contains(&port) {
        return Err(error(13, port_span, format!("there is no port {port}"))
            .help("ports go from 0 to 2047: 128 for each of 16 MAX boards")
            .into());
    }
    let port = port as u16;
    found.port = Some((port, port_span));
    expect(cursor, Kind::Slash, "/")?;
    let low = bit(cursor)?;
    let lines = match cursor.kind() {
        None => Lines { port, low, count: 1, format: Format::Bit },
        Some(Kind::Minus) => {
            cursor.at += 1;
            group(cursor, port, low)?
        }
        Some(_) => {
            let what = format!("{} follows the line's bit", cursor.found());
            let help = "a group of bits is written port/bit-bit/type, for instance 2/0-7/BCD";
            return Err(cursor.error_here(5, what).help_if_none(help).into());
        }
    };
    end(cursor)?;
    found.lines = Some(lines);
    Ok(())
}

/// The number of a bit, 0 to 7.
fn bit(cursor: &mut Cursor<'_>) -> Result<u8> {
    let (bit, span) = number(cursor)?;
    match u8::try_from(bit) {
        Ok(bit @ 0..=7) => Ok(bit),
        _ => Err(error(16, span, format!("there is no bit {bit}"))
            .help("bits go from 0 to 7")
            .into()),
    }
}

/// `bit2/type` of a group whose first bit is `low`.
fn group(cursor: &mut Cursor<'_>, port: u16, low: u8) -> Result<Lines> {
    let span = cursor.span();
    let high = bit(cursor)?;
    if high <= low {
        return Err(error(
            16,
            span,
            format!("the last bit, {high}, is not above the first, {low}"),
        )
        .help("name the lowest bit first")
        .into());
    }
    expect(cursor, Kind::Slash, "/")?;
    let span = cursor.span();
    let format = match cursor.name() {
        Some(("B", _)) => Format::Binary,
        Some(("BCD", _)) => Format::Bcd,
        Some(("TWOC", _)) => Format::TwosComplement,
        Some((other, _)) => {
            return Err(error(17, span, format!("`{other}` is not a type of number"))
                .help("the types are B (binary), BCD and TWOC (two's complement)")
                .into());
        }
        None => {
            let what = format!("a type of number is expected, not {}", cursor.found());
            let help = "the types are B (binary), BCD and TWOC (two's complement)";
            return Err(cursor.error_here(17, what).help_if_none(help).into());
        }
    };
    Ok(Lines { port, low, count: high - low + 1, format })
}
