//! How long ticks take, and where the time goes.

use plcc_protocol::TaskSummary;
use serde::{Deserialize, Serialize};

/// Timing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimingView {
    /// Lateness, ticks, and the scans of each task, measured by the control. Empty where none is
    /// connected.
    pub times: Vec<TaskSummary>,
    /// How many ticks began too late since the control was started.
    pub overruns: Option<u64>,
    /// How many ticks were skipped.
    pub skipped: Option<u64>,
    /// How many ticks `lines` covers: those that were run in the interpreter so far.
    pub ticks: u64,
    /// How many these have to be before lines are shown.
    pub enough: u64,
    /// Where the interpreter's time goes, the lines that take most first. Empty as long as too few ticks are covered.
    pub lines: Vec<LineCost>,
    /// The overruns that the record knows, the newest last.
    pub recorded_overruns: Vec<Overrun>,
}

/// What a line of the program costs: the time that the statement interpreter takes for its statements when it
/// runs the ticks again, including the time to take down their values. Compiled code is many times faster, and what is
/// expensive in one need not be so in the other: the time of the control itself is in [`TimingView::times`], by task alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LineCost {
    /// Which line of the program it is.
    pub row: usize,
    /// Its source line number.
    pub number: String,
    /// Its text.
    pub text: String,
    /// How often its statements were executed in the ticks that were looked at.
    pub executions: u64,
    /// How long the interpreter took for them in a tick, in the mean, in nanoseconds.
    pub nanoseconds: f64,
    /// Which part of the interpreter's time for all statements that is, from 0 to 1.
    pub share: f64,
}

/// A tick that took too long.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Overrun {
    /// The tick before which ticks were skipped, or in which a scan was stopped.
    pub tick: u64,
    /// How many ticks were skipped.
    pub skipped: u64,
    /// How many statements the tick before it has executed; `None` if it can't be run again.
    pub statements: Option<u64>,
    /// How many statements a tick executes in the mean of the ticks that were looked at.
    pub usual: f64,
    /// The line that the tick before it has executed most often.
    pub line: Option<String>,
}
