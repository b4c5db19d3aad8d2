//! Inputs and outputs, with the connection points of the interface boards.

use plcc_abi::natural_cmp;
use plcc_abi::nct::NctName;

use crate::presentation::IoPoint;

/// The inputs and outputs among the variables that the program names.
pub(super) fn points(mut named: Vec<NctName>) -> Vec<IoPoint> {
    /// The first byte that belongs to no physical board.
    const BOARDS: u8 = 40;
    named.sort_by(|a, b| natural_cmp(&a.to_string(), &b.to_string()));
    named.dedup();
    let point = |name: NctName| {
        let (byte, bit, output) = match name {
            NctName::I { byte, bit: Some(bit) } => (byte, bit, false),
            NctName::Y { byte, bit: Some(bit) } => (byte, bit, true),
            _ => return None,
        };
        let line = match output {
            true => NctName::O { byte, bit: Some(bit) },
            false => NctName::P { byte, bit: Some(bit) },
        };
        let is_physical = byte < BOARDS;
        Some(IoPoint {
            name: name.to_string(),
            place: match is_physical {
                true => board_place(byte, bit, output),
                false => "NC".into(),
            },
            output,
            bit: true,
            lines: if is_physical { vec![line.to_string()] } else { vec![] },
        })
    };
    named.into_iter().filter_map(point).collect()
}

/// Where a line P or O is; `None` for other names.
pub(super) fn place_of_line(line: &str) -> Option<String> {
    match line.parse().ok()? {
        NctName::P { byte, bit: Some(bit) } => Some(board_place(byte, bit, false)),
        NctName::O { byte, bit: Some(bit) } => Some(board_place(byte, bit, true)),
        _ => None,
    }
}

/// The connection points of the lines of an interface board: bit by bit those of inputs 0 to 3 on connector I1; those
/// of inputs 4 to 6 on I2 are the same again (NCT 2.1.1).
const INPUT_PINS: [[u8; 8]; 4] = [
    [35, 32, 14, 13, 37, 36, 18, 17],
    [29, 28, 10, 9, 31, 30, 12, 11],
    [25, 24, 6, 5, 27, 26, 8, 7],
    [21, 20, 2, 1, 23, 22, 4, 3],
];
/// Those of outputs 0 to 3 on connector O1 (NCT 2.1.2).
const OUTPUT_PINS: [[u8; 8]; 4] = [
    [14, 12, 31, 29, 30, 13, 16, 15],
    [6, 4, 21, 23, 7, 5, 24, 22],
    [10, 8, 25, 27, 26, 9, 28, 11],
    [20, 34, 32, 1, 2, 35, 3, 33],
];

/// Where a line of an NCT's interface board is: `board 1 O1-14`, its connector and connection point. Lines beyond the
/// tables have byte and bit.
fn board_place(byte: u8, bit: u8, is_output: bool) -> String {
    let (board, own) = (byte / 10 + 1, usize::from(byte % 10));
    let (connector, pins) = match (is_output, own) {
        (true, 0..=3) => ("O1", OUTPUT_PINS.get(own)),
        (false, 0..=3) => ("I1", INPUT_PINS.get(own)),
        (false, 4..=6) => ("I2", INPUT_PINS.get(own - 4)),
        _ => ("", None),
    };
    match pins.and_then(|pins| pins.get(usize::from(bit))) {
        Some(pin) => format!("board {board} {connector}-{pin}"),
        None => format!("board {board} byte {own} bit {bit}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_interface_boards_have_connection_points() {
        for (byte, bit, is_output, place) in [
            (0, 0, false, "board 1 I1-35"),
            (12, 3, false, "board 2 I1-5"),
            (34, 7, false, "board 4 I2-17"),
            (6, 0, false, "board 1 I2-25"),
            (0, 0, true, "board 1 O1-14"),
            (23, 7, true, "board 3 O1-33"),
            (7, 1, false, "board 1 byte 7 bit 1"),
            (4, 1, true, "board 1 byte 4 bit 1"),
        ] {
            assert_eq!(board_place(byte, bit, is_output), place);
        }
    }
}
