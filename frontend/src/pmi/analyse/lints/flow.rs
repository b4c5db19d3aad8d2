//! `unreachable`: statements that no scan reaches.

use plcc_diag::Diagnostic;

use super::successors;
use crate::pmi::ast::{Action, Checked};

/// Finds the first statement of each run of statements that no scan reaches, such as those between a
/// GOTO and the next label.
pub(super) fn unreachable(checked: &Checked, found: &mut Vec<Diagnostic>) {
    let mut reached = vec![false; checked.steps.len() + 1];
    if let Some(first) = reached.first_mut() {
        *first = true;
    }
    let mut was_reached = true;
    // Jumps lead forward only (PMI 2.3.6), so one pass in order is enough.
    for (index, step) in checked.steps.iter().enumerate() {
        let is_reached = reached.get(index).copied().unwrap_or(true);
        if is_reached {
            for next in successors(index, &step.action).into_iter().flatten() {
                if let Some(slot) = reached.get_mut(next) {
                    *slot = true;
                }
            }
        }
        // The jump at the end of a branch is not written in the source.
        if matches!(step.action, Action::Jump { is_goto: false, .. }) {
            continue;
        }
        if was_reached && !is_reached {
            found.push(
                Diagnostic::warning("PMI-W12", step.span, "no scan reaches this statement")
                    .help("put a label in front of it, or take it out"),
            );
        }
        was_reached = is_reached;
    }
}
