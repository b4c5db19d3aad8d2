//! HF and PF: searches in the tool pot table and other tables (NCT 4.14).

use plcc_abi::nct::arithmetic::{from_bcd, to_bcd};

use super::operand::{Fault, Locals, flag};

/// Where the tool pot table begins (NCT 2.3.2).
const POTS: u16 = 500;
/// The width's code in a pot's word.
const WIDTH: u16 = 0xC000;

/// HF: searches OP in a table. The register area holds the format (1 byte or 2), the table's
/// address and its length in bytes, a mask for its items, and receives the address found.
pub(super) fn find_item(locals: &mut Locals<'_>, area: u16, op: u16) {
    let found = search_item(locals, area, op);
    answer(locals, found, area.saturating_add(8));
}

fn search_item(locals: &Locals<'_>, area: u16, op: u16) -> Result<Option<u16>, Fault> {
    checked(Fault::of_area(area, 10))?;
    let size = u16::from(locals.byte(area));
    let mut fault = Fault { syntax: !matches!(size, 1 | 2), not_bcd: false };
    let length = locals.word(area + 4);
    let start = fault.address(locals.word(area + 2), length);
    checked(fault)?;
    let mask = locals.word(area + 6);
    let item = |at: u16| {
        if size == 1 { u16::from(locals.byte(at)) & mask } else { locals.word(at) & mask }
    };
    let wanted = if size == 1 { op & 0xFF } else { op };
    let items = length / size;
    Ok((0..items).map(|i| start + i * size).find(|&at| item(at) == wanted))
}

/// PF: searches the pot nearest to a given one that is free and as wide as OP says. The register
/// area holds the format (2, in its high byte 1 where both directions are searched), the address
/// of the pot where the search starts, and receives the address found.
pub(super) fn find_pot(locals: &mut Locals<'_>, area: u16, op: u16, magazine: i64) {
    let found = search_pot(locals, area, op, magazine);
    answer(locals, found, area.saturating_add(4));
}

fn search_pot(
    locals: &Locals<'_>,
    area: u16,
    op: u16,
    magazine: i64,
) -> Result<Option<u16>, Fault> {
    checked(Fault::of_area(area, 6))?;
    let wrong = Fault { syntax: true, not_bcd: false };
    let both = match locals.word(area) {
        0x0002 => false,
        0x0102 => true,
        _ => return Err(wrong),
    };
    let start = from_bcd(locals.word(area + 2)).ok_or(wrong)?;
    // The table with its row 0, the spindle, ends at F999 at the latest.
    let pots = u16::try_from(magazine).ok().filter(|pots| (1..=249).contains(pots)).ok_or(wrong)?;
    let row = start.checked_sub(POTS).filter(|offset| offset % 2 == 0).ok_or(wrong)? / 2;
    if row > pots {
        return Err(wrong);
    }
    let address = |pot: u16| POTS + 2 * pot;
    let width = op & WIDTH;
    if locals.word(address(row)) & WIDTH == width {
        return Ok(Some(address(row)));
    }
    let is_free = |pot: &u16| locals.word(address(*pot)) == width;
    // Pots 1 to `pots` are a ring; the spindle lies before pot 1 and after the last.
    let up = |distance: u16| (row + distance - 1) % pots + 1;
    let down = |distance: u16| {
        let from = if row == 0 { pots + 1 } else { row };
        (from + pots - distance - 1) % pots + 1
    };
    let found = (1..=pots).find_map(|distance| {
        let ahead = Some(up(distance)).filter(is_free);
        ahead.or_else(|| both.then(|| down(distance)).filter(is_free))
    });
    Ok(found.map(address))
}

fn checked(fault: Fault) -> Result<(), Fault> {
    if fault.any() { Err(fault) } else { Ok(()) }
}

/// Writes what was found, then the flags over it, should the register lie on their byte; both
/// statements know F0080 and F0081 alone.
fn answer(locals: &mut Locals<'_>, found: Result<Option<u16>, Fault>, register: u16) {
    if let Ok(Some(address)) = found {
        locals.set_word(register, to_bcd(address));
    }
    locals.set_flag(flag::SYNTAX, found.is_err());
    if let Ok(found) = found {
        locals.set_flag(flag::NOT_FOUND, found.is_none());
    }
}
