//! What users call PMI's variables: `LS27`, `A[3]`, `A`, `@FRO`, `TC#COUNT`, `PORT1.0`.

use std::collections::HashMap;

use plcc_abi::closest;
use plcc_abi::pmi::{PORTS, PmiTables, Role, Symbol, Timer};

use crate::{NameError, Purpose, Variable};

/// Something with a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Name {
    /// The symbol of an index, whole.
    Symbol(u32),
    /// An element of the symbol of an index.
    Element(u32, u32),
    /// The counter of the timer of an index.
    Counter(u32),
    /// A physical line: port and bit.
    Line(u16, u8),
}

/// All names of a program; a [`Variable`] is an index into those that were asked for.
#[derive(Clone, Debug)]
pub(super) struct Names {
    pub(super) symbols: Vec<Symbol>,
    timers: Vec<Timer>,
    by_name: HashMap<String, u32>,
    found: Vec<Name>,
    numbers: HashMap<Name, u32>,
}

/// Digits as a number.
fn number<T: std::str::FromStr>(text: &str) -> Option<T> {
    text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse().ok())?
}

impl Names {
    pub(super) fn new(tables: &PmiTables) -> Self {
        let names = tables.symbols.iter().map(|symbol| symbol.name.clone());
        Self {
            by_name: names.zip(0..).collect(),
            symbols: tables.symbols.clone(),
            timers: tables.timers.clone(),
            found: vec![],
            numbers: HashMap::new(),
        }
    }

    pub(super) fn get(&self, variable: Variable) -> Option<Name> {
        self.found.get(variable.0 as usize).copied()
    }

    pub(super) fn symbol(&self, index: u32) -> Option<&Symbol> {
        self.symbols.get(index as usize)
    }

    pub(super) fn remember(&mut self, name: Name) -> Variable {
        let next = self.found.len() as u32;
        let number = *self.numbers.entry(name).or_insert(next);
        if number == next {
            self.found.push(name);
        }
        Variable(number)
    }

    /// Finds what a name means.
    pub(super) fn find(&mut self, text: &str, purpose: Purpose) -> Result<Variable, NameError> {
        let name = text.trim().to_ascii_uppercase();
        let unfit = |reason: String| NameError::Unfit { name: text.into(), reason };
        if let Some(line) = name.strip_prefix("PORT").and_then(|rest| rest.split_once('.')) {
            let port = number(line.0).filter(|&port: &u16| u32::from(port) < PORTS);
            let bit = number(line.1).filter(|&bit: &u8| bit < 8);
            let Some((port, bit)) = port.zip(bit) else {
                let reason = "is no line: ports are 0 to 2047, bits 0 to 7, as in PORT1.0";
                return Err(unfit(reason.into()));
            };
            return Ok(self.remember(Name::Line(port, bit)));
        }
        let (base, suffix) = match name.find(['[', '#']) {
            Some(at) => name.split_at(at),
            None => (name.as_str(), ""),
        };
        let Some(&index) = self.by_name.get(base) else { return Err(self.unknown(text, base)) };
        let Some(symbol) = self.symbols.get(index as usize) else {
            return Err(self.unknown(text, base));
        };
        if symbol.role == Role::Constant {
            return Err(unfit("is a constant, which nothing changes".into()));
        }
        let found = match (suffix, symbol.elements) {
            ("", None) => Name::Symbol(index),
            ("", Some(_)) if purpose == Purpose::Watch => Name::Symbol(index),
            ("", Some(_)) => {
                return Err(unfit(format!("is an array; name an element, as in {base}[0]")));
            }
            ("#COUNT", _) => match symbol.role {
                Role::TimerControl(timer) => Name::Counter(timer),
                _ => return Err(unfit(format!("has no counter: {base} controls no timer"))),
            },
            (_, None) => return Err(unfit(format!("is wrong: {base} is no array"))),
            (_, Some(elements)) => {
                let digits = suffix.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
                match digits.and_then(number::<u32>).filter(|&element| element < elements) {
                    Some(element) => Name::Element(index, element),
                    None => {
                        let last = elements.saturating_sub(1);
                        return Err(unfit(format!(
                            "is no element: they are {base}[0] to {base}[{last}]"
                        )));
                    }
                }
            }
        };
        Ok(self.remember(found))
    }

    fn unknown(&self, name: &str, base: &str) -> NameError {
        let candidates = self.symbols.iter().map(|symbol| symbol.name.as_str());
        let suggestion = closest(base, candidates).map(str::to_owned);
        NameError::Unknown { name: name.into(), suggestion }
    }

    /// The one spelling of a name.
    pub(super) fn canonical(&self, name: Name) -> String {
        let base = |index: u32| self.symbol(index).map_or("", |symbol| symbol.name.as_str());
        match name {
            Name::Symbol(index) => base(index).to_owned(),
            Name::Element(index, element) => format!("{}[{element}]", base(index)),
            Name::Counter(timer) => {
                let control = self.timers.get(timer as usize).map(|timer| timer.control);
                let is_control = |symbol: &&Symbol| {
                    Some(symbol.offset) == control && symbol.role == Role::TimerControl(timer)
                };
                let symbol = self.symbols.iter().find(is_control);
                format!("{}#COUNT", symbol.map_or("", |symbol| &symbol.name))
            }
            Name::Line(port, bit) => format!("PORT{port}.{bit}"),
        }
    }
}
