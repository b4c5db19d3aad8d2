//! What a PMI control keeps outside the process image.

use serde::{Deserialize, Serialize};

use super::forces::Forces;

/// All of it. Variables, timers' counters, flip-flops' last clocks and the port lines are in the
/// image.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct State {
    /// The number of the next tick.
    pub(super) tick: u64,
    /// Time in nanoseconds that has passed and is not yet a whole unit of the timers.
    pub(super) timer_remainder: u64,
    /// Whether the next tick has begun already, by a stimulus.
    pub(super) tick_begun: bool,
    /// Which of the faults and messages were on at the end of the last scan, in the order of the
    /// tables: faults first.
    pub(super) announced: Vec<bool>,
    /// The forces in effect.
    pub(super) forces: Forces,
}
