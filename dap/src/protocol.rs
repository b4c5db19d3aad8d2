//! The messages of the Debug Adapter Protocol that are used here, as its specification names them.
//! What a client leaves out has the default that the specification gives.

use serde::{Deserialize, Serialize};

/// A request.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Request {
    pub(super) seq: i64,
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) command: String,
    pub(super) arguments: serde_json::Value,
}

/// `initialize`.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct InitializeArguments {
    pub(super) lines_start_at1: bool,
    pub(super) columns_start_at1: bool,
}

impl Default for InitializeArguments {
    fn default() -> Self {
        Self { lines_start_at1: true, columns_start_at1: true }
    }
}

/// One text, or several.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub enum OneOrMore {
    /// One.
    One(String),
    /// Several.
    More(Vec<String>),
}

impl Default for OneOrMore {
    fn default() -> Self {
        Self::More(vec![])
    }
}

impl OneOrMore {
    /// All of them.
    pub fn all(&self) -> Vec<String> {
        match self {
            Self::One(one) => vec![one.clone()],
            Self::More(all) => all.clone(),
        }
    }
}

/// What a client asks for with `launch` and `attach`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct LaunchArguments {
    /// The source; several files are one PMAC download. Of a recording it may be missing.
    pub program: OneOrMore,
    /// The path of a stimulus.
    pub stimulus: Option<String>,
    /// The path of a machine file.
    pub machine: Option<String>,
    /// How many ticks the run has; without it the run has no end.
    pub ticks: Option<u64>,
    /// The path of a recording, which is debugged instead of a run from power-up.
    pub recording: Option<String>,
    /// The socket of the control whose recording is debugged while it runs. What is set acts on the control.
    pub socket: Option<String>,
    /// Further options of `plcc run`, such as `--param` and `61=12`.
    pub args: Vec<String>,
    /// The folder to which relative paths belong.
    pub cwd: Option<String>,
    /// Whether the debugger stops before the first statement. Of a recording it always stops at the end.
    pub stop_on_entry: bool,
    /// Whether ticks are run no faster than by the control's clock.
    pub realtime: bool,
}

/// A source file.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Source {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) name: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) path: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) source_reference: Option<i64>,
}

/// `setBreakpoints`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct SetBreakpointsArguments {
    pub(super) source: Source,
    pub(super) breakpoints: Vec<SourceBreakpoint>,
    /// The old form of `breakpoints`.
    pub(super) lines: Vec<i64>,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct SourceBreakpoint {
    pub(super) line: i64,
    pub(super) column: Option<i64>,
    pub(super) condition: Option<String>,
    pub(super) hit_condition: Option<String>,
    pub(super) log_message: Option<String>,
}

/// A breakpoint in answers.
#[derive(Clone, Debug, Default, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Breakpoint {
    pub(super) id: i64,
    pub(super) verified: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) message: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) line: Option<i64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) column: Option<i64>,
}

/// `breakpointLocations`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct LocationsArguments {
    pub(super) source: Source,
    pub(super) line: i64,
    pub(super) end_line: Option<i64>,
}

/// `dataBreakpointInfo`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct DataBreakpointInfoArguments {
    pub(super) name: String,
}

/// `setDataBreakpoints`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct SetDataBreakpointsArguments {
    pub(super) breakpoints: Vec<WantedDataBreakpoint>,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct WantedDataBreakpoint {
    pub(super) data_id: String,
    pub(super) condition: Option<String>,
    pub(super) hit_condition: Option<String>,
}

/// `setExceptionBreakpoints`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct SetExceptionBreakpointsArguments {
    pub(super) filters: Vec<String>,
}

/// `stackTrace`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct StackTraceArguments {
    pub(super) thread_id: i64,
    pub(super) start_frame: usize,
    pub(super) levels: usize,
}

/// A frame of the stack.
#[derive(Clone, Debug, Default, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct StackFrame {
    pub(super) id: i64,
    pub(super) name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) source: Option<Source>,
    pub(super) line: i64,
    pub(super) column: i64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) end_line: Option<i64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) end_column: Option<i64>,
}

/// `variables`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct VariablesArguments {
    pub(super) variables_reference: i64,
    pub(super) start: usize,
    pub(super) count: usize,
    pub(super) format: ValueFormat,
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct ValueFormat {
    pub(super) hex: bool,
}

/// A variable in answers.
#[derive(Clone, Debug, Default, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Variable {
    pub(super) name: String,
    pub(super) value: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) evaluate_name: Option<String>,
    pub(super) variables_reference: i64,
}

/// `setVariable`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct SetVariableArguments {
    pub(super) name: String,
    pub(super) value: String,
}

/// `evaluate`, and `setExpression`, which has a value.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct EvaluateArguments {
    pub(super) expression: String,
    pub(super) context: String,
    pub(super) value: String,
    pub(super) format: ValueFormat,
}

/// `next`, `stepIn`, `stepOut` and `stepBack`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct StepArguments {
    pub(super) granularity: String,
}

/// `source`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct SourceArguments {
    pub(super) source: Source,
    pub(super) source_reference: i64,
}

/// Our own requests `plcc/lastWriter` and `plcc/lastChange` (a name) and `plcc/goToTick` (a tick).
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct OwnArguments {
    pub(super) name: String,
    pub(super) tick: u64,
}
