//! Says why a variable of a PLC program has its value: which statement gave it, which operands hold it, down to inputs, timers
//! and values of earlier scans, since when, what changed it, and which inputs would switch it.
//!
//! It asks a run that can be run again ([`History`]): the statement interpreter shows what each statement of a scan read and
//! wrote, and executes single statements again with operands turned. So what holds a value is found by trying, in
//! every language alike. The main types:
//!
//! - [`Question`] and [`explain`]: what is asked, and the answer to it.
//! - [`Explanation`]: the answer, as text for people ([`Display`](std::fmt::Display)) and as JSON (serde).
//!
//! ```
//! use plcc_replay::{DebugError, DebuggedProgram, History};
//! use plcc_why::{Question, explain};
//!
//! # fn example(program: &DebuggedProgram, history: &mut dyn History) -> Result<(), DebugError> {
//! let explanation = explain(program, history, &Question::new("SPCW", 300))?;
//! print!("{explanation}");
//! # Ok(())
//! # }
//! ```

mod changes;
mod describe;
mod explanation;
mod graph;
mod holding;
mod inquiry;
mod operands;
mod reasons;
mod round;
mod texts;
mod tree;
mod trial;
mod variable;
mod would;

use plcc_replay::{DebugError, DebuggedProgram, History};

pub use describe::{Line, Piece, PieceKind};
pub use explanation::{Announcing, Cause, ChangedBy, Explanation, ForPeople, Number, Said, Wish};
use inquiry::Inquiry;

/// What is asked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Question {
    /// The variable: a single one, or an element of an array. Or the text of a fault or message, or one that a statement puts
    /// out, or a part of it; in quotes it is nothing but a text, all of it. Or the place of a statement that puts out a text, as
    /// `FILE:LINE`.
    pub name: String,
    /// The tick.
    pub tick: u64,
    /// Before which step of the tick, as a debugger counts them; `None` is the end of the tick.
    pub step: Option<usize>,
    /// Whether inputs are looked for that would switch it.
    pub would: bool,
    /// Whether the answer for a text that was put out before the tick is about the last tick in which it was. Otherwise it says
    /// why the text is not put out in the tick itself.
    pub looks_back: bool,
}

impl Question {
    /// Why a variable has the value that it has at the end of a tick, and what would switch it; or why a text was put out last.
    pub fn new(name: impl Into<String>, tick: u64) -> Self {
        Self { name: name.into(), tick, step: None, would: true, looks_back: true }
    }
}

/// Explains the value of a variable. The history may be in any state; afterwards its executive is in that after some tick.
///
/// # Errors
/// When nothing has the name, or it is a whole array, or the tick can't be run.
pub fn explain(
    program: &DebuggedProgram,
    history: &mut dyn History,
    question: &Question,
) -> Result<Explanation, DebugError> {
    Inquiry::new(program, history, question)?.explain(question)
}
