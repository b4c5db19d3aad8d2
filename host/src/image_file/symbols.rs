//! The table of symbols of a program, as the image file has it: its variables, where their values and their physical
//! lines lie in the process image, and which of them other processes can give.

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
        for key in names.shown_in_image() {
            let Properties { elements, direction, value, line, unit, .. } = names.properties(key);
            let Some(value) = value else { continue };
            let name = names.canonical(key);
            let given = direction != Direction::Output && elements.unwrap_or(1) == 1;
            let given = given.then(|| names.find(&name, Purpose::Stimulus).ok()).flatten();
            let slot = given.map(|key| {
                table.slots.push((key, name.as_str().into()));
                table.slots.len() as u32 - 1
            });
            let (elements, unit) = (elements.unwrap_or(1), unit.to_owned());
            let aliases = names.given().aliases_of(&name).into_iter().map(str::to_owned).collect();
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
