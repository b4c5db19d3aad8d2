//! The terminal of a control that takes commands in a line of text.

use std::collections::BTreeMap;
use std::fmt;
use std::time::Instant;

use super::Row;

/// What a command answers; an error is shown in the same way.
pub type Answer = Result<String, String>;

/// A terminal: it takes commands, and keeps what later commands refer to.
pub trait Terminal: fmt::Debug + Send {
    /// Carries out a command.
    ///
    /// # Errors
    /// Why it can't be carried out, in the words of the control where it has some.
    fn answer(&mut self, line: &str, desk: &mut dyn Desk) -> Answer;

    /// Further lines of a long answer to an earlier command, until a moment, but at least one of them. `None` if there
    /// are none to come.
    fn further_lines(&mut self, until: Instant, desk: &mut dyn Desk) -> Option<Vec<String>>;
}

/// What a terminal's commands can do: with the control, and with the display that the terminal is part of.
pub trait Desk {
    /// The values of variables at the moment that is shown. A name that has no value is left out.
    ///
    /// # Errors
    /// When nothing can be read.
    fn read(&mut self, names: &[String]) -> Result<BTreeMap<String, f64>, String>;

    /// Sets a variable as the operator does; gives what is to be said of it.
    ///
    /// # Errors
    /// When it can't be set, or setting is not allowed.
    fn set(&mut self, name: &str, value: &str) -> Answer;

    /// Why a name has no value.
    fn unknown(&mut self, name: &str) -> String;

    /// The variable for which the program defines a name.
    fn defined_name(&self, name: &str) -> Option<String>;

    /// The process image of the run, and whether there is one.
    ///
    /// # Errors
    /// When there is no run.
    fn image(&mut self) -> Result<Vec<u8>, String>;

    /// The names of the program's tasks.
    ///
    /// # Errors
    /// When there is no program.
    fn tasks(&mut self) -> Result<Vec<String>, String>;

    /// The text of the program.
    fn rows(&self) -> &[Row];

    /// The number of the tick that comes after the newest one.
    fn next_tick(&self) -> u64;

    /// The values of variables after a tick of the past, which is run again; not a number for what has none.
    ///
    /// # Errors
    /// When the tick can't be run.
    fn values_after(&mut self, tick: u64, names: &[String]) -> Result<Vec<f64>, String>;

    /// Shows variables on the scope, from a tick to another.
    ///
    /// # Errors
    /// When the scope can't show them.
    fn show_on_scope(&mut self, names: &[String], from: u64, to: u64) -> Result<(), String>;
}
