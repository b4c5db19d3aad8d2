//! Why a variable has its value.

use serde::{Deserialize, Serialize};

/// The answer to the last question.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct WhyView {
    /// The variable that was asked for.
    pub name: String,
    /// The tick at whose end it has its value; `None` for the present of a control of which nothing else is known.
    pub tick: Option<u64>,
    /// The answer.
    pub lines: Vec<WhyLine>,
}

/// A line of an answer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct WhyLine {
    /// Its text in pieces.
    pub pieces: Vec<WhyPiece>,
    /// The variable of the line, which can be asked for next.
    pub name: Option<String>,
    /// The tick at which that is asked.
    pub tick: Option<u64>,
}

impl WhyLine {
    /// The text alone.
    pub fn text(&self) -> String {
        self.pieces.iter().map(|piece| piece.text.as_str()).collect()
    }
}

/// A piece of a line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct WhyPiece {
    /// Its text.
    pub text: String,
    /// What it is: `plain`, `name`, `value`, `forced`, `place`, `wish`.
    pub kind: String,
}
