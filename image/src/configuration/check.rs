//! Compares entries with the variables of a program.

use std::collections::{HashMap, HashSet};

use plcc_abi::closest;

use super::ethercat_point::{self, EthercatPoint};
use super::gpio_line::{Circuit, GpioLine};
use super::modbus_address::{ModbusAddress, Table};
use super::range::names;
use super::zenoh_variable::ZenohVariable;
use super::{Driver, Entry, Mistake, Warning, outside_range};
use crate::latch::{Rule, Safe};
use crate::symbol::{Direction, Number, Place, Symbol};

/// How many points a configuration may have.
const MAX_POINTS: usize = 1 << 16;
/// After how many mistakes no more are looked for.
const MAX_MISTAKES: usize = 1000;
/// For how many unknown names the nearest one is looked for.
const MAX_HINTS: usize = 20;

/// Where a point lies outside, for drivers whose points have addresses.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Address {
    /// A coil or a register of a Modbus device.
    Modbus(ModbusAddress),
    /// A line of a GPIO chip.
    Gpio(GpioLine),
    /// A variable of another control.
    Zenoh(ZenohVariable),
    /// A point of an EtherCAT terminal.
    Ethercat(EthercatPoint),
}

impl Address {
    /// The address number `index` (from 0) of a range that begins here; `None` beyond the last one.
    fn nth(&self, index: usize) -> Option<Self> {
        match self {
            Self::Modbus(address) => address.nth(index).map(Self::Modbus),
            Self::Gpio(line) => line.nth(index).map(Self::Gpio),
            Self::Zenoh(variable) => variable.nth(index).map(Self::Zenoh),
            Self::Ethercat(point) => point.nth(index).map(Self::Ethercat),
        }
    }

    /// The same address without what does not belong to the place.
    fn place(&self) -> Self {
        match self {
            Self::Modbus(_) | Self::Zenoh(_) | Self::Ethercat(_) => self.clone(),
            Self::Gpio(line) => Self::Gpio(GpioLine { circuit: Circuit::Plain, ..line.clone() }),
        }
    }
}

/// A variable and its point outside.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// The entry that it belongs to.
    pub entry: Entry,
    /// The variable.
    pub symbol: Symbol,
    /// The point, for drivers whose points have addresses.
    pub address: Option<Address>,
    /// Whether values go from the point outside to the variable (`direction = "in"`), rather than from the
    /// variable to the point.
    pub is_input: bool,
}

impl Point {
    /// What the configuration says of the variable as an input.
    pub fn rule(&self) -> Rule {
        Rule { safe: self.entry.safe, timeout_ns: self.entry.timeout_ms.saturating_mul(1_000_000) }
    }

    /// The value of the variable for a value of the point outside: inverted, or scaled and rounded, as the entry
    /// says. `None` if the variable can't have it, or it is not a finite number.
    pub fn inside(&self, outside: f64) -> Option<Number> {
        if !outside.is_finite() {
            return None;
        }
        let place = self.symbol.outside();
        let value = if place.is_bit() {
            Number::Int(((outside != 0.0) != self.entry.invert).into())
        } else {
            let value = outside * self.entry.scale + self.entry.offset;
            match place.range() {
                Some(_) if value.abs() < 9e15 => Number::Int(value.round() as i64),
                _ => Number::Float(value),
            }
        };
        self.symbol.takes(value).then_some(value)
    }

    /// The value of the point outside for a value of the variable, the reverse of [`inside`](Self::inside).
    pub fn outside(&self, inside: Number) -> f64 {
        if self.symbol.outside().is_bit() {
            f64::from((inside.float() != 0.0) != self.entry.invert)
        } else {
            (inside.float() - self.entry.offset) / self.entry.scale
        }
    }
}

/// What a check has found.
#[derive(Clone, Debug, Default)]
pub struct Checked {
    /// The points of all entries without mistakes.
    pub points: Vec<Point>,
    /// What is wrong.
    pub mistakes: Vec<Mistake>,
    /// What may be wrong.
    pub warnings: Vec<Warning>,
}

/// Resolves the entries for a program with these symbols. `ends_in_bit` says that the last digit of a number in a
/// name is a bit from 0 to 7, as in NCT. `outputs` are the outputs that the program uses; it is a warning if
/// none of the entries takes one of them.
pub fn points(
    entries: &[Entry],
    symbols: &[Symbol],
    ends_in_bit: bool,
    outputs: &[String],
) -> Checked {
    let by_name: HashMap<&str, &Symbol> =
        symbols.iter().map(|symbol| (symbol.name.as_str(), symbol)).collect();
    let mut checked = Checked::default();
    // The lines of entries that give a variable, and that take a value for a point outside.
    let mut given: HashMap<Place, usize> = HashMap::new();
    let mut driven: HashMap<Address, usize> = HashMap::new();
    let mut hints = 0;
    for entry in entries {
        let message = if checked.mistakes.len() >= MAX_MISTAKES {
            "further mistakes are not shown".into()
        } else if checked.points.len() > MAX_POINTS {
            format!("there are more than {MAX_POINTS} points")
        } else {
            String::new()
        };
        if !message.is_empty() {
            checked.mistakes.push(Mistake { line: entry.line, message });
            break;
        }
        let mut wrong =
            |message: String| checked.mistakes.push(Mistake { line: entry.line, message });
        let names = match names(&entry.name, ends_in_bit) {
            Ok(names) => names,
            Err(message) => {
                wrong(message);
                continue;
            }
        };
        let first = match first_address(entry) {
            Ok(address) => address,
            Err(message) => {
                wrong(message);
                continue;
            }
        };
        for (index, name) in names.iter().enumerate() {
            let upper = name.to_ascii_uppercase();
            let symbol = by_name.get(name.as_str()).or_else(|| by_name.get(upper.as_str()));
            let Some(&symbol) = symbol else {
                hints += 1;
                let near = (hints <= MAX_HINTS)
                    .then(|| closest(&upper, symbols.iter().map(|symbol| symbol.name.as_str())))
                    .flatten();
                let hint = near.map(|near| format!("; did you mean `{near}`?")).unwrap_or_default();
                wrong(format!("the program has no variable named `{name}`{hint}"));
                continue;
            };
            let address = match &first {
                Some(first) => match first.nth(index) {
                    Some(address) => Some(address),
                    None => {
                        wrong(match first {
                            Address::Zenoh(_) => format!(
                                "`{}` is a range, but its address names a single variable",
                                entry.name
                            ),
                            _ => format!("the address of `{name}` is beyond the last number"),
                        });
                        break;
                    }
                },
                None => None,
            };
            let is_input = entry.is_input.unwrap_or(symbol.direction == Direction::Input);
            let point = Point { entry: entry.clone(), symbol: symbol.clone(), address, is_input };
            if let Some(message) = unfit(&point) {
                wrong(format!("`{name}` {message}"));
                continue;
            }
            if is_input {
                if let Some(line) = given.insert(symbol.outside(), entry.line) {
                    wrong(format!("`{name}` is given by the entry of line {line} already"));
                }
            } else if let Some(address) = &point.address {
                let line = *driven.entry(address.place()).or_insert(entry.line);
                if line != entry.line {
                    wrong(format!(
                        "the point of `{name}` is driven by the entry of line {line} already"
                    ));
                }
            }
            checked.points.push(point);
        }
    }
    read_and_driven(&mut checked, &driven);
    checked.mistakes.extend(ethercat_point::mistakes(&checked.points));
    checked.warnings = outside_range::warnings(&checked.points);
    let taken: HashSet<Place> =
        checked.points.iter().filter(|point| !point.is_input).map(|p| p.symbol.outside()).collect();
    let is_taken = |name: &String| {
        by_name.get(name.as_str()).is_none_or(|symbol| taken.contains(&symbol.outside()))
    };
    if !entries.is_empty() {
        let free: Vec<&str> =
            outputs.iter().filter(|name| !is_taken(name)).map(String::as_str).collect();
        if let Some((last, others)) = free.split_last() {
            let names = match others {
                [] => format!("the output {last}"),
                _ => format!("the outputs {} and {last}", others.join(", ")),
            };
            let message = format!("no [[io]] takes {names} to the outside");
            checked.warnings.push(Warning { line: None, message });
        }
    }
    checked
}

/// Finds lines of GPIO chips that one entry reads and another drives: a line has one direction.
fn read_and_driven(checked: &mut Checked, driven: &HashMap<Address, usize>) {
    for point in checked.points.iter().filter(|point| point.is_input) {
        if let Some(address @ Address::Gpio(_)) = &point.address
            && let Some(line) = driven.get(&address.place())
        {
            let name = &point.symbol.name;
            let message = format!("the line of `{name}` is driven by the entry of line {line}");
            checked.mistakes.push(Mistake { line: point.entry.line, message });
        }
    }
}

fn first_address(entry: &Entry) -> Result<Option<Address>, String> {
    let parse = |tcp, serial| {
        let address = ModbusAddress::parse(&entry.address, tcp, serial);
        address.map(|address| Some(Address::Modbus(address)))
    };
    match entry.driver {
        Driver::ModbusTcp => parse(true, false),
        Driver::ModbusRtu => parse(false, true),
        Driver::ModbusServer => parse(false, false),
        Driver::Gpio => GpioLine::parse(&entry.address).map(|line| Some(Address::Gpio(line))),
        Driver::Ethercat => {
            EthercatPoint::parse(&entry.address).map(|point| Some(Address::Ethercat(point)))
        }
        Driver::Zenoh if !entry.address.is_empty() => {
            ZenohVariable::parse(&entry.address).map(|variable| Some(Address::Zenoh(variable)))
        }
        Driver::OpcUa | Driver::Mqtt | Driver::Hal if !entry.address.is_empty() => Err(format!(
            "`address`: points of the driver {} have the names of their variables, and no address",
            entry.driver.name()
        )),
        Driver::OpcUa | Driver::Mqtt | Driver::Zenoh | Driver::Hal | Driver::Other => Ok(None),
    }
}

/// Why a point can't be, if it can't; the reason follows the variable's name.
fn unfit(Point { entry, symbol, address, is_input }: &Point) -> Option<String> {
    let place = symbol.outside();
    if symbol.elements != 1 {
        return Some("is an array, which can't be wired".into());
    }
    if *is_input && symbol.slot.is_none() {
        let what = symbol.direction.name();
        return Some(format!("is {what}, and can't be given from outside"));
    }
    if let (Some(Address::Zenoh(_)), false) = (address, is_input) {
        return Some(
            "goes outside by its own name, but the address names a variable that it would follow"
                .into(),
        );
    }
    if let Some(Address::Gpio(line)) = address {
        if !place.is_bit() {
            return Some("is a number, which a line of a GPIO chip can't be".into());
        }
        if *is_input && !line.circuit.is_for_inputs() {
            return Some(
                "is given from outside, but open-drain and open-source are for outputs".into(),
            );
        }
        if !is_input && !line.circuit.is_for_outputs() {
            return Some("goes outside, but pull-up and pull-down are for inputs".into());
        }
    }
    if let Some(Address::Ethercat(point)) = address
        && let Some(message) = ethercat_point::unfit(point, *is_input, place.is_bit())
    {
        return Some(message);
    }
    if let Some(Address::Modbus(address)) = address {
        if address.format.is_bit() != place.is_bit() {
            let (is, needs) = match place.is_bit() {
                true => ("a bit", "a coil, a discrete input or a bit of a register"),
                false => ("a number", "a register"),
            };
            return Some(format!("is {is}, which needs {needs}"));
        }
        let client = matches!(entry.driver, Driver::ModbusTcp | Driver::ModbusRtu);
        if client && !is_input && matches!(address.table, Table::Discrete | Table::Input) {
            return Some("goes outside, but its table can only be read".into());
        }
        if !client && *is_input && matches!(address.table, Table::Discrete | Table::Input) {
            return Some("is given from outside, but its table can't be written".into());
        }
    }
    let is_scaled = entry.scale != 1.0 || entry.offset != 0.0;
    if place.is_bit() && is_scaled {
        return Some("is a bit, which has neither `scale` nor `offset`".into());
    }
    if !place.is_bit() && entry.invert {
        return Some("is a number, which can't be inverted".into());
    }
    match entry.safe {
        Safe::Value(value) if !symbol.takes(value) => Some(format!("can't be {value}, its `safe`")),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
