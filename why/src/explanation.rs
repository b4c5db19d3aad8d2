//! The answer: why a variable has its value. Its JSON is what `plcc why --message-format json` prints.

use plcc_abi::GivenName;
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
    Force {
        /// Who, and since when, where the control tells that.
        #[serde(skip_serializing_if = "Option::is_none")]
        by: Option<String>,
    },
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
    /// Nothing that is known: the control tells its present values alone.
    Unknown,
}

/// What people call a variable and say of it; what nobody has said is left out.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Said {
    /// Another name for it.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub alias: String,
    /// What it is.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub text: String,
    /// The device that is wired to it.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub device: String,
    /// The terminal.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub at: String,
    /// Where in the drawings it is.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub drawing: String,
    /// All of it in one line.
    #[serde(skip)]
    pub line: String,
}

impl From<&GivenName> for Said {
    fn from(given: &GivenName) -> Self {
        let line = given.line();
        let GivenName { name: _, alias, text, device, at, drawing } = given.clone();
        Self { alias, text, device, at, drawing, line }
    }
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
    /// What people say of it.
    #[serde(flatten)]
    pub said: Said,
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
    /// Another name for it; empty without one.
    #[serde(skip)]
    pub alias: String,
    /// Its value.
    pub value: Number,
}

/// Why a variable has its value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Explanation {
    /// Its name in canonical spelling; of a text the statement that puts it out.
    pub name: String,
    /// Its value; of a text 1 if the last scan has executed the statement, otherwise 0.
    pub value: Number,
    /// The tick at which it has it.
    pub tick: u64,
    /// The tick in which it got that value; of a text that in which the statement was executed last.
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
    /// What people say of it.
    #[serde(flatten)]
    pub said: Said,
    /// What people read and JSON leaves out.
    #[serde(skip)]
    pub for_people: ForPeople,
}

/// What a variable announces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Announcing {
    /// A fault.
    Fault,
    /// A message.
    Message,
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
    /// Whether it is a statement that puts out a text, and its value says whether that was executed.
    pub is_of_text: bool,
    /// Whether inputs were looked for that would switch it.
    pub was_tried: bool,
    /// The tasks that would give it another value and don't run.
    pub idle: Vec<String>,
    /// The length of a tick in nanoseconds.
    pub tick_ns: u64,
    /// Whether it is the answer for a control of which the present alone is known.
    pub is_of_present: bool,
    /// Of the variable of a fault or message, which of these it is, and the text.
    pub announces: Option<(Announcing, String)>,
    /// The last tick of the run in which it was not explained by anything else.
    pub stopped: Option<String>,
}

impl Explanation {
    /// Calls `change` for what changed the variable and all that hold it, each with the variable's name and the tick since
    /// when it has its value.
    fn each_change(&mut self, change: &mut dyn FnMut(&str, &mut u64, &mut ChangedBy)) {
        fn below(causes: &mut [Cause], change: &mut dyn FnMut(&str, &mut u64, &mut ChangedBy)) {
            for cause in causes {
                change(&cause.name, &mut cause.since, &mut cause.changed_by);
                below(&mut cause.because, change);
            }
        }
        change(&self.name, &mut self.since, &mut self.changed_by);
        below(&mut self.because, change);
    }

    /// Notes who forces variables and since which tick, as `holder` tells it of a name.
    pub fn note_forces(&mut self, holder: &dyn Fn(&str) -> Option<(String, u64)>) {
        let is_of_present = self.for_people.is_of_present;
        self.each_change(&mut |name, since, changed_by| {
            let ChangedBy::Force { by } = changed_by else { return };
            let Some((who, tick)) = holder(name) else { return };
            *by = Some(who);
            if is_of_present {
                *since = tick;
            }
        });
    }

    /// Makes it the answer for the present of a control of which only the values are known, after a number of
    /// ticks: since when these are what they are is not known.
    pub fn of_present(mut self, ticks: u64) -> Self {
        self.tick = ticks;
        self.for_people.is_of_present = true;
        self.each_change(&mut |_, since, changed_by| {
            *since = ticks;
            if !matches!(changed_by, ChangedBy::Force { .. }) {
                *changed_by = ChangedBy::Unknown;
            }
        });
        self
    }
}
