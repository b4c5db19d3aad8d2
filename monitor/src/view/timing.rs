//! How long ticks take, and where the time goes.

use serde::{Deserialize, Serialize};

/// Timing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimingView {
    /// Lateness, ticks, and the scans of each task, measured by the control. Empty where none is
    /// connected.
    pub times: Vec<TimesRow>,
    /// How many ticks began too late since the control was started.
    pub overruns: Option<u64>,
    /// How many ticks were skipped.
    pub skipped: Option<u64>,
    /// How many ticks `lines` covers.
    pub ticks: u64,
    /// Where the interpreter's time goes, the lines that take most first.
    pub lines: Vec<LineCost>,
    /// The overruns that the record knows, the newest last.
    pub recorded_overruns: Vec<Overrun>,
}

/// Times of one thing in microseconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimesRow {
    /// What was measured.
    pub name: String,
    /// How often.
    pub count: u64,
    /// The last one.
    pub last_us: f64,
    /// The mean.
    pub mean_us: f64,
    /// The median.
    pub p50_us: f64,
    /// The 99th percentile; what lies between it and the median is the jitter.
    pub p99_us: f64,
    /// 99.9 %.
    pub p999_us: f64,
    /// The largest.
    pub max_us: f64,
}

/// What a line of the program costs: the time that the statement interpreter takes for its statements when it
/// runs the ticks again, including the time to take down their values. Compiled code is many times faster, and what is
/// expensive in one need not be so in the other: the time of the control itself is in [`TimesRow`], by task alone.
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
