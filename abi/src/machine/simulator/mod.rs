//! The table `[simulator]`: the other side of the control, which `--simulate` puts in the place of the machine.
//!
//! The table says the same for every language. What is not said has a default, which may depend on the control, so
//! that everything here is an [`Option`]; the crate `plcc-simulator` knows the defaults.

mod decimal;
mod fields;
mod read;

use alloc::{string::String, vec::Vec};

pub use decimal::Decimal;
pub(super) use read::read;

/// A part of the table with the line in which the file has it, from 1.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Located<T> {
    /// What is said.
    pub value: T,
    /// Its line.
    pub line: u32,
}

/// In what lengths are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Units {
    /// Inches.
    Inch,
    /// Millimetres.
    Millimetre,
}

/// What `[simulator]` says. Times are nanoseconds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SimulatorTable {
    /// The text of the whole machine file.
    pub text: String,
    /// The file of the part program, beside the machine file.
    pub part_program: Option<Located<String>>,
    /// The blocks that an operator can enter (NCT).
    pub blocks: Option<Vec<Located<String>>>,
    /// The unit of lengths.
    pub units: Option<Units>,
    /// By how much actual positions lag behind.
    pub lag: Option<u64>,
    /// How long a stop takes (NCT).
    pub stop: Option<u64>,
    /// How long an axis takes to its reference point.
    pub home: Option<u64>,
    /// How long a PMI control waits for the machine to be ready.
    pub machine_on: Option<u64>,
    /// How long chopping takes to begin and to end (NCT).
    pub chop: Option<u64>,
    /// Whether @BKDLT and @OPSTP toggle a state rather than being one (PMI).
    pub option_keys_toggle: Option<bool>,
    /// Whether the axes have found their reference points at power-up.
    pub homed: Option<bool>,
    /// Up to how many increments of lag an axis is in position (NCT).
    pub in_position: Option<i64>,
    /// The greatest feed (NCT).
    pub feed_max: Option<Decimal>,
    /// The letters of A, B and C that are functions, not axes (NCT).
    pub misc: Option<Located<String>>,
    /// The number of the part program (NCT).
    pub program_number: Option<u16>,
    /// What the serial line receives (NCT).
    pub serial: Option<Located<String>>,
    /// Keys of the machine's own, each with the variable that it sets.
    pub keys: Vec<(Located<String>, Located<String>)>,
    /// The axes, in the order of the control's numbers.
    pub axes: Vec<AxisEntry>,
    /// The auxiliary axes (PMI).
    pub aux: Vec<AuxEntry>,
    /// The spindle, and the second one.
    pub spindles: [SpindleEntry; 2],
    /// The small machines, in their order.
    pub devices: Vec<DeviceEntry>,
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AxisEntry {
    /// The line of the entry.
    pub line: u32,
    /// Its letter; one without a letter belongs to the PLC alone.
    pub name: Option<Located<char>>,
    /// Counts or increments a unit.
    pub counts: Option<i64>,
    /// Where it stands at power-up.
    pub start: Option<Decimal>,
    /// Where its reference point is.
    pub home: Option<Decimal>,
    /// The lower limit of its travel.
    pub min: Option<Decimal>,
    /// The upper one.
    pub max: Option<Decimal>,
    /// Its rapid speed.
    pub rapid: Option<Decimal>,
    /// The speeds by which it is jogged: high, medium, low, or one for all.
    pub jog: Option<[Decimal; 3]>,
    /// The speed of its search for the reference switch.
    pub reference_speed: Option<Decimal>,
    /// Whether the search goes in the positive direction.
    pub reference_positive: Option<bool>,
    /// Whether the reference point is found by a switch, not after a time.
    pub reference_by_switch: Option<bool>,
}

/// An auxiliary axis.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AuxEntry {
    /// Counts a unit.
    pub counts: Option<i64>,
    /// The greatest speed, in counts in 128 ms.
    pub max: Option<i64>,
}

/// A spindle.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SpindleEntry {
    /// Its speed at 10 V.
    pub rpm: Option<i64>,
    /// The slowest speed.
    pub min: Option<i64>,
    /// The time from standing to `rpm`.
    pub ramp: Option<u64>,
    /// By how much the actual speed lags behind.
    pub lag: Option<u64>,
    /// How long orientation takes.
    pub orient: Option<u64>,
    /// Whether it has an encoder.
    pub encoder: Option<bool>,
}

/// A small machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceEntry {
    /// Its name.
    pub name: Located<String>,
    /// What it is.
    pub kind: DeviceKind,
}

/// What a small machine is, with the names of its lines. A `!` before a name inverts it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceKind {
    /// A contactor, a brake, a drive: an input that follows an output.
    Relay {
        /// The coil.
        output: Located<String>,
        /// The contact.
        input: Located<String>,
        /// How long it takes to close.
        on: u64,
        /// How long it takes to open.
        off: u64,
    },
    /// A cylinder with a switch at each end.
    Cylinder {
        /// The coil that extends it.
        extend: Located<String>,
        /// The coil that retracts it; a spring does where there is none.
        retract: Option<Located<String>>,
        /// The switch at the extended end.
        extended: Option<Located<String>>,
        /// The switch at the retracted end.
        retracted: Option<Located<String>>,
        /// The time of the stroke out.
        extend_time: u64,
        /// The time of the stroke back.
        retract_time: u64,
    },
    /// A turret, or a tool magazine.
    Turret {
        /// The coil that turns it.
        output: Located<String>,
        /// The coil that turns it back.
        reverse: Option<Located<String>>,
        /// How many stations it has.
        stations: u32,
        /// The time from station to station.
        station_time: u64,
        /// The station at power-up, from 1.
        station: u32,
        /// What shows the station's number: one name, or a bit each, the lowest first.
        code: TurretCode,
        /// What is 1 at a station.
        strobe: Option<Located<String>>,
    },
    /// A pump with a pressure switch.
    Pump {
        /// The coil.
        output: Located<String>,
        /// The switch.
        input: Located<String>,
        /// The time from no pressure to the full one.
        rise: u64,
        /// The time back.
        fall: u64,
        /// At how many per cent of the pressure the switch closes.
        on: u32,
        /// At how many it opens.
        off: u32,
    },
    /// A switch on an axis.
    Switch {
        /// The letter or the number of the axis.
        axis: Located<String>,
        /// Where it begins to be pressed.
        from: Decimal,
        /// Where that ends.
        to: Decimal,
        /// The input.
        input: Located<String>,
    },
}

/// What shows the number of a turret's station.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TurretCode {
    /// Nothing.
    None,
    /// A name that takes the number.
    Number(Located<String>),
    /// A name for each bit, the lowest first.
    Bits(Vec<Located<String>>),
}
