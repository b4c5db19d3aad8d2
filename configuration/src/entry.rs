//! The entries `[[io]]` as they are written.

use std::time::Duration;

use plcc_abi::{closest, printable, time};
use plcc_image::Number;
use plcc_image::latch::Safe;
use toml::de::{DeTable, DeValue};

use crate::value::{self, Result};
use crate::{Driver, Keys, LineNumbers, Mistake, drivers};

/// The timeout of an input whose entry does not say it.
pub const DEFAULT_TIMEOUT: Duration = Duration::from_millis(500);

/// An entry as it is written.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The line at which it begins, from 1.
    pub line: usize,
    /// The variable, or a range of them.
    pub name: String,
    /// What connects it.
    pub driver: &'static dyn Driver,
    /// The point outside, of a range of names the first one, or a list of points; empty where the driver needs none.
    pub address: String,
    /// Whether a bit is 1 in the program when it is 0 at the point outside.
    pub invert: bool,
    /// The value in the program is the value outside times this, plus `offset`.
    pub scale: f64,
    /// What is added to the value outside after it was multiplied by `scale`.
    pub offset: f64,
    /// What an input becomes when it is not given in time.
    pub safe: Safe,
    /// After which time an input is late; 0 never.
    pub timeout: Duration,
    /// What the variable is, for people; empty where the entry does not say it.
    pub description: String,
    /// `true` if values go from the point outside to the variable (`direction = "in"`), `false` if they go from
    /// the variable to the point (`"out"`), `None` if the entry does not say it.
    pub is_input: Option<bool>,
}

/// How messages name the table.
const TABLE: &str = "[[io]]";

fn safe(value: &DeValue<'_>) -> Result<Safe> {
    let expected = |_| "\"off\", \"hold\" or a number is expected".into();
    match (value, value.as_str()) {
        (_, Some("off")) => Ok(Safe::Off),
        (_, Some("hold")) => Ok(Safe::Hold),
        (DeValue::Integer(_), _) => {
            let number = value::integer(value).ok_or("").map_err(expected)?;
            Ok(Safe::Value(Number::Int(number)))
        }
        _ => match value::number(value) {
            Ok(number) => Ok(Safe::Value(Number::Float(number))),
            Err(_) => Err(expected("")),
        },
    }
}

/// The time after which an input is late; `"off"` or a time of 0 for one that never is.
fn timeout(value: &DeValue<'_>) -> Result<Duration> {
    let text = value.as_str();
    let parsed = match text {
        Some("off") => Some(Duration::ZERO),
        _ => text.and_then(|text| time::duration(text).ok()),
    };
    let limit = Duration::from_millis(1_000_000_000);
    let expected = || "a time such as \"200ms\", or \"off\", is expected".into();
    parsed.filter(|time| *time <= limit).ok_or_else(expected)
}

/// The same as a number of milliseconds.
fn timeout_ms(value: &DeValue<'_>) -> Result<Duration> {
    let number = value::number(value).ok().filter(|time| (0.0..=1e9).contains(time));
    let time = number.map(|ms| Duration::from_millis(ms as u64));
    time.ok_or_else(|| "a number of milliseconds is expected".into())
}

fn scale(value: &DeValue<'_>) -> Result<f64> {
    let number = value::number(value).ok().filter(|&scale| scale != 0.0);
    number.ok_or_else(|| "a number that is not 0 is expected".into())
}

fn name(value: &DeValue<'_>) -> Result<String> {
    value.as_str().map(str::to_owned).ok_or_else(|| "a name in quotes is expected".into())
}

fn is_input(value: &DeValue<'_>) -> Result<bool> {
    match value.as_str() {
        Some("in") => Ok(true),
        Some("out") => Ok(false),
        _ => Err("\"in\" or \"out\" is expected".into()),
    }
}

/// Reads the value of the key `io`, and adds what is wrong with it.
pub fn entries(
    value: &DeValue<'_>,
    lines: &LineNumbers,
    mistakes: &mut Vec<Mistake>,
) -> Vec<Entry> {
    let Some(tables) = value.as_array() else {
        let message = "`io` is a list of tables: [[io]], and below it name, driver and address";
        mistakes.push(Mistake { line: 1, message: message.into() });
        return vec![];
    };
    let read = |entry: &toml::Spanned<DeValue<'_>>| {
        let line = lines.line(entry.span().start);
        match entry.get_ref().as_table() {
            Some(table) => self::entry(table, line, lines, mistakes),
            None => {
                let message = "a table [[io]] is expected".into();
                mistakes.push(Mistake { line, message });
                None
            }
        }
    };
    tables.iter().filter_map(read).collect()
}

/// Reads a table. An entry with a key that there is not is given all the same, so that its other mistakes are found too.
fn entry(
    table: &DeTable<'_>,
    line: usize,
    lines: &LineNumbers,
    mistakes: &mut Vec<Mistake>,
) -> Option<Entry> {
    let mut keys = Keys::new(Some(table), TABLE, lines, line);
    let name = keys.read("name", name);
    let driver = driver(&mut keys);
    let entry = Entry {
        line,
        name: name.unwrap_or_default(),
        driver: driver.unwrap_or(drivers::other()),
        address: keys.read("address", value::list).unwrap_or_default().join(","),
        description: keys.read("description", value::text).unwrap_or_default(),
        invert: keys.read("invert", value::bool).unwrap_or(false),
        scale: keys.read("scale", scale).unwrap_or(1.0),
        offset: keys.read("offset", value::number).unwrap_or(0.0),
        safe: keys.read("safe", safe).unwrap_or(Safe::Off),
        timeout: keys
            .read_renamed("timeout", timeout, "timeout_ms", timeout_ms)
            .unwrap_or(DEFAULT_TIMEOUT),
        is_input: keys.read("direction", is_input),
    };
    keys.require("name");
    keys.require("driver");
    let (found, is_usable) = keys.finish();
    mistakes.extend(found);
    is_usable.then_some(entry)
}

/// The driver that is named.
fn driver(keys: &mut Keys<'_>) -> Option<&'static dyn Driver> {
    let (line, value) = keys.take("driver")?;
    let name = value.get_ref().as_str().unwrap_or_default();
    let found = drivers::all().find(|driver| driver.name() == name);
    if found.is_none() {
        let names: Vec<&str> = drivers::all().map(Driver::name).collect();
        let near = closest(name, names.iter().copied());
        let near = near.map(|near| format!("; did you mean `{near}`?")).unwrap_or_default();
        let (name, names) = (printable(name), names.join(", "));
        keys.refuse(line, format!("there is no driver `{name}`{near}; the drivers are {names}"));
    }
    found
}
