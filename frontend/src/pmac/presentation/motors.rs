//! The motors of a PMAC as its registers show them: position, velocity, following error and status words (guide,
//! PMAC Position Registers; appendix E).
//!
//! Where motors are simulated, their positions have names of their own, on a Turbo PMAC too. Without simulation these registers
//! hold what the machine (a stimulus, a driver) or the program itself writes there, and 0 otherwise.

use std::collections::BTreeMap;

use plcc_abi::pmac::Controller;
use plcc_abi::pmac::motion::registers::{MotorRegisters, SystemRegisters, motors as last_motor};

use crate::presentation::Read;

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

/// A motor that is simulated and activated.
#[derive(Clone, Debug)]
pub(super) struct Simulated {
    /// From 1.
    pub(super) number: u32,
    /// The names of its two status words.
    pub(super) status: [String; 2],
}

/// The simulated motors that are activated (Ix00); none where motion is not simulated.
///
/// # Errors
/// When values can't be read.
pub(super) fn simulated(controller: Controller, read: Read<'_>) -> Result<Vec<Simulated>, String> {
    let numbers = 1..=last_motor(controller);
    let activated = |motor: u32| format!("I{motor}00");
    let actual = |motor: u32| format!("#{motor}.ACT");
    let names: Vec<String> =
        numbers.clone().flat_map(|motor| [activated(motor), actual(motor)]).collect();
    let values = read(&names)?;
    let is_on = |motor: &u32| {
        values.contains_key(&actual(*motor)) && values.get(&activated(*motor)) == Some(&1.0)
    };
    let motors = numbers.filter(is_on).map(|number| {
        let at = MotorRegisters::of(controller, number);
        Simulated { number, status: [word("X", at.status_x), word("Y", at.status_y)] }
    });
    Ok(motors.collect())
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
            Err("the guide gives the registers of motors for PMAC only, not for Turbo PMAC; they can be read with --simulate"
                .into())
        }
        None => Err(no_program()),
    }
}

/// Why nothing is known of motors without the program.
fn no_program() -> String {
    "without the program the controller is not known; name its source after the socket".into()
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
    if let Some(known) = controller
        && let Some(motors) = simulated_motors(known, numbers, read)?
    {
        return Ok(motors);
    }
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

/// The same where motors are simulated; `None` where they are not.
fn simulated_motors(
    controller: Controller,
    numbers: &[u32],
    read: Read<'_>,
) -> Result<Option<Vec<Motor>>, String> {
    // Actual position, velocity and following error, and what the bias is computed from.
    let names = |motor: u32| {
        let bias = word("D", MotorRegisters::of(controller, motor).bias);
        let of = |value: &str| format!("#{motor}.{value}");
        [of("ACT"), of("VEL"), of("FE"), bias, format!("I{motor}08")]
    };
    let values = read(&numbers.iter().flat_map(|&motor| names(motor)).collect::<Vec<_>>())?;
    let tenth = |value: f64| (value * 10.0).round() / 10.0 + 0.0;
    let motors = numbers.iter().map(|&motor| {
        let values = names(motor).each_ref().map(|name| values.get(name).copied());
        let [Some(actual), Some(velocity), Some(error), bias, ix08] = values else { return None };
        let bias = quotient(bias.unwrap_or(0.0), ix08.unwrap_or(0.0) * 32.0);
        Some(Motor {
            position: tenth(actual + bias),
            velocity: tenth(velocity),
            following_error: tenth(error),
        })
    });
    Ok(motors.collect())
}

/// The status words of some motors as twelve hexadecimal digits each, and the names of the bits that are on.
pub(in crate::pmac::presentation) fn motor_statuses(
    controller: Option<Controller>,
    numbers: &[u32],
    read: Read<'_>,
) -> Result<Vec<String>, String> {
    let words = |known: Controller, motor: u32| {
        let at = MotorRegisters::of(known, motor);
        [word("X", at.status_x), word("Y", at.status_y)]
    };
    statuses(controller, read, numbers, words, [MOTOR_X, MOTOR_Y])
}

/// The same of coordinate systems.
pub(in crate::pmac::presentation) fn system_statuses(
    controller: Option<Controller>,
    numbers: &[u32],
    read: Read<'_>,
) -> Result<Vec<String>, String> {
    let words = |known: Controller, system: u32| {
        let at = SystemRegisters::of(known, system);
        [word("X", at.status_x), word("Y", at.status_y)]
    };
    statuses(controller, read, numbers, words, [SYSTEM_X, SYSTEM_Y])
}

/// The global status words. The guide names bits of the first one only.
pub(in crate::pmac::presentation) fn global_status(
    controller: Option<Controller>,
    read: Read<'_>,
) -> Result<String, String> {
    let words = |known: Controller, _: u32| {
        let address = if known == Controller::Turbo { 6 } else { 3 };
        [word("X", address), word("Y", address)]
    };
    Ok(statuses(controller, read, &[0], words, [GLOBAL_X, &[]])?.join("\n"))
}

/// The status words of some motors or coordinate systems, which `words` names. The guide has their addresses for PMAC alone; a
/// Turbo PMAC has something in them where its motors are simulated.
fn statuses(
    controller: Option<Controller>,
    read: Read<'_>,
    numbers: &[u32],
    words: impl Fn(Controller, u32) -> [String; 2],
    bits: [&[StatusBit]; 2],
) -> Result<Vec<String>, String> {
    let is_simulated = !read(&["#1.ACT".to_owned()])?.is_empty();
    if !is_simulated {
        require_pmac(controller)?;
    }
    let known = controller.ok_or_else(no_program)?;
    let words: Vec<[String; 2]> = numbers.iter().map(|&number| words(known, number)).collect();
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
