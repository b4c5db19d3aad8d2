//! What a control is given in a step.

use crate::access::Access;
use crate::event::Told;

/// A step of the simulator.
pub(crate) struct Context<'a> {
    /// The number of the tick.
    pub(crate) tick: u64,
    /// The length of a tick in nanoseconds.
    pub(crate) tick_ns: u64,
    pub(crate) access: &'a mut dyn Access,
    /// What is told of this step.
    pub(crate) told: &'a mut Vec<Told>,
}

/// The most events that wait to be told, of ticks that were skipped too.
pub(crate) const MAX_TOLD: usize = 256;

impl Context<'_> {
    /// Tells something. What does not fit any more, behind a long gap of skipped ticks, is not told.
    pub(crate) fn tell(&mut self, told: Told) {
        if self.told.len() < MAX_TOLD {
            self.told.push(told);
        }
    }
}
