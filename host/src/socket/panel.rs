//! The operator's screen of the program that runs: which variables it needs, and what it shows.

use std::borrow::Cow;
use std::collections::BTreeMap;

use plcc_abi::{OperatorPanel, Program};
use plcc_protocol::{Active, EventKind, OperatorView};
use plcc_runtime::{Names, Purpose, VariableKey, announced, announces};

use super::commands::{Batch, Item};

/// What an operator sees of the panels of the program that runs.
pub(super) struct ServedPanel {
    panel: OperatorPanel,
    /// Its variables, as far as the program has them, each once.
    variables: BTreeMap<String, VariableKey>,
}

impl ServedPanel {
    /// The cells of a panel that a program with these names uses.
    pub(super) fn new(panel: &OperatorPanel, names: &dyn Names) -> Self {
        let declared: BTreeMap<String, VariableKey> = names.declared().into_iter().collect();
        let said = |name: &str| names.given().said_of(name).map(Cow::into_owned);
        let panel = panel.of_program(|name| declared.contains_key(name), said);
        let found = |name: &str| Some((name.to_owned(), names.find(name, Purpose::Watch).ok()?));
        let variables = panel.variables().filter_map(found).collect();
        Self { panel, variables }
    }

    /// What is to be read for the screen.
    pub(super) fn batch(&self, program: &Program) -> Batch {
        let items = self.variables.values().map(|key| Item::new(*key, None)).collect();
        let length = if announces(program) { program.image_size as usize } else { 0 };
        Batch { image: vec![0; length], ..Batch::new(items) }
    }

    /// What is on the screen, when the batch has been read.
    pub(super) fn view(&self, program: &Program, batch: &Batch) -> OperatorView {
        let values = self.variables.keys().zip(&batch.items);
        let values: BTreeMap<&str, f64> =
            values.filter_map(|(name, item)| Some((name.as_str(), item.value.number()?))).collect();
        let active = match batch.image.is_empty() {
            true => vec![],
            false => announced(program, &batch.image),
        };
        let active = active.into_iter().map(|one| Active {
            kind: if one.is_fault { EventKind::Fault } else { EventKind::Message },
            name: one.name,
            text: one.text,
            since: None,
        });
        OperatorView::new(&self.panel, active.collect(), &|name| values.get(name).copied())
    }

    /// Whether a variable is that of a key which an operator can press.
    pub(super) fn presses(&self, variable: &str) -> bool {
        let mut buttons = self.panel.cells.iter().filter_map(|cell| cell.button.as_deref());
        buttons.any(|button| button == variable) && self.variables.contains_key(variable)
    }
}
