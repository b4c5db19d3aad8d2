//! The last scans: the statements of the last scan of each task before a moment.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use plcc_replay::DebugError;

use crate::inquiry::{Inquiry, Moment};

/// How many ticks are searched for the last scan of each task. A PMAC runs its up to 31 background PLCs in turn, one a
/// tick.
const LOOK_BACK: u64 = 40;

/// The last scans before a moment.
#[derive(Debug, Default)]
pub(crate) struct Round {
    /// The steps, the last one first.
    pub(crate) steps: Vec<Moment>,
    /// When each statement was executed last.
    pub(crate) latest: HashMap<u32, Moment>,
    /// The tasks that were called.
    pub(crate) tasks: HashSet<usize>,
    /// The first tick that belongs to it.
    pub(crate) first: u64,
}

impl Round {
    pub(crate) fn before(inquiry: &mut Inquiry<'_>, moment: Moment) -> Result<Self, DebugError> {
        let go_on = inquiry.program.language().scans_go_on();
        let count = inquiry.program.tables().tasks.len();
        let earliest = inquiry.history.first().max(moment.tick.saturating_sub(LOOK_BACK));
        let mut round = Self { first: moment.tick, ..Self::default() };
        // Of each task the tick and number of the call that belongs to its last scan, and whether that scan began there.
        let mut calls: HashMap<usize, (u64, usize, bool)> = HashMap::new();
        for tick in (earliest..=moment.tick).rev() {
            let trace = inquiry.trace(tick)?;
            let end = if tick == moment.tick { moment.step } else { trace.steps.len() };
            for (number, step) in trace.steps.iter().enumerate().take(end).rev() {
                let begins = trace.calls.get(step.call).is_none_or(|call| !(call.resumed && go_on));
                let this = (tick, step.call, begins);
                match calls.get(&step.task) {
                    Some(&known) if known.0 == this.0 && known.1 == this.1 => {}
                    // An earlier scan.
                    Some(&(_, _, true)) => continue,
                    _ => drop(calls.insert(step.task, this)),
                }
                let at = Moment { tick, step: number };
                round.steps.push(at);
                round.latest.entry(step.statement).or_insert(at);
                round.first = tick;
            }
            round.tasks.extend(trace.calls.iter().map(|call| call.task));
            if (0..count).all(|task| calls.get(&task).is_some_and(|call| call.2)) {
                break;
            }
        }
        Ok(round)
    }

    /// When a statement was executed last before a moment.
    pub(crate) fn execution(&self, statement: u32, before: Moment) -> Option<Moment> {
        self.latest.get(&statement).copied().filter(|at| *at < before)
    }
}

/// A round that may be shared.
pub(crate) type SharedRound = Rc<Round>;
