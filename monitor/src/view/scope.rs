//! Variables against time.

use serde::{Deserialize, Serialize};

use crate::Trigger;

/// The scope.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScopeView {
    /// The variables.
    pub channels: Vec<Channel>,
    /// The first tick that is shown.
    pub from: u64,
    /// The last one.
    pub to: u64,
    /// The tick of the trigger, where it was met.
    pub trigger_tick: Option<u64>,
    /// The trigger.
    pub trigger: Option<Trigger>,
    /// Whether it waits for the trigger.
    pub state: ScopeState,
    /// The ticks of the two cursors.
    pub cursors: [Option<u64>; 2],
    /// The time between them in seconds.
    pub difference: Option<f64>,
    /// The names under which set-ups are kept.
    pub saved: Vec<String>,
    /// What can't be shown, and why.
    pub note: Option<String>,
    /// The tick that is shown elsewhere.
    pub tick: u64,
    /// The marks of the axis of time.
    pub axis: Vec<AxisMark>,
}

/// A mark of the axis of time.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AxisMark {
    /// Its tick.
    pub tick: u64,
    /// The time of day (UTC), or the time since power-up where no time of day is known.
    pub text: String,
}

/// What the scope does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScopeState {
    /// It shows the newest ticks, or those around the tick that is shown.
    Rolling,
    /// It waits for the trigger.
    Waiting,
    /// The trigger was met, and what is shown stays.
    Triggered,
    /// It shows a stretch of time that the user has chosen.
    Held,
}

/// A variable on the scope.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Channel {
    /// The variable.
    pub name: String,
    /// Whether it is 0 or 1 only.
    pub logical: bool,
    /// The smallest value that is shown.
    pub low: f64,
    /// The largest one.
    pub high: f64,
    /// The samples, by rising ticks; a value holds up to the next sample.
    pub samples: Vec<Sample>,
    /// The values at the two cursors.
    pub at_cursors: [Option<f64>; 2],
}

/// What a variable was in a stretch of time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// The first tick of the stretch.
    pub tick: u64,
    /// The smallest value in it.
    pub low: f64,
    /// The largest.
    pub high: f64,
    /// The last.
    pub last: f64,
}
