//! Checks rule 14: a scan is suspended only at labels where its task can go on.

use super::error::Errors;
use crate::tables::FastSet;
use crate::{Block, Func, Label, Module, PrimaryMap, Terminator};

pub(super) fn check_module(module: &Module, errors: &mut Errors) {
    let suspended = suspensions(module);
    // Most modules, all of PMI's among them, never suspend.
    if suspended.is_empty() {
        return;
    }
    let all_points: FastSet<u32> =
        module.tasks.iter().flat_map(|task| task.resume_points.iter().copied()).collect();
    for label in suspended.iter().filter(|label| !all_points.contains(&label.0)) {
        errors.push(format!("a scan is suspended at {label}, which no task has as a resume point"));
    }
    let targets = module.label_targets();
    for task in &module.tasks {
        let points: FastSet<u32> = task.resume_points.iter().copied().collect();
        for label in suspensions_reached(module, &targets, task.entry, &points) {
            if !points.contains(&label.0) && all_points.contains(&label.0) {
                let name = &task.name;
                errors.push(format!(
                    "task {name} is suspended at {label}, which is not one of its resume points"
                ));
            }
        }
    }
}

/// The labels that the module's suspensions name, each once.
fn suspensions(module: &Module) -> Vec<Label> {
    let blocks = module.funcs().flat_map(|(_, func)| func.blocks());
    let mut labels: Vec<Label> = blocks
        .filter_map(|(_, block)| match block.terminator {
            Some(Terminator::Suspend(label)) => Some(label),
            _ => None,
        })
        .collect();
    labels.sort_unstable();
    labels.dedup();
    labels
}

/// The labels of those suspensions that control can reach from the entry or a resume point of a
/// task without a jump to a label by number.
fn suspensions_reached(
    module: &Module,
    targets: &PrimaryMap<Label, Option<(Func, Block)>>,
    entry: u32,
    points: &FastSet<u32>,
) -> Vec<Label> {
    let target = |label: u32| targets.get(Label(label)).copied().flatten();
    let mut seen: FastSet<(Func, Block)> = FastSet::default();
    let mut to_visit: Vec<(Func, Block)> =
        points.iter().copied().chain([entry]).filter_map(target).collect();
    let mut labels = vec![];
    while let Some((func, block)) = to_visit.pop() {
        if !seen.insert((func, block)) {
            continue;
        }
        let data = module.funcs.get(func.index()).and_then(|f| f.blocks.get(block));
        let Some(terminator) = data.and_then(|data| data.terminator.as_ref()) else { continue };
        match terminator {
            Terminator::Suspend(label) => labels.push(*label),
            Terminator::Goto(label) => to_visit.extend(target(label.0)),
            other => other.for_each_block(|next, _| to_visit.push((func, next))),
        }
    }
    labels.sort_unstable();
    labels.dedup();
    labels
}
