//! What is wrong with a configuration, and what may be wrong.

use std::fmt;
use std::path::Path;

/// Something that is wrong with a configuration.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mistake {
    /// The line, from 1.
    pub line: usize,
    /// What is wrong, as a sentence without a full stop.
    pub message: String,
}

/// Something that may be wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The line of the entry, from 1, where it is about one.
    pub line: Option<usize>,
    /// What may be wrong, as a sentence without a full stop.
    pub message: String,
}

/// The mistakes of the configuration file at a path, as a message for people.
#[derive(Debug)]
pub struct Mistakes<'a>(
    /// The file.
    pub &'a Path,
    /// What is wrong in it.
    pub &'a [Mistake],
);

impl fmt::Display for Mistakes<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, Mistake { line, message }) in self.1.iter().enumerate() {
            let prefix = if index > 0 { "\nerror: " } else { "" };
            write!(f, "{prefix}{}:{line}: {message}", self.0.display())?;
        }
        Ok(())
    }
}

impl Warning {
    /// The warning about the configuration file at a path, as a message for people.
    pub fn of(&self, path: &Path) -> String {
        let (file, message) = (path.display(), &self.message);
        match self.line {
            Some(line) => format!("{file}:{line}: {message}"),
            None => format!("{file}: {message}"),
        }
    }
}
