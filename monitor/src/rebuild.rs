//! Changing a number of a program's source while a control runs it (PMI 5.2 `change`): the delay of a timer or a constant.
//!
//! Compiled code has such numbers as immediate operands, so a changed number is another program. The monitor has no
//! compiler; whoever opens the session gives it a [`Rebuilder`], which has one.

use std::path::PathBuf;

/// The program that a control runs, as the control itself names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunningProgram {
    /// The fingerprint of its executive, in hexadecimal digits.
    pub fingerprint: String,
    /// How many online changes there were before.
    pub generation: u64,
}

/// A program that was built with one number changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rebuilt {
    /// Its artifact, as an absolute path.
    pub artifact: PathBuf,
    /// The number as the source had it.
    pub old: String,
}

/// Builds the program of a control with one number of its source changed.
pub trait Rebuilder {
    /// Builds `running` once more, with `value` as the number `name`: `TC#DELAY` is the delay of the timer whose control
    /// contact is TC, `C` or `C[3]` a constant or an element of one.
    ///
    /// # Errors
    /// Why that can't be done, for people: the sources of the program are not known, or it has errors with this number.
    fn rebuild(
        &mut self,
        running: &RunningProgram,
        name: &str,
        value: i64,
    ) -> Result<Rebuilt, String>;
}
