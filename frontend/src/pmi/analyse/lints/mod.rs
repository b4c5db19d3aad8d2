//! The lints of PMI: what the language allows and a programmer seldom means.
//!
//! They look at the checked program, so they are asked only where there is no error. A file holds
//! the lints that ask the same thing: `names` about names that are nearly alike, `assignments` about
//! what is assigned never or twice, `reads` about what is never read, `logicals` about names that nobody has
//! declared, `values` about constants, `flow` about what no scan reaches.

mod assignments;
mod flow;
mod logicals;
mod names;
mod reads;
mod values;

use plcc_diag::Diagnostic;

use crate::pmi::ast::{Action, Checked, SymbolId, Target};

/// All findings of the lints, in no particular order.
pub(crate) fn find(checked: &Checked) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    names::near_names(checked, &mut found);
    assignments::unassigned(checked, &mut found);
    assignments::assigned_twice(checked, &mut found);
    logicals::numbers_in_logicals(checked, &mut found);
    reads::never_read(checked, &mut found);
    values::out_of_range(checked, &mut found);
    values::constant_conditions(checked, &mut found);
    flow::unreachable(checked, &mut found);
    found
}

/// The symbol that a step assigns, or one of whose elements it assigns.
fn assigned(action: &Action) -> Option<SymbolId> {
    let Action::Assign { target, .. } = action else { return None };
    let (Target::Scalar(symbol) | Target::At(symbol, _) | Target::Element(symbol, _)) = target;
    Some(*symbol)
}

/// The steps that may follow the step with this index.
fn successors(index: usize, action: &Action) -> [Option<usize>; 2] {
    match *action {
        Action::Assign { .. } => [Some(index + 1), None],
        Action::If { otherwise, .. } => [Some(index + 1), Some(otherwise as usize)],
        Action::Jump { to, .. } => [Some(to as usize), None],
    }
}
