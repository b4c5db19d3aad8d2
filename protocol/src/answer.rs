//! What the control answers to each request.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value as Json;

use crate::{OperatorView, TimingSummary};

/// A force in effect.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Force {
    /// The input or output.
    pub name: String,
    /// The value at which it is held, as it was given.
    pub value: String,
}

/// Who forces a variable.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ForcedBy {
    /// The input or output.
    pub name: String,
    /// The user and the command.
    pub by: String,
    /// The tick before which the force began.
    pub ticks: u64,
}

/// What the control is doing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Status {
    /// `prepared`, `running` or `stopped`.
    pub state: String,
    /// How many ticks are done.
    pub ticks: u64,
    /// The language of the program: `pmi`, `nct`, `pmac`.
    pub dialect: String,
    /// The source or the artifact, for people.
    pub program: String,
    /// What tells the program from others, in hexadecimal digits.
    pub fingerprint: String,
    /// How often the program was replaced.
    pub generation: u64,
    /// The program that a rollback would run.
    pub rollback_to: Option<String>,
    /// The online change that waits; `None` where none does.
    pub waiting_change: Option<WaitingChange>,
    /// The number of the control's process.
    pub process: u32,
    /// The forces in effect.
    pub forces: Vec<Force>,
    /// Who made those forces that came by a socket.
    pub forced_by: Vec<ForcedBy>,
    /// What clients may do besides looking.
    pub allow: Vec<String>,
    /// The file of retained data; `None` without `--retain`.
    pub retained: Option<Retained>,
    /// The file in which the control is recorded; `None` where it is not.
    pub record: Option<String>,
}

/// An online change that waits for something to end.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct WaitingChange {
    /// The program that is to run.
    pub program: String,
    /// What it waits for.
    pub why: String,
    /// Who asked for it.
    pub by: String,
    /// How many seconds it waits yet at most.
    pub seconds_left: f64,
}

/// Where retained data is kept.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Retained {
    /// The file.
    pub file: String,
    /// Why it can't be written at present.
    pub error: Option<String>,
}

/// How long ticks take and how late they begin.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Stat {
    /// The times.
    #[serde(flatten)]
    pub timing: TimingSummary,
    /// How many ticks are done.
    pub ticks_done: u64,
    /// The forces in effect.
    pub forces: Vec<Force>,
}

/// A part of the program's variables.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Variables {
    /// The variables.
    pub variables: Vec<Variable>,
    /// Whether there are further ones, after the last name of these.
    pub more: bool,
}

/// A variable of the program.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Variable {
    /// What it is called.
    pub name: String,
    /// Whether it is 0 or 1.
    pub logical: bool,
    /// How many elements an array has.
    pub elements: Option<u32>,
    /// Another name that people gave to it; empty without one.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub alias: String,
    /// What people say of it, in one line; empty where nothing is known.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub text: String,
}

/// Values at one moment, or from one moment to another.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Values {
    /// How many ticks were done when the last one was read.
    pub ticks: u64,
    /// How many were done when the first one was read, where that was another tick.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_ticks: Option<u64>,
    /// For each name a number, or a list of them for an array.
    pub values: BTreeMap<String, Json>,
}

/// The operator's screen of the program that runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct OperatorScreen {
    /// `prepared`, `running` or `stopped`.
    pub state: String,
    /// How many ticks were done when its values were read.
    pub ticks: u64,
    /// The language of the program.
    pub dialect: String,
    /// The source or the artifact, for people.
    pub program: String,
    /// Whether keys may be pressed.
    pub may_press: bool,
    /// How many forces are in effect.
    pub forces: usize,
    /// What is on it.
    #[serde(flatten)]
    pub view: OperatorView,
}

/// A change was made.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Done {
    /// The tick before which it was made.
    pub ticks: u64,
    /// How many variables it has changed.
    pub count: usize,
    /// The forces in effect.
    pub forces: Vec<Force>,
}

/// What an online change keeps, and what not.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Comparison {
    /// How many variables keep their values.
    pub kept: usize,
    /// What is not the same in both programs.
    pub changes: Vec<ChangedVariable>,
}

/// A variable or task that is not the same in both programs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChangedVariable {
    /// Its name.
    pub name: String,
    /// What becomes of it.
    pub change: Change,
    /// What it is in the running program.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub old: Option<String>,
    /// What it is in the new one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub new: Option<String>,
    /// Whether the online change is refused unless this is accepted.
    #[serde(default)]
    pub needs_accept: bool,
}

/// What becomes of a variable in an online change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Change {
    /// Only the new program has it.
    New,
    /// Only the running program has it.
    Gone,
    /// It is something else in the new program.
    Changed,
}

/// An online change that was made.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct OnlineChange {
    /// What it kept.
    #[serde(flatten)]
    pub comparison: Comparison,
    /// The first tick of the new program.
    pub ticks: u64,
    /// How long the ticks were held up, in microseconds.
    pub took_us: f64,
    /// How often the program was replaced.
    pub generation: u64,
}
