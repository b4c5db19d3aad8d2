//! Panels of the controls. Each language says which cells its panels have and which variables belong to them; here
//! the values of all these variables are read at once.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use plcc_frontend::presentation::{Announced, Cell, PanelDraft, Shown, operator_panel};
use plcc_protocol::touch_key_label;
use plcc_runtime::value::number;

use super::Session;
use crate::view::{EventKind, OperatorView, Panel, PanelCell, PanelsView};
use crate::{Command, Refusal};

/// Panels as a language has them, with what is known of their variables.
struct Drafts {
    drafts: Vec<PanelDraft>,
    /// The variables that the program has.
    known: BTreeSet<String>,
    values: BTreeMap<String, f64>,
    /// The texts of touch keys.
    keys: Vec<String>,
    /// Whether the past is shown, in which no command is given.
    past: bool,
    /// Of which moment the values are, where that is not the tick that is shown.
    moment: Option<String>,
}

impl Session<'_> {
    /// The panels with the variables that the program has, and their values.
    fn drafts(&mut self) -> Result<Drafts, Refusal> {
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
        let moment = self.read(&names)?;
        let (live, values) = (moment.live.then_some(moment.text), moment.values);
        let keys = program.key_texts();
        let past = self.is_past();
        Ok(Drafts { drafts, known, values, keys, past, moment: live })
    }

    pub(super) fn panels_view(&mut self) -> Result<PanelsView, Refusal> {
        let Drafts { drafts, known, values, keys, past, moment } = self.drafts()?;
        let mut panels = vec![];
        for draft in drafts {
            let used = |cell: &Cell| cell.variables().into_iter().any(|name| known.contains(name));
            let names_none = draft.cells.iter().all(|cell| cell.variables().is_empty());
            if !names_none && !draft.cells.iter().any(used) {
                continue;
            }
            let cells = draft.cells.iter().map(|cell| filled(cell, &values, &keys, past)).collect();
            let PanelDraft { title, columns, note, .. } = draft;
            panels.push(Panel { title, columns: columns.max(1), cells, note });
        }
        Ok(PanelsView { panels, moment })
    }

    pub(super) fn operator_view(&mut self) -> Result<OperatorView, Refusal> {
        let active = self.events_view()?.active;
        let program = self.debugger()?.program().shared();
        let names = self.debugger()?.history_mut().executive().names();
        let declared: BTreeSet<String> =
            names.declared().into_iter().map(|(name, _)| name).collect();
        let said = |name: &str| names.given().said_of(name).map(Cow::into_owned);
        let panel = operator_panel(program.as_ref());
        let panel = panel.of_program(|name| declared.contains(name), said);
        let is_known = |name: &&str| names.find(name, plcc_runtime::Purpose::Watch).is_ok();
        let known: BTreeSet<String> =
            panel.variables().filter(is_known).map(str::to_owned).collect();
        let values = self.read(&known.into_iter().collect::<Vec<_>>())?.values;
        Ok(OperatorView::new(&panel, active, &|name| values.get(name).copied()))
    }

    /// Whether an operator may have this done: only keys are pressed.
    ///
    /// # Errors
    /// Why not.
    pub(super) fn check_operator(&mut self, command: &Command) -> Result<(), Refusal> {
        let is_key = match command {
            Command::Follow | Command::ConfirmWarning => true,
            Command::Change { name, .. } => self.operator_view()?.presses(name),
            _ => false,
        };
        let what =
            "the operator's screen presses the keys of the program, and changes nothing else";
        is_key.then_some(()).ok_or_else(|| Refusal::new(what))
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
fn filled(cell: &Cell, values: &BTreeMap<String, f64>, keys: &[String], past: bool) -> PanelCell {
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
            match touch_key_label(&label, keys, of(name).unwrap_or(0.0)) {
                Some(text) => label = text,
                None => return PanelCell::default(),
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
        dim: is_on(&cell.unused).unwrap_or(false) || cell.command.is_some() && past,
        command: cell.command.clone().filter(|_| !past),
    }
}
