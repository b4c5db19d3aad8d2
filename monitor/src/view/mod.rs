//! What is shown: plain data, without any notion of a terminal or a browser. All of it can be made
//! JSON and read back.

mod events;
mod io;
mod machine;
mod panels;
mod scope;
mod statements;
mod tasks;
mod timing;
mod variables;
mod why;

use serde::{Deserialize, Serialize};

pub use events::{EventLine, EventsView};
pub use io::{IoRow, IoView, IoWindow};
pub use machine::{
    AxisView, DeviceLine, DeviceView, MachineView, PathView, ProgramLine, ProgramView,
};
pub use panels::{Panel, PanelsView};
pub use plcc_protocol::{Active, EventKind, OperatorView, PanelCell};
pub use scope::{AxisMark, Channel, Sample, ScopeState, ScopeView};
pub use statements::{
    DirectoryRow, DirectoryView, Execution, NamedValue, ReferencesView, Role, StatementLayout,
    StatementLine, StatementsView, Token,
};
pub use tasks::{Fact, TaskRow, TaskState, TasksView};
pub use timing::{LineCost, Overrun, TimingView};
pub use variables::{Said, TerminalLine, TerminalView, VariableRow, VariablesView};
pub use why::{WhyLine, WhyPiece, WhyView};

/// Which part of the session is to be shown.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "screen", rename_all = "snake_case", deny_unknown_fields)]
pub enum Screen {
    /// The status alone.
    Status,
    /// The program's statements with their values in the scan that is shown.
    Statements {
        /// The first line, counted from 0 among those that are shown; `None` keeps the cursor in
        /// sight.
        first: Option<usize>,
        /// How many lines at most.
        count: usize,
    },
    /// All executable statements with line number and name or keyword (PMI 5.1 `directory`).
    Directory,
    /// Where a statement, label or variable occurs (NCT 5, F6 STAT).
    References {
        /// The variable, label or statement.
        name: String,
    },
    /// Why a variable has its value: the answer to the last [`Why`](crate::Command::Why).
    Why,
    /// The tasks: modules, PLCs and PLCCs.
    Tasks,
    /// The watch list.
    Variables,
    /// Inputs and outputs.
    Io,
    /// Faults, messages and all other events.
    Events,
    /// How long ticks take, and where the time goes.
    Timing,
    /// The PMAC terminal.
    Terminal,
    /// Operator panels, displays and tables of the control.
    Panels,
    /// The simulated machine.
    Machine,
    /// The operator's screen.
    Operator,
    /// The scope.
    Scope {
        /// How many samples of a variable at most. A longer time is shown by the smallest and the
        /// largest value in each of so many stretches.
        samples: usize,
    },
}

/// A screen with what stands around it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// What is shown of every screen.
    pub status: Status,
    /// The screen.
    pub body: Body,
}

/// What is on a screen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "screen", rename_all = "snake_case")]
pub enum Body {
    /// The screen has nothing but the status, or why there is nothing to show.
    Status {
        /// Why there is nothing, where something was asked for.
        reason: Option<String>,
    },
    /// Statements.
    Statements(StatementsView),
    /// The directory.
    Directory(DirectoryView),
    /// Occurrences.
    References(ReferencesView),
    /// Why a variable has its value.
    Why(WhyView),
    /// Tasks.
    Tasks(TasksView),
    /// The watch list.
    Variables(VariablesView),
    /// Inputs and outputs.
    Io(IoView),
    /// Events.
    Events(EventsView),
    /// Timing.
    Timing(TimingView),
    /// The PMAC terminal.
    Terminal(TerminalView),
    /// Panels.
    Panels(PanelsView),
    /// The simulated machine.
    Machine(MachineView),
    /// The operator's screen.
    Operator(OperatorView),
    /// The scope.
    Scope(ScopeView),
}

/// What is monitored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TargetKind {
    /// A control, by its socket; and by its record where there is one.
    Control,
    /// A recording.
    Recording,
    /// A program that is run by the monitor itself.
    Program,
}

/// A force in effect.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ForcedValue {
    /// The variable.
    pub name: String,
    /// The value at which it is held.
    pub value: String,
    /// Who holds it there, where the control says it.
    pub by: Option<String>,
    /// The tick before which that began.
    pub since: Option<u64>,
}

impl ForcedValue {
    /// `DOOR=1 by user anna with plcctl (process 71) since tick 105`
    pub fn line(&self) -> String {
        let by = self.by.as_ref().map(|by| format!(" by {by}")).unwrap_or_default();
        let since = self.since.map(|tick| format!(" since tick {tick}")).unwrap_or_default();
        format!("{}={}{by}{since}", self.name, self.value)
    }
}

/// What stands around every screen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// What is monitored.
    pub kind: TargetKind,
    /// Its name: a path.
    pub name: String,
    /// The program's name.
    pub program: String,
    /// The language: `pmi`, `nct` or `pmac`.
    pub dialect: String,
    /// Whether the keys of the statements are those for choosing some of them (PMI 5.1).
    pub chooses_statements: bool,
    /// What a part of the program is called to which the user goes from the part before: `MODUL`, `PLC`.
    pub part_title: String,
    /// Whether the control has a terminal.
    pub has_terminal: bool,
    /// Whether a machine is simulated, which can be looked at.
    pub has_machine: bool,
    /// `running`, `stopped`, `paused`, `ended`, `recorded`, `not connected`.
    pub state: String,
    /// Why the program was stopped or what is wrong with the connection.
    pub reason: Option<String>,
    /// The tick whose values are shown.
    pub tick: u64,
    /// Its time since power-up, in seconds.
    pub seconds: f64,
    /// Whether the newest tick is shown as time goes on.
    pub following: bool,
    /// The first tick that can be shown.
    pub first_tick: u64,
    /// The last one.
    pub last_tick: u64,
    /// The length of a tick in nanoseconds.
    pub tick_ns: u64,
    /// How many ticks the control has done, where one is connected. Its record ends about a second earlier.
    pub control_ticks: Option<u64>,
    /// Whether a tick of the past is shown: what is on the screen is not what the machine does now.
    pub past: bool,
    /// The time of day at which the tick that is shown began, where a record of a run by the clock says it (UTC).
    pub time: Option<String>,
    /// The variables that are forced now, with their values.
    pub forces: Vec<ForcedValue>,
    /// How many faults and messages are on at the tick that is shown (the indicator of PMI 3.1.6), as far as the events
    /// that were taken in say.
    pub announced: usize,
    /// Whether the operator's screen is shown, and nothing else may be done than pressing its keys.
    pub operator: bool,
    /// Whether variables may be set.
    pub may_write: bool,
    /// Whether inputs and outputs may be forced.
    pub may_force: bool,
    /// Whether the program may be replaced, as a changed delay or constant needs it.
    pub may_swap: bool,
    /// Something that the user should know, such as that the record's end is older than the control's
    /// present state.
    pub note: Option<String>,
}
