//! Words of PMAC's memory for `plcc explain X:$0700`: what the guide's memory map says of them, and
//! which of the guide's M-variables stand for their bits. Turbo PMAC's memory is laid out otherwise
//! and is not described.

use std::fmt::Write;

use super::tables::m_variables;
use crate::common::Controller;
use crate::language::Topic;

/// A range of addresses: the first and the last, what the X words hold, what the Y words hold.
type AddressRange = (u32, u32, &'static str, &'static str);

const CALCULATION: &str = "registers that the control calculates with";
const BUFFERS: &str = "programs and tables of the user";
const DUAL_PORTED: &str = "dual-ported RAM, bits 0 to 15";
const GATES: &str = "registers of the DSP-Gates: encoders, outputs, flags";
const P_VARIABLES: &str = "P-variables: P0 is L:$1000";
const Q_VARIABLES: &str = "Q-variables: Q0 of coordinate system 1 is L:$1400";
const TIMER: &str = "a timer: one less every servo cycle, 24 bits with a sign";

/// The guide's memory map. Words with a meaning of their own come first, since the first range
/// that holds an address counts.
const MAP: &[AddressRange] = &[
    (0x0000, 0x0000, "the servo counter: one more every servo cycle, 24 bits", CALCULATION),
    (0x0700, 0x0701, TIMER, TIMER),
    (0x0000, 0x0FFF, CALCULATION, CALCULATION),
    (0x1000, 0x13FF, P_VARIABLES, P_VARIABLES),
    (0x1400, 0x17FF, Q_VARIABLES, Q_VARIABLES),
    (0x1800, 0xBBFF, BUFFERS, BUFFERS),
    (0xBC00, 0xBFFF, "storage of user-written servo algorithms", "definitions of the M-variables"),
    (0xC000, 0xC03F, GATES, GATES),
    (0xD000, 0xDFFF, DUAL_PORTED, DUAL_PORTED),
    (0xE000, 0xEFFF, "VME setup registers, bits 0 to 7", "VME mailbox registers, bits 0 to 7"),
    (0xF000, 0xFFFF, "nothing", "inputs and outputs"),
];

/// The letter and the address of a word such as `X:$700`; D and L name both words of an address.
fn word(name: &str) -> Option<(char, u32)> {
    let (letter, address) = name.split_once(':')?;
    let letter = match letter.trim() {
        "X" | "x" => 'X',
        "Y" | "y" => 'Y',
        "D" | "d" | "DP" | "dp" => 'D',
        "L" | "l" | "F" | "f" => 'L',
        _ => return None,
    };
    let address = address.split(',').next().unwrap_or("").trim();
    let address = match address.strip_prefix('$') {
        Some(digits) => u32::from_str_radix(digits, 16),
        None => address.parse(),
    };
    address.ok().map(|address| (letter, address))
}

/// What `plcc explain Y:$FFC2` prints; nothing for what is not an address, and for Turbo PMAC.
pub(crate) fn explain(name: &str, controller: Option<Controller>) -> Option<String> {
    let (letter, address) = word(name).filter(|_| controller != Some(Controller::Turbo))?;
    let range = MAP.iter().find(|(first, last, ..)| (*first..=*last).contains(&address))?;
    let (_, _, x, y) = range;
    let mut page = format!("{letter}:${address:04X}\n");
    if letter != 'Y' {
        let _ = writeln!(page, "  X: {x}");
    }
    if letter != 'X' {
        let _ = writeln!(page, "  Y: {y}");
    }
    for row in m_variables() {
        let Some((of, at)) = word(row.definition) else { continue };
        let touches = of == letter || !matches!(of, 'X' | 'Y') || !matches!(letter, 'X' | 'Y');
        if at == address && touches {
            let _ = writeln!(page, "  M{}->{}: {}", row.number, row.definition, row.meaning);
        }
    }
    page.push_str("  PMAC guide, Memory Map and appendices E and F; of PMAC, not of Turbo PMAC\n");
    Some(page)
}

/// The ranges of the map as topics of `plcc explain`.
pub(crate) fn topics() -> impl Iterator<Item = Topic> {
    let topic = |letter: char, first: u32, meaning: &str| Topic {
        name: format!("{letter}:${first:04X}"),
        meaning: meaning.to_owned(),
    };
    MAP.iter().flat_map(move |(first, _, x, y)| [topic('X', *first, x), topic('Y', *first, y)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_have_their_variables_and_their_range() {
        let page = explain("y:65474", None).unwrap();
        assert!(page.starts_with("Y:$FFC2\n  Y: inputs and outputs\n"), "{page}");
        assert!(page.contains("M1->Y:$FFC2,8,1: machine output 1"), "{page}");
        assert_eq!(explain("Y:$FFC2", Some(Controller::Turbo)), None);
        let page = explain("X:$0", None).unwrap();
        assert!(page.contains("servo counter"), "{page}");
        for name in ["X:$10000", "Z:$0", "X:", "X", "X:$G", "A:B:C"] {
            assert_eq!(explain(name, None), None, "{name}");
        }
    }
}
