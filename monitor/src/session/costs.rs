//! What lines cost, summed over many ticks: of a few ticks the clock and the caches of the computer say more than the program.

use std::collections::HashMap;
use std::time::Duration;

use crate::flow::TickSteps;
use crate::text::ProgramText;

/// Of how many ticks lines are shown at least.
pub(super) const ENOUGH: u64 = 200;
/// From how many ticks on older ones count for half.
const MANY: u64 = 4000;

/// What a line has cost.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cost {
    pub(super) time: Duration,
    pub(super) executions: u64,
}

/// What all lines have cost in the ticks that were run in the interpreter.
#[derive(Debug, Default)]
pub(super) struct Costs {
    pub(super) by_row: HashMap<usize, Cost>,
    pub(super) ticks: u64,
    /// The last tick that is run again for this alone; each time the one before it.
    pub(super) next_back: Option<u64>,
}

impl Costs {
    /// Adds a tick.
    pub(super) fn take(&mut self, steps: &TickSteps, text: &ProgramText) {
        if self.ticks >= MANY {
            self.ticks /= 2;
            for cost in self.by_row.values_mut() {
                cost.time /= 2;
                cost.executions /= 2;
            }
        }
        self.ticks += 1;
        for (at, (statement, _)) in steps.steps.iter().enumerate() {
            if let Some(row) = text.row_of(*statement) {
                let cost = self.by_row.entry(row).or_default();
                cost.time += steps.time(at);
                cost.executions += 1;
            }
        }
    }
}
