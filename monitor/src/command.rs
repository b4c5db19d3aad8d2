//! What a user can ask of a [`Session`](crate::Session), and what comes of it.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Something that the user wants done. As JSON it is an object whose `command` is the name in small
/// letters: `{"command":"go_to_tick","tick":812}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "command", rename_all = "snake_case", deny_unknown_fields)]
pub enum Command {
    // Time.
    /// Show the newest whole scan from now on. A program that is run here goes on.
    Follow,
    /// Stay at the tick that is shown. A program that is run here stops there.
    Pause,
    /// Go to a tick, and stay.
    GoToTick {
        /// The tick.
        tick: u64,
    },
    /// Go on or back by so many ticks, and stay.
    MoveTicks {
        /// How many; below 0 means back.
        by: i64,
    },
    /// Go to the next (or previous) scan of the task that the cursor's statement belongs to, and stay.
    MoveScans {
        /// How many; below 0 means back.
        by: i64,
    },
    /// Go back to the statement that changed a variable last, put the cursor there, and stay.
    PreviousChange {
        /// The variable.
        name: String,
    },
    /// Find out why a variable has its value at the end of a tick, stay at that tick, and show the answer on the screen
    /// [`Why`](crate::view::Screen::Why).
    Why {
        /// The variable, or the text of a fault or message.
        name: String,
        /// The tick; that which is shown without it.
        #[serde(default)]
        tick: Option<u64>,
    },
    /// Set the speed of a program that the monitor runs itself.
    SetSpeed {
        /// 1 is real time, 0 is as fast as possible.
        speed: f64,
    },

    // Statements.
    /// Show the whole program (PMI's display then shows no chosen statements any more).
    ShowProgram,
    /// Show no statement (PMI 5.1 `clear`).
    ClearStatements,
    /// Show these statements besides those that are shown, in the program's order (PMI 5.1
    /// `directory`).
    ChooseStatements {
        /// Their rows, as [`DirectoryRow::row`](crate::view::DirectoryRow::row) has them.
        rows: Vec<usize>,
    },
    /// Show a statement with one of these names (PMI 5.1 `name`): the first one that has it as a target,
    /// label or keyword. A label has its colon.
    FindNames {
        /// The names; arrays without brackets.
        names: Vec<String>,
        /// Also statements that use the name in an expression.
        uses: bool,
        /// All such statements (PMI 5.1 `all occr`) rather than the first one.
        all: bool,
    },
    /// Show the next statement with the names that were looked for last (PMI 5.1 `next occr`).
    FindNext,
    /// Show the statement after the last one that is shown (PMI 5.1 `next stmt`).
    NextStatement,
    /// Show the statement before the first one that is shown (PMI 5.1 `prev stmt`).
    PreviousStatement,
    /// Move the cursor by lines.
    MoveCursor {
        /// How many; below 0 means up.
        by: i64,
    },
    /// Put the cursor on a line of the program.
    PutCursor {
        /// The row.
        row: usize,
    },
    /// Put the cursor on the next (or previous) module, label or PLC (NCT 5, F3 and F4).
    Module {
        /// Whether the next one is meant.
        down: bool,
    },
    /// From the beginning of a condition to the Z that closes it, and back (NCT 5, F5 COND); in the
    /// other languages from IF or WHILE to its end.
    Condition,
    /// Put the cursor on the next line with a text (NCT 5, F8 SEAR).
    Search {
        /// The text; small and capital letters are the same.
        text: String,
        /// Whether to search upwards.
        up: bool,
    },
    /// Show or hide the values (NCT 5, F9 VALUE).
    ToggleValues,

    // Variables.
    /// Add variables to the watch list (PMI 5.2 `display`): names, `ARRAY[*]`, `ARRAY[2-5]`, PMAC's
    /// `P1..5`; the control contact of a timer brings the timer's other variables.
    Watch {
        /// The names.
        names: Vec<String>,
    },
    /// Take a row out of the watch list.
    Unwatch {
        /// Its name.
        name: String,
    },
    /// Empty the watch list (PMI 5.2 `clear`).
    ClearWatch,
    /// Choose how the value of a row is written.
    SetFormat {
        /// The row's name.
        name: String,
        /// The format.
        format: Format,
    },
    /// Go over to another watch list of this program; it is made if there is none of this name.
    ChooseList {
        /// Its name.
        list: String,
    },
    /// Remove a watch list.
    RemoveList {
        /// Its name.
        list: String,
    },
    /// Set a variable once, as the operator would. The delay of a PMI timer (`TC#DELAY`) and a constant stand in the
    /// source: the program is built with the new number and takes the place of the one that runs (PMI 5.2 `change`).
    Change {
        /// The variable.
        name: String,
        /// The value, as in a stimulus.
        value: String,
    },
    /// Take the last online change of the control back: the program before it runs again.
    Rollback,

    // Inputs and outputs.
    /// Confirm that the warning of PMI 5.3 was read; before that nothing is forced.
    ConfirmWarning,
    /// Hold an input or output at a value (PMI 5.3 `ovrride`).
    Force {
        /// The variable.
        name: String,
        /// The value.
        value: String,
    },
    /// End the force of a variable (PMI 5.3 `clear`).
    Release {
        /// The variable.
        name: String,
    },
    /// End all forces (PMI 5.3 `clear all`).
    ReleaseAll,

    // The PMAC terminal.
    /// Execute an on-line command of a PMAC; the answer is in the [reply](Reply::text) and in the
    /// view of the terminal. The lines of LIST GATHER come in the view alone, as their ticks are run again.
    Online {
        /// The command; control characters as `^A`.
        line: String,
    },

    // The scope.
    /// Add variables to the scope.
    ScopeAdd {
        /// Their names.
        names: Vec<String>,
    },
    /// Take a variable off the scope.
    ScopeRemove {
        /// Its name.
        name: String,
    },
    /// Show a stretch of time (zoom and scroll).
    ScopeRange {
        /// The first tick.
        from: u64,
        /// The last tick; it is not more than [`MAX_SCOPE_TICKS`](crate::MAX_SCOPE_TICKS) ticks
        /// after the first.
        to: u64,
    },
    /// Show so many ticks up to the newest, or around the trigger.
    ScopeWidth {
        /// How many.
        ticks: u64,
    },
    /// Wait for the trigger in the ticks that come, and show the ticks around it. In a recording it is looked for from the first tick
    /// on; while an earlier tick is shown, from that one on.
    ScopeTrigger {
        /// When it triggers; `None` switches the trigger off.
        trigger: Option<Trigger>,
    },
    /// Look for the trigger again, after the tick in which it was met.
    ScopeNextTrigger,
    /// Put one of the two cursors on a tick.
    ScopeCursor {
        /// Which: 0 or 1.
        cursor: u8,
        /// The tick; `None` takes the cursor away.
        tick: Option<u64>,
    },
    /// Keep what the scope shows (variables, width, trigger) under a name.
    ScopeSave {
        /// The name.
        name: String,
    },
    /// Load what was kept under a name.
    ScopeLoad {
        /// The name.
        name: String,
    },
    /// Give the samples that are shown as the text of a file in [`Reply::text`].
    ScopeExport {
        /// The form.
        format: ExportFormat,
    },
}

/// When the scope triggers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trigger {
    /// A variable or an expression of the program's language; it need not be shown.
    pub expression: String,
    /// Which change of its truth value triggers.
    pub edge: Edge,
    /// How many of the ticks that are shown lie before the trigger.
    pub before: u64,
}

/// A change of a truth value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Edge {
    /// From false to true.
    Rising,
    /// From true to false.
    Falling,
    /// Any change of the value, also of a number.
    Both,
}

/// How a number is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Format {
    /// As the language writes it.
    #[default]
    Decimal,
    /// Hexadecimal.
    Hexadecimal,
    /// Its bits.
    Binary,
}

/// The form of exported samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ExportFormat {
    /// A table: tick, time, and a column for each variable.
    Csv,
    /// A drawing.
    Svg,
}

/// What came of a command that was done.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reply {
    /// What is to be told to the user, in a line.
    pub message: Option<String>,
    /// A longer text: an export, or the answer to an on-line command.
    pub text: Option<String>,
}

impl Reply {
    /// A reply with a line for the user.
    pub fn message(text: impl Into<String>) -> Self {
        Self { message: Some(text.into()), text: None }
    }
}

/// Why a command is not done.
#[derive(Clone, Debug, PartialEq, Eq, Error, Serialize, Deserialize)]
#[error("{message}")]
pub struct Refusal {
    /// Why, for people.
    pub message: String,
    /// A warning that the user must read and confirm by [`Command::ConfirmWarning`] first.
    pub warning: Option<String>,
}

impl Refusal {
    /// A refusal for this reason.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), warning: None }
    }
}

impl From<plcc_replay::DebugError> for Refusal {
    fn from(error: plcc_replay::DebugError) -> Self {
        Self::new(error.0)
    }
}
