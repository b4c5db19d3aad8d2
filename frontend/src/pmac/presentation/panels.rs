//! The windows of PMAC's executive program: positions, jog ribbon, connectors (guide, Executive Program; Checking the
//! Flag Inputs; suggested M-variables of appendices E and F).

use plcc_abi::number;
use plcc_abi::pmac::Controller;

use super::motors::{self, MOTORS, Motor};
use crate::presentation::{Cell, PanelDraft, Read, Shown};

/// How many decimals positions have.
const DECIMALS: f64 = 1000.0;

/// The windows of a PMAC.
///
/// # Errors
/// On a Turbo PMAC, or when the registers can't be read.
pub(super) fn panels(controller: Controller, read: Read<'_>) -> Result<Vec<PanelDraft>, String> {
    if controller != Controller::Pmac {
        return Err(
            "the guide gives the registers of motors and connectors for PMAC only, not for Turbo PMAC"
                .into(),
        );
    }
    let numbers: Vec<u32> = (1..=MOTORS).collect();
    let motors = motors::motors(Some(controller), &numbers, read)?;
    Ok(vec![positions(&motors), flags(), connector()])
}

fn rounded(value: f64) -> String {
    number((value * DECIMALS).round() / DECIMALS)
}

/// The position window.
fn positions(motors: &[Motor]) -> PanelDraft {
    let cells = (1..).zip(motors).flat_map(|(motor, values): (u32, &Motor)| {
        let text = |label: &str, value: f64| Cell {
            label: format!("#{motor} {label}"),
            shown: Shown::Text(rounded(value)),
            ..Cell::default()
        };
        [
            text("position", values.position),
            text("velocity", values.velocity),
            text("following error", values.following_error),
        ]
    });
    PanelDraft {
        title: "Position window".into(),
        columns: 3,
        cells: cells.collect(),
        note: Some(
            "counts, and counts a millisecond, from the registers of the motors; plcc has no servo, so they hold what \
             the machine or the program writes there"
                .into(),
        ),
    }
}

/// What the jog ribbon shows of each motor, and its flags. They are single bits of words, so each cell has the word, and a
/// function for its bit.
fn flags() -> PanelDraft {
    let cells = (1..=MOTORS).flat_map(|motor| {
        let (low, high) = ((motor - 1) * 0x3C, (motor - 1) * 0xC0);
        let x = format!("X:${:X}", 0x3D + low);
        let y = format!("Y:${:X}", 0x814 + high);
        let channel = format!("X:${:X}", 0xC000 + 4 * (motor - 1));
        [
            Cell::formatted(format!("#{motor} in position"), y.clone(), bit::<0>),
            Cell::formatted("open loop", x, bit::<18>),
            Cell::formatted("home complete", y.clone(), bit::<10>),
            Cell::formatted("amplifier on", y, bit::<14>),
            Cell::formatted("HMFL", channel.clone(), bit::<20>),
            Cell::formatted("-LIM", channel.clone(), bit::<21>),
            Cell::formatted("+LIM", channel.clone(), bit::<22>),
            Cell::formatted("FAULT", channel, bit::<23>),
        ]
    });
    PanelDraft {
        title: "Motors and flags".into(),
        columns: 8,
        cells: cells.collect(),
        note: Some("a 1 in a flag is an open input. There is nothing to jog".into()),
    }
}

fn bit<const BIT: u32>(word: f64) -> String {
    (word as i64 >> BIT & 1).to_string()
}

/// A byte of a word as bits, the highest first.
fn byte<const LOW: u32>(word: f64) -> String {
    format!("{:08b}", word as i64 >> LOW & 0xFF)
}

/// The connectors: MI1 to MI8 and MO1 to MO8, the control panel and the multiplexer port.
fn connector() -> PanelDraft {
    let jpan = ["J-", "J+", "Prejog", "Start", "Step/Quit", "Stop", "Home", "Feed hold"];
    let bits: [fn(f64) -> String; 8] =
        [bit::<8>, bit::<9>, bit::<10>, bit::<11>, bit::<12>, bit::<13>, bit::<14>, bit::<15>];
    let mut cells = vec![
        Cell::formatted("MO8..MO1", "Y:$FFC2", byte::<8>),
        Cell::formatted("MI8..MI1", "Y:$FFC2", byte::<0>),
        Cell::formatted("DAT7..DAT0", "Y:$FFC1", byte::<0>),
        Cell::formatted("SEL7..SEL0", "Y:$FFC1", byte::<8>),
    ];
    cells.extend(jpan.iter().zip(bits).map(|(label, bit)| Cell::formatted(*label, "Y:$FFC0", bit)));
    cells.push(Cell::formatted("selector", "Y:$FFC0", |word| {
        format!("{:04b}", word as i64 >> 16 & 0xF)
    }));
    PanelDraft {
        title: "Connectors".into(),
        columns: 4,
        cells,
        note: Some("JOPTO, JTHW and JPAN; bits with the highest number first".into()),
    }
}
