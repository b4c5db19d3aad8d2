//! The interface between a run and a control: [`Executive`], its variables, and why it stops.

use plcc_abi::{Engine, TrapCode};
use thiserror::Error;

use crate::{CheckpointError, Event, Value};

/// A variable that an executive has found by its name; valid for that executive alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Variable(pub u32);

/// What a variable is looked up for, which decides what variables are allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// To be read: any variable, also a whole array.
    Watch,
    /// To be set by the stimulus: any single variable, also one that the program can only read.
    Stimulus,
}

/// A value for [`Executive::set`], already checked to fit its variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Setting {
    /// An integer.
    Int(i64),
    /// A double.
    Float(f64),
}

/// Why a name can't be watched or set.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum NameError {
    /// Nothing has this name.
    #[error("the program has no variable named `{name}`{}", did_you_mean(.suggestion))]
    Unknown {
        /// The name as written.
        name: String,
        /// A variable that exists and has a similar name.
        suggestion: Option<String>,
    },
    /// Something has this name, but can't be used for the purpose.
    #[error("`{name}` {reason}")]
    Unfit {
        /// The name as written.
        name: String,
        /// Why not.
        reason: String,
    },
}

fn did_you_mean(suggestion: &Option<String>) -> String {
    suggestion.as_ref().map_or_else(String::new, |name| format!("; did you mean `{name}`?"))
}

/// Why a value does not fit a variable.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{value}` {reason}")]
pub struct ValueError {
    /// The value as written.
    pub value: String,
    /// Why not.
    pub reason: String,
}

/// Why a control stopped its program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stop {
    /// The control's own code: `NO PMI DATA`, `PLC TIMEOUT1`, `CALL DEPTH`, `WATCHDOG`; or
    /// `INTERNAL ERROR` for an error in plcc.
    pub code: String,
    /// What happened, for people; the same in every engine.
    pub message: String,
}

impl Stop {
    /// The stop after a trap that no program of the control's language can cause, the same for
    /// every control. The outputs are not written from the scan in which it happened.
    pub(crate) fn internal_error(code: TrapCode) -> Self {
        let what = match code {
            TrapCode::HostPanic => {
                "a function of the control failed while the program called it".to_owned()
            }
            _ => format!("a scan ended as none of this language can end (`{}`)", code.name()),
        };
        Self {
            code: "INTERNAL ERROR".into(),
            message: format!(
                "{what} (an error in plcc; please report it with the program); the outputs were \
                 not written from this scan, and the control does not scan again"
            ),
        }
    }
}

/// What a control does around its program: it latches inputs, counts timers, calls tasks, drives
/// outputs and reports events. An executive holds the process image and all other state of the control.
/// The engine that executes the program is given to each tick, and can be any engine of the program.
pub trait Executive {
    /// The length of a base tick in nanoseconds of simulated time.
    fn tick_ns(&self) -> u64;

    /// Does one base tick, after the stimulus of that tick has been applied. Its events are appended to
    /// `events`, each with the tick's number, which the executive counts from 0.
    ///
    /// # Errors
    /// When the control stops the program. This was its last tick then; the caller adds the event
    /// `stop`.
    fn tick(&mut self, engine: &mut dyn Engine, events: &mut Vec<Event>) -> Result<(), Stop>;

    /// Finds a variable by its name in the dialect's spelling.
    ///
    /// # Errors
    /// When nothing has that name, or it can't be used for the purpose.
    fn find(&mut self, name: &str, purpose: Purpose) -> Result<Variable, NameError>;

    /// Reads the text of a value for a variable.
    ///
    /// # Errors
    /// When the text is no number, or the variable can't take it.
    fn parse(&self, variable: Variable, text: &str) -> Result<Setting, ValueError>;

    /// Sets a variable as the machine or the operator would.
    fn set(&mut self, variable: Variable, value: Setting);

    /// Reads a variable.
    fn get(&self, variable: Variable) -> Value;

    /// Whether a variable holds 0 or 1 only, so that a waveform viewer shows it as a line.
    fn is_logical(&self, _variable: Variable) -> bool {
        false
    }

    /// The variables that the program declares or names, in natural order of their canonical
    /// spelling.
    fn declared(&mut self) -> Vec<(String, Variable)>;

    /// The canonical spelling of a watched name, as a dump has it.
    fn canonical(&self, variable: Variable) -> String;

    /// The data that survives power-off, to be put into a file; `None` where there is nothing to keep.
    fn retained(&self) -> Option<Vec<u8>>;

    /// Takes back what [`retained`](Self::retained) gave, before the first tick.
    ///
    /// # Errors
    /// When it belongs to another program or has another form; nothing is changed then.
    fn restore(&mut self, retained: &[u8]) -> Result<(), String>;

    /// The process image.
    fn image(&self) -> &[u8];

    /// The whole state between two ticks, as bytes: the image and the state outside it. Events are not
    /// part of it, since they do not outlive a tick; neither are watchdogs of real time.
    fn checkpoint(&self) -> Vec<u8>;

    /// Takes the state of a [`checkpoint`](Self::checkpoint) of the same program. Ticks go on from
    /// there, in whichever engine has run this executive's ticks so far, or in any engine of the
    /// program where there were none. The options of the run stay this executive's own.
    ///
    /// # Errors
    /// When the bytes are no checkpoint, are damaged, or belong to another program or version;
    /// nothing is changed then.
    fn resume(&mut self, checkpoint: &[u8]) -> Result<(), CheckpointError>;
}
