//! A defect of the compiler that it has noticed itself.

use std::fmt;

/// Why a checked program could not be translated although it has no errors. This is always a
/// mistake in the compiler: the command line ends with exit status 4 and asks for a report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InternalError {
    /// What was found, for those who look for the mistake.
    pub message: String,
    /// The statement that was being translated: its file and its line, from 1.
    pub place: Option<(String, u32)>,
}

impl InternalError {
    /// A defect that no statement can be named for.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), place: None }
    }

    /// A defect in the translation of the statement in `line` of `file`.
    pub fn at(message: impl Into<String>, file: impl Into<String>, line: u32) -> Self {
        Self { message: message.into(), place: Some((file.into(), line)) }
    }
}

impl fmt::Display for InternalError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            Some((file, line)) => write!(f, "{} (at {file}:{line})", self.message),
            None => f.write_str(&self.message),
        }
    }
}

impl std::error::Error for InternalError {}
