//! What is declared to be assigned and never is, and outputs that are assigned twice:
//! `unassigned-output`, `code-never-reset`, `control-never-assigned`, `output-assigned-twice`.

use std::collections::HashSet;

use plcc_diag::Diagnostic;

use super::{assigned, successors};
use crate::pmi::ast::{Checked, Meaning, Symbol, SymbolId};

/// Finds outputs, M and G codes, and controls of timers and flip-flops that no statement assigns.
pub(super) fn unassigned(checked: &Checked, found: &mut Vec<Diagnostic>) {
    let targets: HashSet<SymbolId> =
        checked.steps.iter().filter_map(|step| assigned(&step.action)).collect();
    for (index, symbol) in checked.symbols.iter().enumerate() {
        let Some(span) = symbol.declared else { continue };
        if targets.contains(&SymbolId(index as u32)) {
            continue;
        }
        let name = &symbol.name;
        let finding = match symbol.meaning {
            Meaning::Output(_) => Diagnostic::warning(
                "PMI-W6",
                span,
                format!("nothing assigns the output {name}, so it stays off"),
            )
            .help("assign it, or take its line out of $OUTPUT"),
            Meaning::ResetOnly if symbol.executive => Diagnostic::warning(
                "PMI-W8",
                span,
                format!("nothing resets {name}, so the part program waits at this code for ever"),
            )
            .help(format!("write {name} = F where the function is finished")),
            Meaning::TimerControl(_) => Diagnostic::warning(
                "PMI-W9",
                span,
                format!("nothing assigns {name}, the control contact of this timer"),
            )
            .help(format!("assign {name}, or take the timer out")),
            Meaning::Clock(_) => Diagnostic::warning(
                "PMI-W9",
                span,
                format!("nothing assigns {name}, the clock of this flip-flop"),
            )
            .help(format!("assign {name}, or take the flip-flop out")),
            _ => continue,
        };
        found.push(finding);
    }
}

/// How many steps `assigned_twice` looks at, all outputs together. Programs of machines need a few
/// thousand; one that is written to be slow is not searched to its end.
const MAX_STEPS: usize = 4_000_000;

/// Finds assignments to outputs that a later statement of the same scan always overwrites. Outputs
/// are written when the scan ends (PMI 2.3.2), so the first value never shows.
pub(super) fn assigned_twice(checked: &Checked, found: &mut Vec<Diagnostic>) {
    let is_output =
        |symbol: Option<&Symbol>| symbol.is_some_and(|s| matches!(s.meaning, Meaning::Output(_)));
    let mut places: Vec<(SymbolId, usize)> = Vec::new();
    for (index, step) in checked.steps.iter().enumerate() {
        if let Some(symbol) = assigned(&step.action)
            && is_output(checked.symbol(symbol))
        {
            places.push((symbol, index));
        }
    }
    places.sort_unstable();
    let mut steps_left = MAX_STEPS;
    for group in places.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1) {
        let (Some(&(symbol, first)), Some(&(_, last))) = (group.first(), group.last()) else {
            continue;
        };
        let Some(symbol) = checked.symbol(symbol) else { continue };
        let Some(left) = steps_left.checked_sub(last - first + 1) else { break };
        steps_left = left;
        let mut of_group = group.iter().rev().map(|(_, index)| *index).peekable();
        // For each step between the first assignment and the last: the assignment that every way
        // from there meets next.
        let mut met: Vec<Option<usize>> = vec![None; last - first + 1];
        for index in (first..=last).rev() {
            let Some(step) = checked.steps.get(index) else { continue };
            let next = |at: usize| at.checked_sub(first).and_then(|at| met.get(at).copied()?);
            let [one, other] = successors(index, &step.action);
            let after = match (one.map(next), other.map(next)) {
                (Some(a), None) => a,
                (Some(Some(a)), Some(Some(b))) => Some(a.min(b)),
                _ => None,
            };
            let is_assignment = of_group.next_if_eq(&index).is_some();
            if is_assignment && let Some(later) = after.and_then(|later| checked.steps.get(later)) {
                let message = format!(
                    "what is assigned to the output {} here never shows: it is assigned again in \
                     the same scan",
                    symbol.name
                );
                found.push(
                    Diagnostic::warning("PMI-W7", step.span, message)
                        .label(later.span, "this statement overwrites it")
                        .help(
                            "join the two conditions, or assign a LOGICAL here and the output once",
                        ),
                );
            }
            if let Some(slot) = met.get_mut(index - first) {
                *slot = if is_assignment { Some(index) } else { after };
            }
        }
    }
}
