//! The engine that runs a tick for the debugger: the statement interpreter with an observer, who is
//! also told where each call of a task begins and ends.

use plcc_abi::{Engine, Outcome, ResumePoint, Scan};
use plcc_frontend::common::{Observer, StatementInterpreter};

/// An observer of whole ticks.
pub trait TickObserver: Observer {
    /// A scan of a task begins: its number. What has changed in the image since the last call was
    /// changed by the executive.
    fn call_begins(&mut self, task: usize, image: &[u8]);

    /// The scan has ended.
    fn call_ends(&mut self, image: &[u8]);
}

/// A statement interpreter with an observer, as an engine.
pub struct Observed<'a> {
    interpreter: &'a mut dyn StatementInterpreter,
    observer: &'a mut dyn TickObserver,
}

impl std::fmt::Debug for Observed<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Observed")
    }
}

impl<'a> Observed<'a> {
    /// Runs scans in `interpreter` and tells `observer` of them.
    pub fn new(
        interpreter: &'a mut dyn StatementInterpreter,
        observer: &'a mut dyn TickObserver,
    ) -> Self {
        Self { interpreter, observer }
    }
}

impl Engine for Observed<'_> {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        self.observer.call_begins(task, scan.image);
        let observer: &mut dyn Observer = self.observer;
        let outcome = self.interpreter.call_observed(task, from, scan, observer);
        self.observer.call_ends(scan.image);
        outcome
    }
}
