//! Values of variables in consecutive ticks: of the scope, and of ways in a plane.

use std::collections::VecDeque;

use plcc_runtime::{Executive, Purpose};

/// Samples of consecutive ticks.
#[derive(Debug, Default)]
pub(super) struct Samples {
    pub(super) first: u64,
    /// A row for each tick with a value for each variable; NaN for none.
    rows: VecDeque<Vec<f64>>,
}

impl Samples {
    /// None yet; the next one is that of a tick.
    pub(super) fn from(first: u64) -> Self {
        Self { first, rows: VecDeque::new() }
    }

    /// The tick after the last one.
    pub(super) fn end(&self) -> u64 {
        self.first + self.rows.len() as u64
    }

    pub(super) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Adds those of the next tick; of more than `most` the oldest are dropped.
    pub(super) fn push(&mut self, row: Vec<f64>, most: u64) {
        self.rows.push_back(row);
        while self.rows.len() as u64 > most {
            self.rows.pop_front();
            self.first += 1;
        }
    }

    pub(super) fn value(&self, tick: u64, channel: usize) -> Option<f64> {
        let row = self.rows.get(usize::try_from(tick.checked_sub(self.first)?).ok()?)?;
        row.get(channel).copied().filter(|value| !value.is_nan())
    }
}

/// The values of variables; NaN for those that have none.
pub(super) fn values(names: &[String], executive: &mut dyn Executive) -> Vec<f64> {
    let value = |name: &String| {
        let Ok(variable) = executive.names().find(name, Purpose::Watch) else { return f64::NAN };
        executive.read(variable).number().unwrap_or(f64::NAN)
    };
    names.iter().map(value).collect()
}
