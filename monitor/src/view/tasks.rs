//! Tasks: PMI's scan, NCT's modules, PMAC's PLCs and PLCCs.

use serde::{Deserialize, Serialize};

/// The tasks, and what the control says of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TasksView {
    /// The tasks.
    pub rows: Vec<TaskRow>,
    /// Other facts: I5 and the timers of a PMAC, say.
    pub facts: Vec<Fact>,
}

/// A task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TaskRow {
    /// Its name: `scan`, `:001`, `PLC5`.
    pub name: String,
    /// Its state.
    pub state: TaskState,
    /// The row of the program at which it waits or goes on.
    pub row: Option<usize>,
    /// The same as a source line number with the line's text.
    pub place: Option<String>,
    /// The tick in which it ran last, among those that were looked at.
    pub tick: Option<u64>,
    /// How often a scan of it began in a second, in the ticks that were looked at.
    pub scans_per_second: f64,
    /// How many statements its last scan has executed.
    pub statements: usize,
}

/// What a task does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TaskState {
    /// Its scans run to their end.
    Running,
    /// It waits in the middle of its text: in a WHILE, or where its time was over.
    Waiting,
    /// It was paused.
    Paused,
    /// It is disabled.
    Disabled,
    /// The program has no text for it.
    Empty,
    /// It has not run in the ticks that were looked at.
    Idle,
}

/// A value with a title.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fact {
    /// The title.
    pub title: String,
    /// The value.
    pub value: String,
}
