//! What an operator sees of a control's panels: its keys, lamps and overrides, as data. An artifact holds it, so that a
//! controller without a compiler can show it.

use alloc::{string::String, vec::Vec};

use serde::{Deserialize, Serialize};

use crate::GivenName;

/// The keys, lamps and overrides of a control's panels.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OperatorPanel {
    /// The cells, panel by panel.
    pub cells: Vec<OperatorCell>,
    /// The texts of touch keys, by their numbers from 1.
    pub key_texts: Vec<String>,
}

/// A key with its lamp, a lamp alone, or an override.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OperatorCell {
    /// What it is called.
    pub label: String,
    /// The variable that holds the number of a touch key's text, which is its label then: from 1, 0 for a key that is not
    /// displayed (PMI 3.4).
    pub text: Option<String>,
    /// The variable of an override's number.
    pub number: Option<String>,
    /// The variable of its lamp.
    pub light: Option<String>,
    /// The variable of its push-button.
    pub button: Option<String>,
    /// The variable that says that the number is not in use.
    pub unused: Option<String>,
}

impl OperatorCell {
    /// Whether it is a key or a lamp.
    pub fn is_key(&self) -> bool {
        self.button.is_some() || self.light.is_some()
    }

    /// The names of all its variables.
    pub fn variables(&self) -> impl Iterator<Item = &str> {
        let Self { label: _, text, number, light, button, unused } = self;
        [text, number, light, button, unused].into_iter().flatten().map(String::as_str)
    }
}

impl OperatorPanel {
    /// The cells whose variables a program uses, each once, with the labels that people gave to them: a text of the machine
    /// file, or an alias. `said` gives what people say of a variable.
    pub fn of_program(
        &self,
        is_used: impl Fn(&str) -> bool,
        said: impl Fn(&str) -> Option<GivenName>,
    ) -> Self {
        let uses = |name: &Option<String>| name.as_deref().is_some_and(&is_used);
        let mut cells: Vec<OperatorCell> = Vec::new();
        for cell in &self.cells {
            let is_shown = match cell.is_key() {
                true => uses(&cell.button) || uses(&cell.light),
                false => uses(&cell.number) || uses(&cell.unused),
            };
            // What several panels have stands here once.
            let is_same = |known: &OperatorCell| {
                (&known.button, &known.light, &known.number)
                    == (&cell.button, &cell.light, &cell.number)
            };
            if !is_shown || cells.iter().any(is_same) {
                continue;
            }
            let named = [&cell.button, &cell.light].into_iter().flatten();
            let given = named.filter_map(|name| said(name)).find_map(|said| {
                [said.text, said.alias].into_iter().find(|label| !label.is_empty())
            });
            let label = given.unwrap_or_else(|| cell.label.clone());
            cells.push(OperatorCell { label, ..cell.clone() });
        }
        Self { cells, key_texts: self.key_texts.clone() }
    }

    /// The names of all variables.
    pub fn variables(&self) -> impl Iterator<Item = &str> {
        self.cells.iter().flat_map(OperatorCell::variables)
    }
}

#[cfg(test)]
mod tests {
    use alloc::{borrow::ToOwned, vec};

    use super::*;

    fn key(button: &str, light: &str) -> OperatorCell {
        let name = |name: &str| (!name.is_empty()).then(|| name.to_owned());
        let (button, light) = (name(button), name(light));
        OperatorCell { label: "key".into(), button, light, ..OperatorCell::default() }
    }

    #[test]
    fn a_program_has_the_cells_that_it_uses_once_with_the_names_that_people_gave() {
        let number = |name: &str| OperatorCell {
            label: "F%".into(),
            number: Some(name.into()),
            ..OperatorCell::default()
        };
        let cells = vec![
            key("K1", "L1"),
            key("K2", "L2"),
            key("", "L3"),
            number("F"),
            key("K1", "L1"),
            number("F"),
            number("S"),
        ];
        let panel = OperatorPanel { cells, key_texts: vec!["AUTO".into()] };
        let is_used = |name: &str| ["K1", "L3", "F"].contains(&name);
        let said = |name: &str| match name {
            "K1" => Some(GivenName { text: "coolant".into(), ..GivenName::default() }),
            "L3" => Some(GivenName { alias: "READY".into(), ..GivenName::default() }),
            _ => None,
        };
        let used = panel.of_program(is_used, said);
        let labels: Vec<&str> = used.cells.iter().map(|cell| cell.label.as_str()).collect();
        assert_eq!(labels, ["coolant", "READY", "F%"]);
        assert_eq!(used.variables().collect::<Vec<_>>(), ["L1", "K1", "L3", "F"]);
        assert_eq!(used.key_texts, ["AUTO"]);
    }
}
