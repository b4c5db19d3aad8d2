//! How long ticks and scans took and how late ticks began, as the answer to `stat` and the log tell it.

use serde::{Deserialize, Serialize};

/// What was recorded of one thing so far. Times are in microseconds. A percentile is the time within which
/// that share of all lies; it is up to one eighth too large, as histograms are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TimesSummary {
    /// How many times were recorded.
    pub count: u64,
    /// The last one.
    pub last_us: f64,
    /// The mean.
    pub mean_us: f64,
    /// The median.
    pub p50_us: f64,
    /// The 99th percentile.
    pub p99_us: f64,
    /// 99.9 %.
    pub p999_us: f64,
    /// The largest.
    pub max_us: f64,
}

/// What was recorded of a run so far.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TimingSummary {
    /// How long after the beginning of the process the first tick began, in microseconds; 0 before it has,
    /// and where the beginning is not known.
    pub start_us: f64,
    /// How often a tick began only when a later one was already due.
    pub overruns: u64,
    /// How many ticks were skipped.
    pub skipped: u64,
    /// How late ticks began.
    pub lateness: TimesSummary,
    /// How long ticks took.
    pub ticks: TimesSummary,
    /// How long scans of tasks took, of those that have run.
    pub tasks: Vec<TaskSummary>,
}

/// What was recorded of a task's scans.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TaskSummary {
    /// The task, as users know it: `scan`, `:001`, `PLC3`.
    pub name: String,
    /// How long its scans took.
    #[serde(flatten)]
    pub times: TimesSummary,
}
