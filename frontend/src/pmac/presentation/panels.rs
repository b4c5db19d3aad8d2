//! The windows of PMAC's executive program: the jog ribbon, which moves simulated motors, and the connectors (guide, Executive
//! Program; suggested M-variables of appendices E and F).

use plcc_abi::number;
use plcc_abi::pmac::Controller;

use super::motors::{self, Simulated};
use crate::presentation::{Cell, PanelDraft, Read, Shown};

/// How many decimals positions have.
const DECIMALS: f64 = 1000.0;

/// The windows of a PMAC. Motors have some only where they are simulated: without that nothing moves, and nothing takes a jog.
///
/// # Errors
/// When values can't be read.
pub(super) fn panels(controller: Controller, read: Read<'_>) -> Result<Vec<PanelDraft>, String> {
    let mut panels = vec![];
    let motors = motors::simulated(controller, read)?;
    if !motors.is_empty() {
        panels.push(jog_ribbon(&motors));
    }
    // The guide has the addresses of connectors for PMAC alone.
    if controller == Controller::Pmac {
        panels.push(connector());
    }
    Ok(panels)
}

fn rounded(value: f64) -> String {
    number((value * DECIMALS).round() / DECIMALS)
}

/// Each motor with its position, velocity, following error and state, and below them the commands that jog it.
fn jog_ribbon(motors: &[Simulated]) -> PanelDraft {
    let cells = motors.iter().flat_map(|motor| {
        let number = motor.number;
        let value =
            |label: &str, name: &str| Cell::formatted(label, format!("#{number}.{name}"), rounded);
        let command =
            |word: &str| Cell::command(format!("#{number}{word}"), format!("#{number}{word}"), "1");
        let [x, y] = motor.status.clone();
        [
            value(&format!("#{number}"), "ACT"),
            value("v", "VEL"),
            value("FE", "FE"),
            Cell { shown: Shown::FormattedBy(x, y, state), ..Cell::default() },
            Cell::gap(),
            Cell::gap(),
            command("J-"),
            command("J/"),
            command("J+"),
            command("HM"),
            command("J="),
            command("K"),
        ]
    });
    PanelDraft {
        title: "Jog ribbon".into(),
        columns: 6,
        cells: cells.collect(),
        note: Some(
            "simulated motors: position in counts, velocity in counts/ms, following error. J= goes to the pre-jog position"
                .into(),
        ),
    }
}

/// What two status words say of a motor.
fn state(x: f64, y: f64) -> String {
    let is_on = |word: f64, bit: u32| word as i64 >> bit & 1 != 0;
    let states = [
        (is_on(y, 0), "in pos"),
        (is_on(y, 10), "homed"),
        (is_on(x, 18), "open loop"),
        (is_on(x, 22), "negative limit"),
        (is_on(x, 21), "positive limit"),
        (is_on(y, 2), "fatal error"),
        (is_on(y, 3), "amplifier fault"),
    ];
    let on: Vec<&str> = states.into_iter().filter_map(|(on, name)| on.then_some(name)).collect();
    if on.is_empty() { "moves".into() } else { on.join(" ") }
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
