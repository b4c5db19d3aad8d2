//! The operator's screen: what of a control's panels an artifact keeps, so that a controller without the compiler can show it.

use std::collections::BTreeMap;

use plcc_abi::{OperatorCell, OperatorPanel};

use super::{Cell, Shown};
use crate::CheckedProgram;

/// The keys, lamps and overrides of a program's panels. None of them depends on a state of the program, but for the text of a
/// touch key, of which the panel has the variable.
pub fn operator_panel(program: &dyn CheckedProgram) -> OperatorPanel {
    let drafts = program.panels(&[], &mut |_| Ok(BTreeMap::new())).unwrap_or_default();
    let cells = drafts.into_iter().flat_map(|draft| draft.cells);
    OperatorPanel { cells: cells.filter_map(kept).collect(), key_texts: program.key_texts() }
}

/// A cell, if it is a key, a lamp or an override.
fn kept(cell: Cell) -> Option<OperatorCell> {
    let Cell { label, shown, light, button, unused, .. } = cell;
    let is_key = light.is_some() || button.is_some();
    let (text, number) = match shown {
        Shown::Key(name) => (Some(name), None),
        Shown::Number(name) if !is_key => (None, Some(name)),
        _ => (None, None),
    };
    let is_kept = is_key || number.is_some() && label.contains('%');
    let unused = unused.filter(|_| number.is_some());
    (is_kept && !label.is_empty()).then_some(OperatorCell {
        label,
        text,
        number,
        light,
        button,
        unused,
    })
}
