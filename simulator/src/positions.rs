//! Where the axes are: the commands, and the actual positions, which lag behind.

use serde::{Deserialize, Serialize};

use crate::history::History;
use crate::length::ticks;
use crate::setup::Setup;

/// The positions of all axes, in nanometres.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Positions {
    commands: Vec<i128>,
    actual: Vec<i128>,
    history: History,
}

impl Positions {
    /// The start positions.
    pub(crate) fn new(setup: &Setup, tick_ns: u64) -> Self {
        let commands: Vec<i128> = setup.axes.iter().map(|axis| axis.start).collect();
        let history = History::new(&commands, ticks(setup.lag_ns, tick_ns));
        Self { actual: commands.clone(), commands, history }
    }

    pub(crate) fn fits(&self, own: &Self) -> bool {
        self.commands.len() == own.commands.len()
            && self.actual.len() == own.actual.len()
            && self.history.fits(&own.history)
    }

    /// Ends a step: the actual positions become the commands of some ticks ago.
    pub(crate) fn delay(&mut self) {
        for (actual, command) in self.actual.iter_mut().zip(&self.commands) {
            *actual = *command;
        }
        self.history.delay(&mut self.actual);
    }

    pub(crate) fn commands(&self) -> &[i128] {
        &self.commands
    }

    pub(crate) fn command(&self, axis: usize) -> i128 {
        self.commands.get(axis).copied().unwrap_or(0)
    }

    pub(crate) fn set_command(&mut self, axis: usize, position: i128) {
        if let Some(command) = self.commands.get_mut(axis) {
            *command = position;
        }
    }

    /// Puts an axis to a position that counts as its actual one, too, at once.
    pub(crate) fn put(&mut self, axis: usize, position: i128) {
        self.set_command(axis, position);
        self.history.fill(axis, position);
    }

    pub(crate) fn actual(&self, axis: usize) -> i128 {
        self.actual.get(axis).copied().unwrap_or(0)
    }

    pub(crate) fn all_actual(&self) -> &[i128] {
        &self.actual
    }
}
