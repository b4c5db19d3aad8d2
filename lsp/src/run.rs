//! The values of a run beside the names of its program: of a control that runs, or of a record at a tick.
//!
//! The protocol has no request for this, so the server has four of its own (docs/editors.md): `plcc/showValues`,
//! `plcc/hideValues`, `plcc/why` and `plcc/change`. The values are inlay hints, which each editor shows.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use gen_lsp_types::TextDocumentIdentifier;
use serde::{Deserialize, Serialize};

/// A variable's value in a run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Value {
    /// The value, as people read it.
    pub text: String,
    /// The value at which somebody holds its lines, whatever the program gives.
    pub forced: Option<String>,
    /// What else is to be known of it: why its lines do not have this value.
    pub note: Option<String>,
}

impl Value {
    /// What stands beside the name.
    pub(crate) fn label(&self) -> String {
        match &self.forced {
            Some(forced) => format!("= {} (forced {forced})", self.text),
            None => format!("= {}", self.text),
        }
    }
}

/// A run that can be looked at.
pub trait Run {
    /// The first and the last tick whose values can be had. Of a control that runs both are the present one.
    ///
    /// # Errors
    /// Why they can't be had.
    fn ticks(&mut self) -> Result<(u64, u64), String>;

    /// The values that variables have at the end of a tick, as people read them; of a control that runs the present ones. Names that
    /// have no single value are left out.
    ///
    /// # Errors
    /// Why they can't be had.
    fn values(&mut self, tick: u64, names: &[String]) -> Result<BTreeMap<String, Value>, String>;

    /// Sets a variable of a control that runs once, or with `force` holds it at the value; `None` ends that. Returns the tick before
    /// which it is done.
    ///
    /// # Errors
    /// Why it is refused; what is recorded can't be changed.
    fn change(&mut self, name: &str, value: Option<&str>, force: bool) -> Result<u64, String>;

    /// Why a variable has its value at the end of a tick, as text of several lines; of a control that runs why it has its present
    /// one.
    ///
    /// # Errors
    /// Why that can't be said.
    fn why(&mut self, tick: u64, name: &str) -> Result<String, String>;
}

/// The run whose values are shown.
pub(crate) struct ShownRun {
    /// A file of the program that runs.
    of: PathBuf,
    /// Where the run is: a control's socket, or a record.
    path: PathBuf,
    run: Box<dyn Run>,
    /// The tick that was asked for; the last one without.
    tick: Option<u64>,
}

/// The parameters of `plcc/showValues`.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct ShowValues {
    /// A file of the program.
    pub(crate) text_document: TextDocumentIdentifier,
    /// The path of the control's socket, or of the record; a relative one begins in the folder of the file.
    pub(crate) run: String,
    /// The tick of a record; the last one without.
    pub(crate) tick: Option<u64>,
}

/// What `plcc/showValues` answers.
#[derive(Debug, Serialize)]
pub(crate) struct Shown {
    /// The tick whose values are shown.
    tick: u64,
    /// The first and the last tick that can be shown.
    first: u64,
    last: u64,
}

/// The parameters of `plcc/why`.
#[derive(Debug, Deserialize)]
pub(crate) struct Why {
    pub(crate) name: String,
}

/// The parameters of `plcc/change`.
#[derive(Debug, Deserialize)]
pub(crate) struct Change {
    pub(crate) name: String,
    /// The value; none takes a force off.
    pub(crate) value: Option<String>,
    #[serde(default)]
    pub(crate) force: bool,
}

impl ShownRun {
    pub(crate) fn new(of: PathBuf, path: PathBuf, run: Box<dyn Run>) -> Self {
        Self { of, path, run, tick: None }
    }

    /// Whether it is this run of this file's program.
    pub(crate) fn is(&self, of: &Path, path: &Path) -> bool {
        self.of == of && self.path == path
    }

    /// A file of its program.
    pub(crate) fn file(&self) -> &Path {
        &self.of
    }

    /// Goes to a tick, or to the last one.
    pub(crate) fn go_to(&mut self, tick: Option<u64>) -> Result<Shown, String> {
        let (first, last) = self.run.ticks()?;
        if let Some(tick) = tick.filter(|tick| !(first..=last).contains(tick)) {
            return Err(format!("tick {tick} can't be shown: {first} to {last} can"));
        }
        // Values are read, so that what hinders that is told where it was asked for.
        self.run.values(tick.unwrap_or(last), &[])?;
        self.tick = tick;
        Ok(Shown { tick: tick.unwrap_or(last), first, last })
    }

    /// The values of variables in the tick that is shown, and the tick; none where they can't be had any more.
    pub(crate) fn values(&mut self, names: &[String]) -> (u64, BTreeMap<String, Value>) {
        let tick = self.tick.or_else(|| Some(self.run.ticks().ok()?.1)).unwrap_or(0);
        (tick, self.run.values(tick, names).unwrap_or_default())
    }

    /// Why a variable has its value in the tick that is shown.
    pub(crate) fn why(&mut self, name: &str) -> Result<String, String> {
        let tick = match self.tick {
            Some(tick) => tick,
            None => self.run.ticks()?.1,
        };
        self.run.why(tick, name)
    }

    pub(crate) fn change(&mut self, change: &Change) -> Result<u64, String> {
        self.run.change(&change.name, change.value.as_deref(), change.force)
    }
}
