//! Finds the variables of a PMI program by the names that users give them ([`PmiName`]).

use std::collections::HashMap;

use plcc_abi::closest;
use plcc_abi::pmi::{PmiName, PmiNameError, PmiTables, PmiVariable, Role, Symbol, Timer};

use crate::{NameError, Purpose, Variable};

/// All names of a program, and those that were looked up, into which a [`Variable`] is an index.
#[derive(Clone, Debug)]
pub(super) struct Names {
    pub(super) symbols: Vec<Symbol>,
    timers: Vec<Timer>,
    by_name: HashMap<String, u32>,
    found: Vec<PmiVariable>,
    numbers: HashMap<PmiVariable, u32>,
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

    pub(super) fn get(&self, variable: Variable) -> Option<PmiVariable> {
        self.found.get(variable.0 as usize).copied()
    }

    /// How many variables were looked up.
    pub(super) fn count(&self) -> u32 {
        self.found.len() as u32
    }

    pub(super) fn symbol(&self, index: u32) -> Option<&Symbol> {
        self.symbols.get(index as usize)
    }

    pub(super) fn remember(&mut self, name: PmiVariable) -> Variable {
        let next = self.found.len() as u32;
        let number = *self.numbers.entry(name).or_insert(next);
        if number == next {
            self.found.push(name);
        }
        Variable(number)
    }

    /// Finds what a name means.
    pub(super) fn find(&mut self, text: &str, purpose: Purpose) -> Result<Variable, NameError> {
        let unfit = |reason: String| NameError::Unfit { name: text.into(), reason };
        let name = match text.parse() {
            Ok(PmiName::Line(port, bit)) => return Ok(self.remember(PmiVariable::Line(port, bit))),
            Err(PmiNameError::Line) => {
                let reason = "is no line: ports are 0 to 2047, bits 0 to 7, as in PORT1.0";
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
        let found = match (&name, symbol.elements) {
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
            (_, None) => return Err(unfit(format!("is wrong: {base} is no array"))),
            (Ok(PmiName::Element(_, element)), Some(elements)) if *element < elements => {
                PmiVariable::Element(index, *element)
            }
            (_, Some(elements)) => {
                let last = elements.saturating_sub(1);
                return Err(unfit(format!("is no element: they are {base}[0] to {base}[{last}]")));
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
    pub(super) fn canonical(&self, name: PmiVariable) -> String {
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
