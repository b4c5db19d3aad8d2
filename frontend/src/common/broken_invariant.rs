//! A defect of the compiler that it has noticed itself.
//!
//! Analysis promises much to lowering: every label is defined, every variable has a place,
//! every region is in the layout. Where such a promise is broken the compiler has a mistake. To go
//! on with a default would make code that looks sound and does something else, so lowering returns
//! a [`BrokenInvariant`], never a guess.

use std::fmt;

/// Why a checked program could not be translated although it has no errors. This is always a
/// mistake in the compiler: the command line ends with exit status 4 and asks for a report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BrokenInvariant {
    /// What was found, for the developer who looks for the mistake.
    pub message: String,
    /// The statement that was being translated: its file and its line, from 1.
    pub place: Option<(String, u32)>,
}

impl BrokenInvariant {
    /// A defect that no statement can be named for.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), place: None }
    }

    /// A defect in the translation of the statement in `line` of `file`.
    pub fn at(message: impl Into<String>, file: impl Into<String>, line: u32) -> Self {
        Self { message: message.into(), place: Some((file.into(), line)) }
    }

    /// A defect: something that must be there is not. `what` names it: `the place of :012`.
    pub fn missing(what: impl fmt::Display) -> Self {
        Self::new(format!("{what} is missing"))
    }

    /// The same error with the statement in `line` of `file` as its place, unless it has a place
    /// already.
    #[must_use]
    pub fn or_at(mut self, file: impl Into<String>, line: u32) -> Self {
        self.place.get_or_insert_with(|| (file.into(), line));
        self
    }
}

impl fmt::Display for BrokenInvariant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            Some((file, line)) => write!(f, "{} (at {file}:{line})", self.message),
            None => f.write_str(&self.message),
        }
    }
}

impl std::error::Error for BrokenInvariant {}

/// Turns an absent value into a [`BrokenInvariant`].
pub trait OrMissing<T> {
    /// The value.
    ///
    /// # Errors
    /// [`BrokenInvariant::missing`] if there is no value; `what` names it.
    fn or_missing<S: fmt::Display>(self, what: impl FnOnce() -> S) -> Result<T, BrokenInvariant>;
}

impl<T> OrMissing<T> for Option<T> {
    fn or_missing<S: fmt::Display>(self, what: impl FnOnce() -> S) -> Result<T, BrokenInvariant> {
        self.ok_or_else(|| BrokenInvariant::missing(what()))
    }
}
