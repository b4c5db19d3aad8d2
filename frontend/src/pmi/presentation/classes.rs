//! The classes of variables.

use std::collections::HashMap;

use plcc_abi::Tables;
use plcc_abi::pmi::{PmiTables, Role, Symbol, Type};

use crate::Titles;

/// The titles of the classes, in the order in which they are shown.
pub(in crate::pmi) const CLASSES: &[&str] = &[
    "Inputs",
    "Outputs",
    "Timers",
    "Flip-flops",
    "Faults and messages",
    "Logical variables",
    "Integer variables",
    "Executive variables",
    "Constants",
];

/// The tables of a program, arranged so that the class of a variable is found at once.
struct Classes<'t> {
    symbols: HashMap<&'t str, &'t Symbol>,
    /// What a variable is by its offset, where another one makes it more than a variable.
    by_offset: HashMap<u32, &'static str>,
}

/// The titles of the classes that a program's variables belong to.
pub(in crate::pmi) fn titles(tables: &Tables) -> Titles<'_> {
    let classes = match tables {
        Tables::Pmi(tables) => Classes::new(tables),
        _ => Classes { symbols: HashMap::new(), by_offset: HashMap::new() },
    };
    Box::new(move |name| classes.of(name))
}

impl<'t> Classes<'t> {
    fn new(tables: &'t PmiTables) -> Self {
        let mut by_offset = HashMap::new();
        let told = tables.faults.iter().chain(&tables.messages);
        by_offset.extend(told.map(|one| (one.offset, "Faults and messages")));
        let pins = tables.flipflops.iter().flat_map(|one| [Some(one.q), one.d]).flatten();
        by_offset.extend(pins.map(|offset| (offset, "Flip-flops")));
        by_offset.extend(tables.timers.iter().map(|timer| (timer.delayed, "Timers")));
        let symbols = tables.symbols.iter().rev().map(|symbol| (symbol.name.as_str(), symbol));
        Self { symbols: symbols.collect(), by_offset }
    }

    fn of(&self, name: &str) -> &'static str {
        let Some(symbol) = self.symbols.get(name) else { return "Logical variables" };
        match symbol.role {
            Role::Input(_) => "Inputs",
            Role::Output(_) => "Outputs",
            Role::Constant => "Constants",
            Role::TimerControl(_) => "Timers",
            Role::FlipFlopPin(_) => "Flip-flops",
            Role::Variable => match self.by_offset.get(&symbol.offset) {
                Some(title) => title,
                None if name.starts_with('@') => "Executive variables",
                None if symbol.ty == Type::Logical => "Logical variables",
                None => "Integer variables",
            },
        }
    }
}
