//! The entries `[[io]]` of a controller's configuration file: which variable of the program belongs to which
//! point outside.
//!
//! ```toml
//! [[io]]
//! name = "LS1..LS16"                            # a variable, or a range in the language's own numbering
//! driver = "modbus-tcp"
//! address = "192.168.1.10:502/1/discrete/0"     # of the first point; the others follow it
//! safe = 0
//! timeout_ms = 200
//! ```
//!
//! [`entries`] reads them, [`points`] resolves ranges and compares everything with the table of symbols of
//! the program. Both find all mistakes, each with its line.

mod check;
mod ethercat_point;
mod gpio_line;
mod line_numbers;
mod modbus_address;
mod modbus_format;
mod outside_range;
mod range;
mod zenoh_variable;

use plcc_abi::{closest, printable};
use toml::de::{DeArray, DeTable, DeValue};

pub use check::{Address, Checked, Point, points};
pub use ethercat_point::{EthercatPoint, ProcessValue};
pub use gpio_line::{Circuit, GpioLine};
pub use line_numbers::LineNumbers;
pub use modbus_address::{Medium, ModbusAddress, Table};
pub use modbus_format::{Coding, Format, Order};
pub use zenoh_variable::{ZenohVariable, is_key_part};

use crate::latch::Safe;
use crate::symbol::Number;

/// The timeout of an input whose entry has no `timeout_ms`, in milliseconds.
pub const DEFAULT_TIMEOUT_MS: u64 = 500;

/// Something that is wrong with an entry.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mistake {
    /// The line, from 1.
    pub line: usize,
    /// What is wrong, as a sentence without a full stop.
    pub message: String,
}

/// Something that may be wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The line of the entry, from 1, where it is about one.
    pub line: Option<usize>,
    /// What may be wrong, as a sentence without a full stop.
    pub message: String,
}

/// What connects a variable with the outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Driver {
    /// Modbus over TCP: `plcio` asks a device.
    ModbusTcp,
    /// Modbus over a serial line: `plcio` asks a device.
    ModbusRtu,
    /// Modbus over TCP: others ask `plcio`.
    ModbusServer,
    /// OPC UA: clients read and write the point by the server of `plcio`.
    OpcUa,
    /// MQTT with Sparkplug B: `plcio` publishes the point, and takes commands.
    Mqtt,
    /// zenoh: `plcio` publishes the point for other computers of a plant, takes values that others write, and follows variables
    /// of other controls.
    Zenoh,
    /// A pin of LinuxCNC's hardware abstraction layer.
    Hal,
    /// Lines of Linux's GPIO character device.
    Gpio,
    /// Terminals of an EtherCAT segment, which `plcio` drives by a network interface.
    Ethercat,
    /// Another program that uses the image file itself, such as a component of LinuxCNC.
    Other,
}

impl Driver {
    /// All drivers by their names.
    pub const ALL: [(&str, Self); 10] = [
        ("modbus-tcp", Self::ModbusTcp),
        ("modbus-rtu", Self::ModbusRtu),
        ("modbus-server", Self::ModbusServer),
        ("opcua", Self::OpcUa),
        ("mqtt", Self::Mqtt),
        ("zenoh", Self::Zenoh),
        ("hal", Self::Hal),
        ("gpio", Self::Gpio),
        ("ethercat", Self::Ethercat),
        ("other", Self::Other),
    ];

    /// The name in a configuration.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, driver)| *driver == self).map_or("", |(name, _)| name)
    }
}

/// An entry as it is written.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The line at which it begins, from 1.
    pub line: usize,
    /// The variable, or a range of them.
    pub name: String,
    /// What connects it.
    pub driver: Driver,
    /// The point outside, of a range the first one; empty where the driver needs none.
    pub address: String,
    /// Whether a bit is 1 in the program when it is 0 at the point outside.
    pub invert: bool,
    /// The value in the program is the value outside times this, plus `offset`.
    pub scale: f64,
    /// What is added to the value outside after it was multiplied by `scale`.
    pub offset: f64,
    /// What an input becomes when it is not given in time.
    pub safe: Safe,
    /// After how many milliseconds an input is late; 0 never.
    pub timeout_ms: u64,
    /// What the variable is, for people; empty where the entry does not say it.
    pub description: String,
    /// `true` if values go from the point outside to the variable (`direction = "in"`), `false` if they go from
    /// the variable to the point (`"out"`), `None` if the entry does not say it.
    pub is_input: Option<bool>,
}

const KEYS: [&str; 10] = [
    "name",
    "driver",
    "address",
    "description",
    "invert",
    "scale",
    "offset",
    "safe",
    "timeout_ms",
    "direction",
];

fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(number) => {
            i64::from_str_radix(number.as_str(), number.radix()).ok().map(|number| number as f64)
        }
        DeValue::Float(number) => number.as_str().replace('_', "").parse().ok(),
        _ => None,
    }
    .filter(|number: &f64| number.is_finite())
}

fn safe(value: &DeValue<'_>) -> Option<Safe> {
    match (value, value.as_str()) {
        (_, Some("off")) => Some(Safe::Off),
        (_, Some("hold")) => Some(Safe::Hold),
        (DeValue::Integer(digits), _) => {
            let value = i64::from_str_radix(digits.as_str(), digits.radix()).ok()?;
            Some(Safe::Value(Number::Int(value)))
        }
        _ => number(value).map(|value| Safe::Value(Number::Float(value))),
    }
}

/// Reads the value of the key `io`. `line_of` gives the line of an offset in the file.
pub fn entries(
    value: &DeValue<'_>,
    line_of: &dyn Fn(usize) -> usize,
    mistakes: &mut Vec<Mistake>,
) -> Vec<Entry> {
    let tables: Option<&DeArray<'_>> = value.as_array();
    let Some(tables) = tables else {
        let message = "`io` is a list of tables: [[io]], and below it name, driver and address";
        mistakes.push(Mistake { line: 1, message: message.into() });
        return vec![];
    };
    let read = |entry: &toml::Spanned<DeValue<'_>>| {
        let line = line_of(entry.span().start);
        match entry.get_ref().as_table() {
            Some(table) => self::entry(table, line, line_of, mistakes),
            None => {
                let message = "a table [[io]] is expected".into();
                mistakes.push(Mistake { line, message });
                None
            }
        }
    };
    tables.iter().filter_map(read).collect()
}

fn entry(
    table: &DeTable<'_>,
    line: usize,
    line_of: &dyn Fn(usize) -> usize,
    mistakes: &mut Vec<Mistake>,
) -> Option<Entry> {
    // An entry with a key that there is not is given all the same, so that its other mistakes are found too.
    let mut is_usable = true;
    let mut entry = Entry {
        line,
        name: String::new(),
        driver: Driver::Other,
        address: String::new(),
        invert: false,
        scale: 1.0,
        offset: 0.0,
        safe: Safe::Off,
        timeout_ms: DEFAULT_TIMEOUT_MS,
        description: String::new(),
        is_input: None,
    };
    for (key, value) in table {
        let (key, line) = (key.get_ref().as_ref(), line_of(key.span().start));
        let value = value.get_ref();
        let text = || value.as_str().map(str::to_owned);
        let expected = match key {
            "name" => text().map(|name| entry.name = name).ok_or("a name in quotes"),
            "address" => text().map(|at| entry.address = at).ok_or("a text in quotes"),
            "description" => {
                text().map(|words| entry.description = words).ok_or("a text in quotes")
            }
            "invert" => value.as_bool().map(|on| entry.invert = on).ok_or("true or false"),
            "scale" => number(value)
                .filter(|&scale| scale != 0.0)
                .map(|scale| entry.scale = scale)
                .ok_or("a number that is not 0"),
            "offset" => number(value).map(|offset| entry.offset = offset).ok_or("a number"),
            "timeout_ms" => number(value)
                .filter(|time| (0.0..=1e9).contains(time))
                .map(|time| entry.timeout_ms = time as u64)
                .ok_or("a number of milliseconds"),
            "direction" => {
                entry.is_input = match value.as_str() {
                    Some("in") => Some(true),
                    Some("out") => Some(false),
                    _ => None,
                };
                entry.is_input.map(|_| ()).ok_or("\"in\" or \"out\"")
            }
            "safe" => {
                safe(value).map(|safe| entry.safe = safe).ok_or("\"off\", \"hold\" or a number")
            }
            "driver" => {
                let name = value.as_str().unwrap_or_default();
                match Driver::ALL.iter().find(|(known, _)| *known == name) {
                    Some(&(_, driver)) => {
                        entry.driver = driver;
                        Ok(())
                    }
                    None => {
                        let names = Driver::ALL.map(|(known, _)| known);
                        let near =
                            closest(name, names).map(|near| format!("; did you mean `{near}`?"));
                        let message = format!(
                            "there is no driver `{}`{}; the drivers are {}",
                            printable(name),
                            near.unwrap_or_default(),
                            names.join(", ")
                        );
                        mistakes.push(Mistake { line, message });
                        is_usable = false;
                        continue;
                    }
                }
            }
            _ => {
                // The beginning of a key, such as `timeout`, may be far from it in letters.
                let begins = || KEYS.into_iter().find(|known| known.starts_with(key));
                let near = closest(key, KEYS).or_else(begins);
                let near = near.map(|near| format!("; did you mean `{near}`?"));
                let message = format!(
                    "there is no key `{}` in [[io]]{}",
                    printable(key),
                    near.unwrap_or_default()
                );
                mistakes.push(Mistake { line, message });
                continue;
            }
        };
        if let Err(expected) = expected {
            mistakes.push(Mistake { line, message: format!("`{key}`: {expected} is expected") });
            is_usable = false;
        }
    }
    for key in ["name", "driver"] {
        if !table.contains_key(key) {
            let message = format!("the key `{key}` is missing in this [[io]]");
            mistakes.push(Mistake { line, message });
            is_usable = false;
        }
    }
    is_usable.then_some(entry)
}
