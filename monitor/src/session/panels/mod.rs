//! Panels of the controls. Each language says which cells its panels have and which variables belong to them; here
//! the values of all these variables are read at once.

mod nct;
mod pmac;
mod pmi;

use std::collections::{BTreeMap, BTreeSet};

use plcc_abi::Tables;
use plcc_runtime::value::number;

use super::Session;
use crate::Refusal;
use crate::view::{Panel, PanelCell, PanelsView};

/// A panel before its variables are read.
#[derive(Debug, Default)]
struct Draft {
    title: String,
    columns: usize,
    cells: Vec<Cell>,
    note: Option<String>,
}

/// A cell before its variables are read.
#[derive(Debug, Default)]
struct Cell {
    label: String,
    shown: Shown,
    /// The variables of its lamp and of its push-button.
    light: Option<String>,
    button: Option<String>,
    /// The variable that a new value sets.
    editable: Option<String>,
    /// The variable that says that the value is not in use.
    unused: Option<String>,
}

/// What a cell shows beside its label.
#[derive(Debug, Default)]
enum Shown {
    #[default]
    Nothing,
    /// A text that depends on no variable.
    Text(String),
    /// The number in a variable.
    Number(String),
    /// The number in a variable, which a function makes a text.
    Formatted(String, fn(f64) -> String),
    /// The number in the first variable, which a function makes a text; the second variable says in which form.
    FormattedBy(String, String, fn(f64, f64) -> String),
    /// The text of a key whose number the variable holds (PMI 3.1.11); 0 for none.
    Key(String),
}

impl Cell {
    /// A cell in which nothing is shown, to keep the others in their columns.
    fn gap() -> Self {
        Self::default()
    }

    /// A value with a title.
    fn number(label: impl Into<String>, variable: impl Into<String>) -> Self {
        Self { label: label.into(), shown: Shown::Number(variable.into()), ..Self::default() }
    }

    /// A value that a function makes a text.
    fn formatted(
        label: impl Into<String>,
        variable: impl Into<String>,
        text: fn(f64) -> String,
    ) -> Self {
        let shown = Shown::Formatted(variable.into(), text);
        Self { label: label.into(), shown, ..Self::default() }
    }

    /// A lamp.
    fn light(label: impl Into<String>, variable: impl Into<String>) -> Self {
        Self { label: label.into(), light: Some(variable.into()), ..Self::default() }
    }

    /// A push-button with its lamp.
    fn button(label: impl Into<String>, button: String, light: Option<String>) -> Self {
        Self { label: label.into(), button: Some(button), light, ..Self::default() }
    }

    /// The same, with a value that can be set.
    fn editable(self) -> Self {
        let editable = match &self.shown {
            Shown::Number(name) | Shown::Formatted(name, _) | Shown::FormattedBy(name, ..) => {
                Some(name.clone())
            }
            Shown::Nothing | Shown::Text(_) | Shown::Key(_) => None,
        };
        Self { editable, ..self }
    }

    /// The names of all its variables.
    fn variables(&self) -> Vec<&String> {
        let mut names: Vec<&String> = match &self.shown {
            Shown::Nothing | Shown::Text(_) => vec![],
            Shown::Number(name) | Shown::Formatted(name, _) | Shown::Key(name) => vec![name],
            Shown::FormattedBy(name, how, _) => vec![name, how],
        };
        names.extend([&self.light, &self.button, &self.unused].into_iter().flatten());
        names
    }
}

impl Session<'_> {
    pub(super) fn panels_view(&mut self) -> Result<PanelsView, Refusal> {
        let drafts = match self.tables() {
            Some(Tables::Pmi(tables)) => pmi::panels(tables),
            Some(Tables::Nct(tables)) => {
                let settings = tables.settings.clone();
                let (captions, info) = (tables.texts197.clone(), tables.info.clone());
                let messages = self.events_view().map_or(vec![], |events| events.active);
                nct::panels(&settings, &captions, &info, &messages)
            }
            Some(Tables::Pmac(_)) => self.pmac_panels()?,
            None => {
                return Err(Refusal::new(
                    "without the program its panels are not known; name its source after the socket",
                ));
            }
        };
        let known = self.known_variables(&drafts)?;
        let names: Vec<String> = known.iter().cloned().collect();
        let values = self.read(&names)?.values;
        let keys = self.key_texts();
        let mut panels = vec![];
        for draft in drafts {
            let used = |cell: &Cell| cell.variables().into_iter().any(|name| known.contains(name));
            let names_none = draft.cells.iter().all(|cell| cell.variables().is_empty());
            if !names_none && !draft.cells.iter().any(used) {
                continue;
            }
            let cells = draft.cells.iter().map(|cell| filled(cell, &values, &keys)).collect();
            let Draft { title, columns, note, .. } = draft;
            panels.push(Panel { title, columns: columns.max(1), cells, note });
        }
        Ok(PanelsView { panels })
    }

    /// The variables of panels that this program has.
    fn known_variables(&mut self, drafts: &[Draft]) -> Result<BTreeSet<String>, Refusal> {
        let all: BTreeSet<String> = drafts
            .iter()
            .flat_map(|draft| &draft.cells)
            .flat_map(Cell::variables)
            .cloned()
            .collect();
        let executive = self.debugger()?.history_mut().executive();
        let is_known = |name: &String| executive.find(name, plcc_runtime::Purpose::Watch).is_ok();
        Ok(all.into_iter().filter(is_known).collect())
    }

    /// The texts of a PMI program's keys: the text of key n has the index n - 1.
    fn key_texts(&self) -> Vec<String> {
        let keys = self.debugger.as_ref().map(|debugger| debugger.program().checked().key_texts());
        keys.unwrap_or_default()
    }
}

/// A cell with its values.
fn filled(cell: &Cell, values: &BTreeMap<String, f64>, keys: &[String]) -> PanelCell {
    let of = |name: &String| values.get(name).copied();
    let is_on = |name: &Option<String>| Some(of(name.as_ref()?)? != 0.0);
    let mut label = cell.label.clone();
    let value = match &cell.shown {
        Shown::Nothing => None,
        Shown::Text(text) => Some(text.clone()),
        Shown::Number(name) => Some(of(name).map_or_else(|| "-".into(), number)),
        Shown::Formatted(name, text) => Some(of(name).map_or_else(|| "-".into(), *text)),
        Shown::FormattedBy(name, how, text) => match (of(name), of(how)) {
            (Some(value), Some(how)) => Some(text(value, how)),
            _ => Some("-".into()),
        },
        Shown::Key(name) => {
            let key = of(name).unwrap_or(0.0) as usize;
            let text = key.checked_sub(1).and_then(|key| keys.get(key));
            match (key, text) {
                // A button without a text is not displayed (PMI 3.4).
                (0, _) => return PanelCell::default(),
                (_, Some(text)) => label.clone_from(text),
                (key, None) => label = format!("{label} key {key}"),
            }
            None
        }
    };
    PanelCell {
        label,
        value,
        light: is_on(&cell.light),
        pressed: is_on(&cell.button),
        variable: cell
            .button
            .clone()
            .or_else(|| cell.editable.clone())
            .filter(|name| values.contains_key(name)),
        dim: is_on(&cell.unused).unwrap_or(false),
    }
}
