//! Differences that the interpreter finds too.

use std::collections::BTreeSet;

use plcc_ir::Label;

use super::Difference;
use super::claims::Subject;
use super::concrete::{End, Reply, Run};
use super::simulate::Simulation;
use super::terms::Function;

impl Subject<'_, '_> {
    /// Runs both versions as one of the simulated runs says. Gives the difference, if there is one.
    pub(super) fn replay(&self, run: &Simulation<'_>, lane: u32) -> Option<Difference> {
        let mut image = vec![0; self.validation.before.image_size as usize];
        for cell in &self.universe.cells {
            for offset in cell.range() {
                if let Some(slot) = image.get_mut(offset) {
                    *slot = run.number(&self.memory.byte(offset), lane) as u8;
                }
            }
        }
        let mut replies = vec![];
        for happening in self.happenings {
            if run.get(happening.cond) >> lane & 1 == 0 {
                continue;
            }
            let Some(application) = self.list.get(happening.application) else { continue };
            let rest = application.results.get(1..).unwrap_or_default();
            let is_call = matches!(application.function, Function::Call(_));
            let width = rest.len() - if is_call { self.universe.width() } else { 0 };
            let (result, raw) = rest.split_at(width);
            let mut reply = Reply { result: run.number(result, lane) as i64, image: vec![] };
            if is_call {
                let bit = |number: usize| {
                    raw.get(number).is_some_and(|&lit| run.get(lit) >> lane & 1 == 1)
                };
                reply.image = self.universe.concrete(&bit);
                reply.result = legal(application.function, reply.result);
            }
            replies.push(reply);
        }
        let mut found = self.differ(self.label, &image, &replies)?;
        // What does not matter is 0.
        let cells = found.1.clone();
        for cell in cells.iter().take(64) {
            let mut other = image.clone();
            for offset in cell.clone() {
                if let Some(slot) = other.get_mut(offset) {
                    *slot = 0;
                }
            }
            if self.deadline.is_over() || other == image {
                continue;
            }
            if let Some(still) = self.differ(self.label, &other, &replies) {
                found = still;
                image = other;
            }
        }
        let offsets = found.1.iter().flat_map(Clone::clone);
        let bytes = offsets.filter_map(|offset| Some((offset, *image.get(offset)?)));
        let image = bytes.filter(|(_, byte)| *byte != 0).collect();
        Some(Difference { image, ..found.0 })
    }

    /// The difference between both versions from a label on, if there is one, and the cells of the image that the first one reads.
    fn differ(
        &self,
        label: Label,
        image: &[u8],
        replies: &[Reply],
    ) -> Option<(Difference, Vec<std::ops::Range<usize>>)> {
        let validation = self.validation;
        let [of_old, of_new] = &validation.labels;
        let (old, old_end) = Run::of(validation.before, of_old, label, image.to_vec(), replies);
        let (new, new_end) = Run::of(validation.after, of_new, label, image.to_vec(), replies);
        if old_end == End::Open || new_end == End::Open {
            return None;
        }
        let mut events = old.events.iter().zip(&new.events);
        let same = |(a, b): &(&super::concrete::Event, &super::concrete::Event)| {
            a.function == b.function && a.args == b.args && a.image == b.image
        };
        let apart = events.position(|pair| !same(&pair));
        let shorter = old.events.len().min(new.events.len());
        let apart = apart.or((old.events.len() != new.events.len()).then_some(shorter));
        let (what, loc) = if let Some(at) = apart {
            let event = old.events.get(at).or(new.events.get(at))?;
            (format!("{} differs", named(event.function)), event.loc)
        } else if old_end != new_end {
            (format!("the end differs: {}, then {}", end(old_end), end(new_end)), old.loc)
        } else {
            let bytes = old.image.iter().zip(&new.image);
            let offset = bytes.enumerate().find(|(_, (a, b))| a != b)?.0;
            let writer = old.writers.get(&offset).or(new.writers.get(&offset)).copied();
            let (a, b) = (old.image.get(offset)?, new.image.get(offset)?);
            let place = validation.before.place_name(offset);
            (format!("{place} is {a}, then {b}"), writer.unwrap_or(old.loc))
        };
        let place = validation.place(loc);
        let reads: BTreeSet<usize> = old.reads.iter().copied().collect();
        let cells = self.universe.cells.iter().map(|cell| cell.range());
        let cells = cells.filter(|range| range.clone().any(|offset| reads.contains(&offset)));
        Some((Difference { what, place, image: vec![] }, cells.collect()))
    }
}

/// The result of a call that its range allows.
fn legal(function: Function, result: i64) -> i64 {
    use plcc_abi::DoubleRange;
    let Function::Call(function) = function else { return result };
    match function.double_range() {
        DoubleRange::Any => result,
        range => super::universe::finite_number(result, range == DoubleRange::FiniteOrMinusZero),
    }
}

fn named(function: Function) -> String {
    match function {
        Function::Call(function) => format!("the call of {}", function.name()),
        Function::Late => "the question whether the scan is late".into(),
        Function::Read(..) => "a volatile load".into(),
        Function::Write(..) => "a volatile store".into(),
        _ => "a function".into(),
    }
}

fn end(end: End) -> String {
    match end {
        End::Return => "the scan ends".into(),
        End::Suspended(label) => format!("it is suspended until {label}"),
        End::Trap(trap) => format!("it is stopped ({:?})", trap.code),
        End::Lost => "control is lost".into(),
        End::Open => "it goes on".into(),
    }
}
