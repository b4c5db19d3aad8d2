//! Statements with the values that they read and wrote in one scan (power flow).

pub use plcc_frontend::presentation::Role;
use serde::{Deserialize, Serialize};

/// How a language's manual shows values beside statements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StatementLayout {
    /// True logicals are underlined, numbers stand above their variables (PMI 5.1).
    ValuesAbove,
    /// The values of a line's variables stand at its right (NCT 5; PMAC).
    ValuesRight,
}

/// A part of the program with the values that its statements saw in one scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StatementsView {
    /// How the values are shown.
    pub layout: StatementLayout,
    /// Whether only chosen statements are shown, rather than the whole program.
    pub chosen: bool,
    /// Whether values are shown (NCT 5, F9 VALUE).
    pub values: bool,
    /// How many lines there are in all.
    pub total: usize,
    /// Which of them is the first of `lines`.
    pub first: usize,
    /// Which of them has the cursor, counted as `first` is.
    pub cursor: usize,
    /// The lines.
    pub lines: Vec<StatementLine>,
    /// The source line number of the last statement that is shown (PMI 5.1).
    pub last_number: String,
    /// Which scan of which task is shown: a sentence.
    pub scan: String,
}

/// A line of the program without its comment. A PMI statement that is continued by `#` is one line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StatementLine {
    /// Which line of the program it is, from 0: what
    /// [`Command::PutCursor`](crate::Command::PutCursor) takes.
    pub row: usize,
    /// Its source line number; in an included file of PMI `MMMMM.IIIII` (PMI 4.4).
    pub number: String,
    /// The file.
    pub file: String,
    /// Its text in pieces.
    pub tokens: Vec<Token>,
    /// The comment that stands beside it in the source; empty without one.
    pub comment: String,
    /// The variables that its statements have read and written, in order, with the last value of each.
    pub values: Vec<NamedValue>,
    /// Whether the scan has executed it.
    pub execution: Execution,
    /// How often the scan has executed its first statement.
    pub times: u32,
    /// The tasks that wait in this line.
    pub waits: Vec<String>,
}

impl StatementLine {
    /// The text alone.
    pub fn text(&self) -> String {
        self.tokens.iter().map(|token| token.text.as_str()).collect()
    }
}

/// Whether a scan has executed a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Execution {
    /// It holds no statement: a label, the end of a condition.
    NoStatement,
    /// It was executed.
    Executed,
    /// It was not; it is shown dimmed.
    NotExecuted,
}

/// A piece of a line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Token {
    /// Its text.
    pub text: String,
    /// What it is.
    pub role: Role,
    /// Of a logical variable whether it is true; of `/` with a logical variable, which is one token,
    /// whether that is true. A true one is underlined.
    pub truth: Option<bool>,
    /// The value of a numeric variable when the statement read or wrote it.
    pub value: Option<String>,
    /// The variable, where the token is one; it may be written otherwise in the program.
    pub name: Option<String>,
}

/// A variable with a value.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NamedValue {
    /// The variable.
    pub name: String,
    /// The value.
    pub value: String,
    /// Whether it was written rather than read.
    pub written: bool,
}

/// All statements (PMI 5.1 `directory`).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DirectoryView {
    /// The statements in the program's order.
    pub rows: Vec<DirectoryRow>,
}

/// A line of the directory.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DirectoryRow {
    /// Which line of the program it is.
    pub row: usize,
    /// Its source line number.
    pub number: String,
    /// The name of its target, its label, or its keyword.
    pub name: String,
    /// Whether the statement is shown.
    pub chosen: bool,
}

/// Where something occurs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReferencesView {
    /// What was looked for.
    pub name: String,
    /// What the variable means to the control, where it has a meaning.
    pub meaning: Option<String>,
    /// The lines in which it gets a value.
    pub written: Vec<DirectoryRow>,
    /// The lines in which its value is used.
    pub read: Vec<DirectoryRow>,
    /// The lines in which a condition looks at it.
    pub tested: Vec<DirectoryRow>,
    /// Other lines whose text has it: labels, jumps and statements.
    pub others: Vec<DirectoryRow>,
}
