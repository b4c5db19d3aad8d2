//! Compares entries with the variables of a program.

use std::collections::{HashMap, HashSet};

use plcc_abi::closest;

use super::ethercat_point::{self, EthercatPoint};
use super::gpio_line::{Circuit, GpioLine};
use super::modbus_address::{ModbusAddress, Table};
use super::range::names;
use super::zenoh_variable::ZenohVariable;
use super::{Driver, Entry, Mistake};
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
    /// says. `None` if the variable can't have it.
    pub fn inside(&self, outside: f64) -> Option<Number> {
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
    pub warnings: Vec<String>,
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
            checked.warnings.push(format!("no [[io]] takes {names} to the outside"));
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
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic)]

    use toml::de::DeTable;

    use super::*;
    use crate::symbol::Type;

    /// Inputs LS1 to LS4 and COUNT (four lines), outputs PUMP and LAMP, the variable SPEED.
    fn symbols() -> Vec<Symbol> {
        let symbol = |(name, offset, width, direction): (&str, u32, u8, Direction)| Symbol {
            name: name.into(),
            value: Place::bytes(offset, Type::Integer),
            line: (direction != Direction::Internal)
                .then(|| Place::bits(offset, Type::Bits, 0, width)),
            elements: 1,
            direction,
            slot: (direction != Direction::Output).then_some(offset),
            unit: String::new(),
        };
        [
            ("LS1", 0, 1, Direction::Input),
            ("LS2", 1, 1, Direction::Input),
            ("LS3", 2, 1, Direction::Input),
            ("LS4", 3, 1, Direction::Input),
            ("COUNT", 4, 4, Direction::Input),
            ("PUMP", 5, 1, Direction::Output),
            ("LAMP", 6, 1, Direction::Output),
            ("SPEED", 7, 0, Direction::Internal),
        ]
        .map(symbol)
        .into()
    }

    fn check(text: &str) -> Checked {
        let table = DeTable::parse(text).unwrap();
        let lines = super::super::LineNumbers::new(text);
        let line_of = |at: usize| lines.line(at);
        let mut mistakes = vec![];
        let io = &table.get_ref()["io"];
        let entries = super::super::entries(io.get_ref(), &line_of, &mut mistakes);
        let outputs = ["PUMP", "LAMP"].map(str::to_owned);
        let mut checked = points(&entries, &symbols(), false, &outputs);
        checked.mistakes.extend(mistakes);
        checked.mistakes.sort();
        checked
    }

    #[test]
    fn ranges_become_points_that_follow_each_other() {
        let checked = check(
            "[[io]]\nname = \"LS1..LS4\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/discrete/8\"\n\
             invert = true\nsafe = 1\ntimeout_ms = 200\n\
             [[io]]\nname = \"SPEED\"\ndriver = \"modbus-server\"\naddress = \"holding/0:i16\"\n\
             direction = \"in\"\nscale = 0.5\noffset = 10\n\
             [[io]]\nname = \"PUMP\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/coil/0\"\n",
        );
        assert_eq!(checked.mistakes, []);
        assert_eq!(checked.warnings, ["no [[io]] takes the output LAMP to the outside"]);
        let numbers: Vec<_> = checked
            .points
            .iter()
            .map(|point| {
                let Some(Address::Modbus(address)) = &point.address else { panic!("{point:?}") };
                (point.symbol.name.as_str(), address.number, point.is_input)
            })
            .collect();
        let expected = [
            ("LS1", 8, true),
            ("LS2", 9, true),
            ("LS3", 10, true),
            ("LS4", 11, true),
            ("SPEED", 0, true),
            ("PUMP", 0, false),
        ];
        assert_eq!(numbers, expected);
        let rule = Rule { safe: Safe::Value(Number::Int(1)), timeout_ns: 200_000_000 };
        assert_eq!(checked.points[0].rule(), rule);
        assert_eq!(checked.points[0].inside(0.0), Some(Number::Int(1)), "it is inverted");
        assert_eq!(checked.points[0].outside(Number::Int(1)), 0.0);
        assert_eq!(checked.points[4].inside(21.0), Some(Number::Int(21)), "10.5 + 10, rounded");
        assert_eq!(checked.points[4].outside(Number::Int(20)), 20.0);
        assert_eq!(checked.points[4].inside(1e9), None, "beyond an integer");
        assert_eq!(checked.points[4].inside(f64::NAN), None);
    }

    #[test]
    fn large_configurations_have_an_end() {
        let many = |name: &str, count| {
            format!("[[io]]\nname = \"{name}\"\ndriver = \"other\"\n").repeat(count)
        };
        let checked = check(&many("LAMP1..LAMP4096", 10_000));
        assert_eq!(checked.mistakes.len(), 4096 + 1, "an entry is read to its end");
        let last = |checked: &Checked| checked.mistakes.last().map(|m| m.message.clone());
        assert_eq!(last(&checked).as_deref(), Some("further mistakes are not shown"));
        let checked = check(&many("PUMP", MAX_POINTS + 2));
        assert_eq!(last(&checked).as_deref(), Some("there are more than 65536 points"));
        assert_eq!(check(&many("PUMP", MAX_POINTS)).mistakes, []);
    }

    #[test]
    fn inputs_follow_variables_of_other_controls() {
        let io = |name: &str, address: &str| {
            format!("[[io]]\nname = \"{name}\"\ndriver = \"zenoh\"\naddress = \"{address}\"\n")
        };
        let text = [
            io("LS1..LS2", "mill"),
            io("LS3..LS4", "mill/READY"),
            io("COUNT", "m*"),
            io("PUMP", "mill"),
            io("LAMP", ""),
        ];
        let checked = check(&text.concat());
        let shown: Vec<_> = checked
            .points
            .iter()
            .map(|point| match &point.address {
                Some(Address::Zenoh(ZenohVariable { control, variable })) => {
                    (point.symbol.name.as_str(), control.as_str(), variable.as_deref())
                }
                _ => (point.symbol.name.as_str(), "", None),
            })
            .collect();
        let expected = [
            ("LS1", "mill", None),
            ("LS2", "mill", None),
            ("LS3", "mill", Some("READY")),
            ("LAMP", "", None),
        ];
        assert_eq!(shown, expected);
        let expected = [
            (5, "`LS3..LS4` is a range, but its address names a single variable"),
            (9, "`m*` is no address"),
            (13, "`PUMP` goes outside by its own name"),
        ];
        assert_eq!(checked.mistakes.len(), expected.len(), "{:#?}", checked.mistakes);
        for (mistake, (line, part)) in checked.mistakes.iter().zip(expected) {
            assert!(mistake.line == line && mistake.message.contains(part), "{mistake:?} {part}");
        }
    }

    #[test]
    fn every_mistake_is_found_with_its_line() {
        let io = |rest: &str| format!("[[io]]\n{rest}\n");
        let text = [
            io("name = \"LS9\"\ndriver = \"other\""),
            io("name = \"PUMP\"\ndriver = \"other\"\ndirection = \"in\""),
            io("name = \"LS1\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/holding/0\""),
            io("name = \"COUNT\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/input/0\"\nsafe = 16"),
            io("name = \"LS2\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/coil/0\"\nscale = 2"),
            io("name = \"COUNT\"\ndriver = \"other\"\ninvert = true"),
            io("name = \"PUMP\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/discrete/0\""),
            io("name = \"PUMP\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/coil/0\""),
            io("name = \"LAMP\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/coil/0\""),
            io("name = \"LS3\"\ndriver = \"other\""),
            io("name = \"LS3..LS4\"\ndriver = \"other\""),
            io("name = \"LS4\"\ndriver = \"opcua\"\naddress = \"x\""),
            io("name = \"LS1\"\ndriver = \"gpio\"\naddress = \"gpiochip0/1:pull-up\""),
            io("name = \"PUMP\"\ndriver = \"gpio\"\naddress = \"gpiochip0/1:open-drain\""),
            io("name = \"LAMP\"\ndriver = \"gpio\"\naddress = \"gpiochip0/1\""),
            io("name = \"LAMP\"\ndriver = \"gpio\"\naddress = \"gpiochip0/2:pull-up\""),
            io("name = \"COUNT\"\ndriver = \"gpio\"\naddress = \"gpiochip0/3\"\nsafe = 16"),
            io("name = \"LS1\"\ndriver = \"ethercat\"\naddress = \"eth1/1/out/0.0\""),
            io("name = \"PUMP\"\ndriver = \"ethercat\"\naddress = \"eth1/1/in/0.0\""),
            io("name = \"LAMP\"\ndriver = \"ethercat\"\naddress = \"eth1/2/out/0:u8\""),
            io("name = \"SPEED\"\ndriver = \"ethercat\"\naddress = \"eth1/2/out/0.7\""),
            io("name = \"SPEED\"\ndriver = \"ethercat\"\naddress = \"eth1/2/out/0:i16\""),
            io("name = \"PUMP\"\ndriver = \"ethercat\"\naddress = \"eth2/2/out/1.7\""),
            io("name = \"LAMP\"\ndriver = \"ethercat\"\naddress = \"eth1/2/out/0.2\""),
            io("name = \"LS4\"\ndirver = \"other\"\ndriver = \"modbustcp\"\nsafe = true"),
        ]
        .concat();
        let checked = check(&text);
        let expected = [
            (1, "no variable named `LS9`; did you mean `LS1`?"),
            (4, "can't be given from outside"),
            (8, "is a bit, which needs a coil"),
            (12, "can't be 16, its `safe`"),
            (17, "neither `scale` nor `offset`"),
            (22, "can't be inverted"),
            (26, "can only be read"),
            (34, "is driven by the entry of line 30 already"),
            (41, "`LS3` is given by the entry of line 38 already"),
            (44, "have the names of their variables, and no address"),
            (48, "the line of `LS1` is driven by the entry of line 52"),
            (56, "the point of `LAMP` is driven by the entry of line 52 already"),
            (60, "pull-up and pull-down are for inputs"),
            (64, "is a number, which a line of a GPIO chip can't be"),
            (69, "`LS1` is given from outside, but its address is an output of a terminal"),
            (73, "`PUMP` goes outside, but its address is an input of a terminal"),
            (77, "`LAMP` is a bit, which needs a bit of a byte, as in 0.3"),
            (81, "`SPEED` is a number, which needs a format, as in 0:i16"),
            (89, "`PUMP` is at eth2, but the entry of line 85 at eth1: all terminals are at one"),
            (89, "the point of `PUMP` shares bits with that of `SPEED`, of the entry of line 85"),
            (93, "the point of `LAMP` shares bits with that of `SPEED`, of the entry of line 85"),
            (99, "there is no key `dirver` in [[io]]; did you mean `driver`?"),
            (100, "there is no driver `modbustcp`; did you mean `modbus-tcp`?"),
            (101, "`safe`: \"off\", \"hold\" or a number is expected"),
        ];
        assert_eq!(checked.mistakes.len(), expected.len(), "{:#?}", checked.mistakes);
        for (mistake, (line, part)) in checked.mistakes.iter().zip(expected) {
            assert_eq!(mistake.line, line, "{mistake:?}");
            assert!(mistake.message.contains(part), "{mistake:?} {part}");
        }
    }
}
