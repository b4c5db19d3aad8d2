//! Panels of the controls. Each language says which cells its panels have and which variables belong to them; here
//! the values of all these variables are read at once.

use std::collections::{BTreeMap, BTreeSet};

use plcc_frontend::presentation::{Announced, Cell, PanelDraft, Shown};
use plcc_runtime::value::number;

use super::Session;
use crate::Refusal;
use crate::view::{EventKind, Panel, PanelCell, PanelsView};

impl Session<'_> {
    pub(super) fn panels_view(&mut self) -> Result<PanelsView, Refusal> {
        let Some(debugger) = &self.debugger else {
            return Err(Refusal::new(
                "without the program its panels are not known; name its source after the socket",
            ));
        };
        let program = debugger.program().shared();
        let active = self.events_view().map_or(vec![], |events| events.active);
        let active: Vec<Announced> = active
            .into_iter()
            .map(|one| {
                let is_fault = one.kind == EventKind::Fault;
                Announced { is_fault, name: one.name, text: one.text }
            })
            .collect();
        let drafts = program.panels(&active, &mut |names| self.read_values(names));
        let drafts = drafts.map_err(Refusal::new)?;
        let known = self.known_variables(&drafts)?;
        let names: Vec<String> = known.iter().cloned().collect();
        let values = self.read(&names)?.values;
        let keys = program.key_texts();
        let mut panels = vec![];
        for draft in drafts {
            let used = |cell: &Cell| cell.variables().into_iter().any(|name| known.contains(name));
            let names_none = draft.cells.iter().all(|cell| cell.variables().is_empty());
            if !names_none && !draft.cells.iter().any(used) {
                continue;
            }
            let cells = draft.cells.iter().map(|cell| filled(cell, &values, &keys)).collect();
            let PanelDraft { title, columns, note, .. } = draft;
            panels.push(Panel { title, columns: columns.max(1), cells, note });
        }
        Ok(PanelsView { panels })
    }

    /// The variables of panels that this program has.
    fn known_variables(&mut self, drafts: &[PanelDraft]) -> Result<BTreeSet<String>, Refusal> {
        let all: BTreeSet<String> = drafts
            .iter()
            .flat_map(|draft| &draft.cells)
            .flat_map(Cell::variables)
            .cloned()
            .collect();
        let executive = self.debugger()?.history_mut().executive();
        let is_known =
            |name: &String| executive.names().find(name, plcc_runtime::Purpose::Watch).is_ok();
        Ok(all.into_iter().filter(is_known).collect())
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
