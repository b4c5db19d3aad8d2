//! The names of a PMI program's variables, as users write them ([`PmiName`]).

use std::collections::{BTreeMap, HashMap};

use plcc_abi::DialectVariable;
use plcc_abi::closest;
use plcc_abi::place::{Direction, Place, Type as PlaceType};
use plcc_abi::pmi::{
    Format, Lines, PORTS, PmiName, PmiNameError, PmiTables, PmiVariable, Role, Symbol, Timer, Type,
};

use crate::names::{Class, Names, Properties};
use crate::safe_outputs::{SafeLines, SafeOutputs};
use crate::{NameError, Purpose, Setting, ValueError, VariableKey};

use super::port_lines;

/// All names of a program.
#[derive(Debug)]
pub(super) struct PmiNames {
    pub(super) symbols: Vec<Symbol>,
    timers: Vec<Timer>,
    by_name: HashMap<String, u32>,
    /// The offset of port 0 in the image.
    pub(super) ports: u32,
}

/// The key of a variable.
pub(super) fn key(variable: PmiVariable) -> VariableKey {
    VariableKey(DialectVariable::Pmi(variable))
}

/// The variable of a key; `None` for the key of another control.
pub(super) fn variable(key: VariableKey) -> Option<PmiVariable> {
    let DialectVariable::Pmi(variable) = key.0 else { return None };
    Some(variable)
}

impl PmiNames {
    pub(super) fn new(tables: &PmiTables) -> Self {
        let names = tables.symbols.iter().map(|symbol| symbol.name.clone());
        Self {
            by_name: names.zip(0..).collect(),
            symbols: tables.symbols.clone(),
            timers: tables.timers.clone(),
            ports: tables.ports,
        }
    }

    pub(super) fn symbol(&self, index: u32) -> Option<&Symbol> {
        self.symbols.get(index as usize)
    }

    /// Finds what a name means.
    pub(super) fn variable(&self, text: &str, purpose: Purpose) -> Result<PmiVariable, NameError> {
        let unfit = |reason: String| NameError::Unfit { name: text.into(), reason };
        let name = match text.parse() {
            Ok(PmiName::Line(port, bit)) => return Ok(PmiVariable::Line(port, bit)),
            Err(PmiNameError::Line) => {
                let reason = "is not a line: ports are 0 to 2047, bits 0 to 7, as in PORT1.0";
                return Err(unfit(reason.into()));
            }
            name => name,
        };
        let (Ok(PmiName::Variable(base) | PmiName::Element(base, _) | PmiName::Counter(base))
        | Err(PmiNameError::Index(base))) = &name
        else {
            return Err(self.unknown(text, text));
        };
        let Some(&index) = self.by_name.get(base) else { return Err(self.unknown(text, base)) };
        let Some(symbol) = self.symbols.get(index as usize) else {
            return Err(self.unknown(text, base));
        };
        if symbol.role == Role::Constant {
            return Err(unfit("is a constant, which nothing changes".into()));
        }
        Ok(match (&name, symbol.elements) {
            (Ok(PmiName::Variable(_)), None) => PmiVariable::Symbol(index),
            (Ok(PmiName::Variable(_)), Some(_)) if purpose == Purpose::Watch => {
                PmiVariable::Symbol(index)
            }
            (Ok(PmiName::Variable(_)), Some(_)) => {
                return Err(unfit(format!("is an array; name an element, as in {base}[0]")));
            }
            (Ok(PmiName::Counter(_)), _) => match symbol.role {
                Role::TimerControl(timer) => PmiVariable::Counter(timer),
                _ => return Err(unfit(format!("has no counter: {base} controls no timer"))),
            },
            (_, None) => return Err(unfit(format!("is wrong: {base} is not an array"))),
            (Ok(PmiName::Element(_, element)), Some(elements)) if *element < elements => {
                PmiVariable::Element(index, *element)
            }
            (_, Some(elements)) => {
                let last = elements.saturating_sub(1);
                return Err(unfit(format!(
                    "is not an element: they are {base}[0] to {base}[{last}]"
                )));
            }
        })
    }

    fn unknown(&self, name: &str, base: &str) -> NameError {
        let candidates = self.symbols.iter().map(|symbol| symbol.name.as_str());
        let suggestion = closest(base, candidates).map(str::to_owned);
        NameError::Unknown { name: name.into(), suggestion }
    }

    /// The one spelling of a variable's name.
    pub(super) fn spelling(&self, name: PmiVariable) -> String {
        let variable =
            |index: u32| self.symbol(index).map_or_else(String::new, |symbol| symbol.name.clone());
        let name = match name {
            PmiVariable::Symbol(index) => PmiName::Variable(variable(index)),
            PmiVariable::Element(index, element) => PmiName::Element(variable(index), element),
            PmiVariable::Counter(timer) => {
                let control = self.timers.get(timer as usize).map(|timer| timer.control);
                let is_control = |symbol: &&Symbol| {
                    Some(symbol.offset) == control && symbol.role == Role::TimerControl(timer)
                };
                let symbol = self.symbols.iter().find(is_control);
                PmiName::Counter(symbol.map_or_else(String::new, |symbol| symbol.name.clone()))
            }
            PmiVariable::Line(port, bit) => PmiName::Line(port, bit),
        };
        name.to_string()
    }
}

/// The lines of a port as a place in the image.
fn place_of_lines(ports: u32, lines: Lines) -> Place {
    let ty = match lines.format {
        Format::Bit | Format::Binary => PlaceType::Bits,
        Format::TwosComplement => PlaceType::SignedBits,
        Format::Bcd => PlaceType::Bcd,
    };
    Place::bits(ports + u32::from(lines.port), ty, lines.low, lines.count)
}

impl PmiNames {
    /// What is known of a symbol, or with `element` of an element of an array.
    fn of_symbol(&self, symbol: &Symbol, element: Option<u32>) -> Properties {
        let (class, ty) = match symbol.ty {
            Type::Logical => (Class::Logical, PlaceType::Logical),
            Type::Integer => (Class::Integer, PlaceType::Integer),
            Type::Long => (Class::Integer, PlaceType::Long),
        };
        let offset = symbol.offset + element.unwrap_or(0) * symbol.ty.size();
        let value = Some(Place::bytes(offset, ty));
        let (direction, lines) = match symbol.role {
            Role::Input(lines) => (Direction::Input, Some(lines)),
            Role::Output(lines) => (Direction::Output, Some(lines)),
            Role::Variable | Role::Constant | Role::TimerControl(_) | Role::FlipFlopPin(_) => {
                (Direction::Internal, None)
            }
        };
        Properties {
            elements: symbol.elements.filter(|_| element.is_none()),
            direction,
            line: lines.map(|lines| place_of_lines(self.ports, lines)),
            can_be_forced: lines.is_some(),
            ..Properties::internal(class, value)
        }
    }

    /// Whether a line is one that an input of the program latches, or one of a port on which it has outputs.
    pub(super) fn direction_of_line(&self, port: u16, bit: u8) -> Direction {
        let at = (u32::from(port) < PORTS).then_some(1 << bit);
        let Some(line) = at else { return Direction::Internal };
        let mut inputs = self.symbols.iter().filter_map(|symbol| symbol.role.input());
        let mut outputs = self.symbols.iter().filter_map(|symbol| symbol.role.output());
        if inputs.any(|lines| lines.port == port && port_lines::mask(lines) & line != 0) {
            Direction::Input
        } else if outputs.any(|lines| lines.port == port) {
            Direction::Output
        } else {
            Direction::Internal
        }
    }

    /// The port of an input, an output or a line, and its bits there.
    fn bits(&self, variable: PmiVariable) -> Option<(u16, u8)> {
        match variable {
            PmiVariable::Symbol(index) => {
                let role = self.symbol(index)?.role;
                let lines = role.input().or_else(|| role.output())?;
                Some((lines.port, port_lines::mask(lines)))
            }
            PmiVariable::Line(port, bit) => Some((port, 1 << bit)),
            PmiVariable::Element(..) | PmiVariable::Counter(_) => None,
        }
    }

    /// The symbols that pass a test, by their names.
    fn chosen(&self, test: impl Fn(&Symbol) -> bool) -> Vec<(String, VariableKey)> {
        let symbols = self.symbols.iter().zip(0..).filter(|(symbol, _)| test(symbol));
        symbols.map(|(s, index)| (s.name.clone(), key(PmiVariable::Symbol(index)))).collect()
    }
}

impl Names for PmiNames {
    fn find(&self, name: &str, purpose: Purpose) -> Result<VariableKey, NameError> {
        self.variable(name, purpose).map(key)
    }

    fn canonical(&self, key: VariableKey) -> String {
        variable(key).map_or_else(String::new, |variable| self.spelling(variable))
    }

    fn properties(&self, key: VariableKey) -> Properties {
        let of = |index: u32, element| {
            let symbol = self.symbol(index);
            symbol.map(|symbol| self.of_symbol(symbol, element))
        };
        let known = variable(key).and_then(|variable| match variable {
            PmiVariable::Symbol(index) => of(index, None),
            PmiVariable::Element(index, element) => of(index, Some(element)),
            PmiVariable::Counter(timer) => {
                let timer = self.timers.get(timer as usize)?;
                let place = Place::bytes(timer.counter, PlaceType::Long);
                let unit = "20 ms";
                Some(Properties { unit, ..Properties::internal(Class::Integer, Some(place)) })
            }
            PmiVariable::Line(port, bit) => {
                let at = self.ports + u32::from(port);
                let place = Place::bits(at, PlaceType::Bits, bit, 1);
                let direction = self.direction_of_line(port, bit);
                let can_be_forced = direction != Direction::Internal;
                let line = Properties::internal(Class::Logical, Some(place));
                Some(Properties { direction, can_be_forced, ..line })
            }
        });
        known.unwrap_or(Properties::internal(Class::Integer, None))
    }

    fn element(&self, key: VariableKey, index: u32) -> Option<VariableKey> {
        let Some(PmiVariable::Symbol(symbol)) = variable(key) else { return None };
        let count = self.symbol(symbol)?.elements?;
        (index < count).then_some(self::key(PmiVariable::Element(symbol, index)))
    }

    fn parse(&self, key: VariableKey, text: &str) -> Result<Setting, ValueError> {
        let unfit = |reason: &str| ValueError { value: text.into(), reason: reason.into() };
        let trimmed = text.trim();
        let digits = trimmed.strip_prefix(['-', '+']).unwrap_or(trimmed);
        if digits.is_empty() || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
            return Err(unfit(
                "is not an integer: an optional sign and decimal digits are expected",
            ));
        }
        let number: i64 = trimmed.parse().map_err(|_| unfit("is beyond any variable's range"))?;
        if let Some(PmiVariable::Symbol(index)) = variable(key)
            && let Some(Role::Input(lines)) = self.symbol(index).map(|symbol| symbol.role)
            && !port_lines::fits(lines, number)
        {
            let lines = lines.count;
            return Err(unfit(&format!("is not a number that {lines} lines can carry in BCD")));
        }
        Ok(Setting::Int(number))
    }

    fn declared(&self) -> Vec<(String, VariableKey)> {
        self.chosen(|symbol| symbol.dumped)
    }

    fn outputs(&self) -> Vec<(String, VariableKey)> {
        self.chosen(|symbol| symbol.role.output().is_some())
    }

    fn lines(&self, key: VariableKey) -> Vec<VariableKey> {
        let Some((port, bits)) = variable(key).and_then(|variable| self.bits(variable)) else {
            return vec![];
        };
        let lines = (0..8).filter(|bit| bits >> bit & 1 != 0);
        lines.map(|bit| self::key(PmiVariable::Line(port, bit))).collect()
    }

    /// All variables, and the lines that are not a single variable's: those of groups, and those of ports with outputs that no
    /// output declares.
    fn shown_in_image(&self) -> Vec<VariableKey> {
        let symbols = self.symbols.iter().zip(0..);
        let mut shown: Vec<VariableKey> =
            symbols.map(|(_, index)| key(PmiVariable::Symbol(index))).collect();
        let mut single: BTreeMap<u16, u8> = BTreeMap::new();
        let mut lines: BTreeMap<u16, u8> = BTreeMap::new();
        for symbol in &self.symbols {
            let Some(own) = symbol.role.input().or_else(|| symbol.role.output()) else { continue };
            let bits = port_lines::mask(own);
            let all = if symbol.role.output().is_some() { 0xFF } else { bits };
            *lines.entry(own.port).or_default() |= all;
            if own.format == Format::Bit {
                *single.entry(own.port).or_default() |= bits;
            }
        }
        for (port, bits) in lines {
            let rest = bits & !single.get(&port).copied().unwrap_or(0);
            let rest = (0..8).filter(|bit| rest >> bit & 1 != 0);
            shown.extend(rest.map(|bit| key(PmiVariable::Line(port, bit))));
        }
        shown
    }

    fn safe_lines(&self, outputs: &SafeOutputs) -> Result<SafeLines, Vec<NameError>> {
        self.lines_at_stop(outputs)
    }

    fn share_forced_bits(&self, a: VariableKey, b: VariableKey) -> bool {
        let bits = |key| variable(key).and_then(|variable| self.bits(variable));
        bits(a).zip(bits(b)).is_some_and(|(a, b)| a.0 == b.0 && a.1 & b.1 != 0)
    }
}
