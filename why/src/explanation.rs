//! The answer: why a variable has its value. Its JSON is what `plcc why --message-format json` prints.

use serde::{Serialize, Serializer};

/// A value of a variable; a logical is 0 or 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Number(pub f64);

impl Serialize for Number {
    /// Integers have no fraction.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(number) = *self;
        if number.fract() == 0.0 && number.abs() < 9e15 {
            return serializer.serialize_i64(number as i64);
        }
        serializer.serialize_f64(number)
    }
}

impl std::fmt::Display for Number {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&plcc_runtime::value::number(self.0))
    }
}

/// What changed a variable.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum ChangedBy {
    /// The machine: the line of an input has changed.
    Input,
    /// A statement of the program.
    Statement {
        /// Its file.
        file: String,
        /// The line in which it begins, from 1.
        line: u32,
    },
    /// A row of the stimulus.
    Stimulus,
    /// Somebody holds it at its value.
    Force,
    /// Somebody has set it.
    Write,
    /// Time: a timer counts, or has run out.
    Timer,
    /// The control itself, around the program.
    Control,
    /// Nothing: it has the value since power-up.
    PowerUp,
    /// Nothing that is known: it had the value when the record begins.
    BeforeRecord,
}

/// A variable that holds the value of another one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cause {
    /// Its name.
    pub name: String,
    /// The value that was read.
    pub value: Number,
    /// The tick in which it got that value.
    pub since: u64,
    /// The file of the statement that has written it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// The line of that statement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<u32>,
    /// What holds it in turn. Empty for inputs, timers and values of earlier scans.
    pub because: Vec<Cause>,
    /// What changed it then.
    pub changed_by: ChangedBy,
    /// The text of the statement.
    #[serde(skip)]
    pub statement: String,
    /// What the value is for people, beside the number; empty if nothing.
    #[serde(skip)]
    pub remark: String,
}

/// A variable and the value that would help to switch another one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Wish {
    /// The input.
    pub name: String,
    /// Its value.
    pub value: Number,
}

/// Why a variable has its value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Explanation {
    /// Its name in canonical spelling.
    pub name: String,
    /// Its value.
    pub value: Number,
    /// The tick at which it has it.
    pub tick: u64,
    /// The tick in which it got that value.
    pub since: u64,
    /// The file of the statement that has written it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// The line of that statement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<u32>,
    /// What holds it.
    pub because: Vec<Cause>,
    /// What changed it then.
    pub changed_by: ChangedBy,
    /// The smallest sets of inputs with which the next scan would give it the other value. A set without inputs means that
    /// the next scan does so by itself.
    pub would: Vec<Vec<Wish>>,
    /// What people read and JSON leaves out.
    #[serde(skip)]
    pub for_people: ForPeople,
}

/// What only people are told.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ForPeople {
    /// The text of the statement.
    pub statement: String,
    /// What the value is, beside the number; empty if nothing.
    pub remark: String,
    /// Whether its values are 0 and 1 alone.
    pub is_logical: bool,
    /// Whether inputs were looked for that would switch it.
    pub was_tried: bool,
    /// The tasks that would give it another value and don't run.
    pub idle: Vec<String>,
    /// The length of a tick in nanoseconds.
    pub tick_ns: u64,
    /// The last tick of the run in which it was not explained by anything else.
    pub stopped: Option<String>,
}
