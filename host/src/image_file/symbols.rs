//! The table of symbols of a program, as the image file has it: its variables, where their values and their physical
//! lines lie in the process image, and which of them other processes can give.

use std::collections::HashSet;
use std::sync::Arc;

use plcc_image::{Direction, Symbol};

use plcc_runtime::{Names, Properties, Purpose, VariableKey};

/// The variables of a program as the image file shows them.
#[derive(Clone, Debug, Default)]
pub struct SymbolTable {
    /// All of them. Those that can be given have slots, numbered from 0 in this order.
    pub symbols: Vec<Symbol>,
    /// For each slot its variable, and its name for entries of the journal.
    pub(super) slots: Vec<(VariableKey, Arc<str>)>,
}

impl SymbolTable {
    /// The table of a program with these names.
    pub fn new(names: &dyn Names) -> Self {
        let mut table = Self::default();
        let keys = names.shown_in_image();
        let shown: HashSet<VariableKey> = keys.iter().copied().collect();
        for key in keys {
            let Properties { elements, direction, value, line, unit, .. } = names.properties(key);
            let Some(value) = value else { continue };
            let name = names.canonical(key);
            // A simulated and a real machine never share an input.
            let given = direction != Direction::Output
                && elements.unwrap_or(1) == 1
                && !names.is_simulated(key);
            let given = given.then(|| names.find(&name, Purpose::Stimulus).ok()).flatten();
            let slot = given.map(|key| {
                table.slots.push((key, name.as_str().into()));
                table.slots.len() as u32 - 1
            });
            let (elements, unit) = (elements.unwrap_or(1), unit.to_owned());
            let given = names.given().aliases_of(&name).into_iter().map(str::to_owned);
            // A variable of one line has the line's name too, unless the line is shown itself.
            let of_line = match *names.lines(key).as_slice() {
                [line] if !shown.contains(&line) => Some(names.canonical(line)),
                _ => None,
            };
            let aliases = given.chain(of_line).collect();
            table.symbols.push(Symbol {
                name,
                aliases,
                value,
                line,
                elements,
                direction,
                slot,
                unit,
            });
        }
        table
    }
}
