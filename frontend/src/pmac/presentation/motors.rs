//! The motors of a PMAC as its registers show them: position, velocity, following error and status words (guide,
//! PMAC Position Registers; appendix E).
//!
//! plcc runs the PLC programs of a PMAC and not its servo. These registers hold what the machine (a stimulus, a
//! driver) or the program itself writes there, and 0 otherwise.

use std::collections::BTreeMap;

use plcc_abi::pmac::Controller;

use crate::presentation::Read;

/// How many motors a PMAC has, and how many coordinate systems.
pub(in crate::pmac::presentation) const MOTORS: u32 = 8;

/// The distance between the same registers of two neighbouring motors: below address $800, and from $800 on.
const LOW_STEP: u32 = 0x3C;
const HIGH_STEP: u32 = 0xC0;

/// How many units of I10 make a millisecond.
const UNITS_PER_MS: f64 = 8_388_608.0;

/// A bit of a status word and what the guide calls it.
type StatusBit = (u32, &'static str);

/// The bits of a motor's first status word, X:$003D, that appendix E names.
const MOTOR_X: &[StatusBit] = &[
    (13, "desired velocity zero"),
    (15, "dwell in progress"),
    (17, "running program"),
    (18, "open loop"),
    (21, "negative end limit"),
    (22, "positive end limit"),
];
/// Those of the second, Y:$0814.
const MOTOR_Y: &[StatusBit] = &[
    (0, "in position"),
    (1, "warning following error"),
    (2, "fatal following error"),
    (3, "amplifier fault"),
    (10, "home complete"),
    (11, "stopped on position limit"),
    (14, "amplifier enabled"),
];
/// The bits of a coordinate system's first status word, X:$0818.
const SYSTEM_X: &[StatusBit] = &[(0, "program running"), (4, "continuous motion request")];
/// Those of the second, Y:$0817.
const SYSTEM_Y: &[StatusBit] = &[
    (17, "in position"),
    (18, "warning following error"),
    (19, "fatal following error"),
    (20, "amplifier fault"),
    (21, "circle radius error"),
    (22, "run-time error"),
];
/// The bits of the first global status word, X:$0003.
const GLOBAL_X: &[StatusBit] = &[(20, "servo error"), (22, "real-time interrupt re-entry")];

/// What the registers of a motor say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::pmac::presentation) struct Motor {
    /// In counts.
    pub(in crate::pmac::presentation) position: f64,
    /// In counts a millisecond.
    pub(in crate::pmac::presentation) velocity: f64,
    /// In counts; 0 in open loop.
    pub(in crate::pmac::presentation) following_error: f64,
}

/// A word at an address in a space: `X:$3D`.
fn word(space: &str, address: u32) -> String {
    format!("{space}:${address:X}")
}

/// The names of the registers of a motor, numbered from 1.
#[derive(Clone, Debug)]
struct Registers {
    actual: String,
    bias: String,
    master: String,
    compensation: String,
    mode: String,
    velocity: String,
    error: String,
    /// The two status words.
    status: [String; 2],
    /// Ix08, Ix09 and Ix60.
    scales: [String; 3],
}

impl Registers {
    fn of(motor: u32) -> Self {
        let low = |space: &str, address: u32| word(space, address + (motor - 1) * LOW_STEP);
        let high = |space: &str, address: u32| word(space, address + (motor - 1) * HIGH_STEP);
        Self {
            actual: low("D", 0x2B),
            bias: high("D", 0x813),
            master: low("D", 0x2D),
            compensation: low("D", 0x46),
            mode: low("X", 0x2A),
            velocity: high("Y", 0x82A),
            error: high("D", 0x840),
            status: [low("X", 0x3D), high("Y", 0x814)],
            scales: ["08", "09", "60"].map(|number| format!("I{motor}{number}")),
        }
    }

    fn names(&self) -> Vec<String> {
        let Self { actual, bias, master, compensation, mode, velocity, error, .. } = self;
        let registers = [actual, bias, master, compensation, mode, velocity, error];
        registers.into_iter().chain(&self.status).chain(&self.scales).cloned().collect()
    }
}

/// `a / b`, or 0 if b is 0: a motor without a scale factor shows the position 0.
fn quotient(a: f64, b: f64) -> f64 {
    if b == 0.0 { 0.0 } else { a / b }
}

/// Refuses what needs the addresses of motor registers, which the guide gives for PMAC but not for Turbo PMAC.
fn require_pmac(controller: Option<Controller>) -> Result<(), String> {
    match controller {
        Some(Controller::Pmac) => Ok(()),
        Some(Controller::Turbo) => {
            Err("the guide gives the registers of motors for PMAC only, not for Turbo PMAC".into())
        }
        None => {
            Err("without the program the controller is not known; name its source after the socket"
                .into())
        }
    }
}

/// The motors of these numbers, all of one moment.
///
/// # Errors
/// On a Turbo PMAC, or when the registers can't be read.
pub(in crate::pmac::presentation) fn motors(
    controller: Option<Controller>,
    numbers: &[u32],
    read: Read<'_>,
) -> Result<Vec<Motor>, String> {
    require_pmac(controller)?;
    let registers: Vec<Registers> = numbers.iter().map(|&motor| Registers::of(motor)).collect();
    let mut names: Vec<String> = registers.iter().flat_map(Registers::names).collect();
    names.push("I10".into());
    let values = read(&names)?;
    let of = |name: &String| values.get(name).copied().unwrap_or(0.0);
    let cycle = values.get("I10").copied().unwrap_or(0.0);
    let motor = |own: &Registers| {
        let [ix08, ix09, ix60] = &own.scales;
        let scale = of(ix08) * 32.0;
        // Bit 16 of Ix05: handwheel offset mode.
        let offset = if has_bit(of(&own.mode), 16) { of(&own.master) } else { 0.0 };
        let is_open = has_bit(of(own.status.first().unwrap_or(ix08)), 18);
        let position = of(&own.actual) + of(&own.bias) + of(&own.compensation) - offset;
        let speed = signed(of(&own.velocity)) * UNITS_PER_MS;
        Motor {
            position: quotient(position, scale),
            velocity: quotient(speed, of(ix09) * 32.0 * cycle * (of(ix60) + 1.0)),
            following_error: if is_open { 0.0 } else { quotient(of(&own.error), scale) },
        }
    };
    Ok(registers.iter().map(motor).collect())
}

/// The status words of some motors as twelve hexadecimal digits each, and the names of the bits that are on.
pub(in crate::pmac::presentation) fn motor_statuses(
    controller: Option<Controller>,
    numbers: &[u32],
    read: Read<'_>,
) -> Result<Vec<String>, String> {
    let words = numbers.iter().map(|&motor| Registers::of(motor).status).collect();
    statuses(controller, read, words, [MOTOR_X, MOTOR_Y])
}

/// The same of coordinate systems.
pub(in crate::pmac::presentation) fn system_statuses(
    controller: Option<Controller>,
    numbers: &[u32],
    read: Read<'_>,
) -> Result<Vec<String>, String> {
    let step = |address: u32, system: u32| address + (system - 1) * HIGH_STEP;
    let words = numbers
        .iter()
        .map(|&system| [word("X", step(0x818, system)), word("Y", step(0x817, system))]);
    statuses(controller, read, words.collect(), [SYSTEM_X, SYSTEM_Y])
}

/// The global status words. The guide names bits of the first one only.
pub(in crate::pmac::presentation) fn global_status(
    controller: Option<Controller>,
    read: Read<'_>,
) -> Result<String, String> {
    let found = statuses(controller, read, vec![[word("X", 3), word("Y", 3)]], [GLOBAL_X, &[]])?;
    Ok(found.join("\n"))
}

fn statuses(
    controller: Option<Controller>,
    read: Read<'_>,
    words: Vec<[String; 2]>,
    bits: [&[StatusBit]; 2],
) -> Result<Vec<String>, String> {
    require_pmac(controller)?;
    let names: Vec<String> = words.iter().flatten().cloned().collect();
    let values = read(&names)?;
    Ok(words.iter().map(|words| status_text(words, bits, &values)).collect())
}

/// A pair of status words: twelve hexadecimal digits, and after them the names of the bits that are on.
fn status_text(
    words: &[String; 2],
    bits: [&[StatusBit]; 2],
    values: &BTreeMap<String, f64>,
) -> String {
    let values = words.each_ref().map(|name| values.get(name).copied().unwrap_or(0.0));
    let digits: String =
        values.iter().map(|value| format!("{:06X}", *value as i64 & 0xFF_FFFF)).collect();
    let named = values.iter().zip(bits).flat_map(|(value, bits)| {
        bits.iter().filter(|(bit, _)| has_bit(*value, *bit)).map(|(_, name)| *name)
    });
    let named: Vec<&str> = named.collect();
    if named.is_empty() { digits } else { format!("{digits} ({})", named.join(", ")) }
}

fn has_bit(word: f64, bit: u32) -> bool {
    word as i64 >> bit & 1 != 0
}

/// A word of 24 bits with a sign.
fn signed(word: f64) -> f64 {
    if word >= f64::from(1 << 23) { word - f64::from(1 << 24) } else { word }
}
