//! The engine that counts: the statement interpreter with an observer.

use std::fmt;

use plcc_abi::{Engine, Outcome, ResumePoint, Scan};
use plcc_frontend::CheckedProgram;
use plcc_frontend::common::{Accessed, Observer, StatementInterpreter, Value};

use super::{Counts, Map};

/// Runs a program and counts what is covered.
pub struct ObservedEngine<'m> {
    interpreter: Box<dyn StatementInterpreter>,
    map: &'m Map,
    counts: Counts,
}

impl fmt::Debug for ObservedEngine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ObservedEngine").field("counts", &self.counts).finish_non_exhaustive()
    }
}

impl<'m> ObservedEngine<'m> {
    /// An engine of the program that the map is of.
    pub fn new(checked: &dyn CheckedProgram, map: &'m Map) -> Self {
        Self { interpreter: checked.statement_interpreter(), map, counts: Counts::new(map) }
    }

    /// What was counted since the last call of this.
    pub fn take(&mut self) -> Counts {
        std::mem::replace(&mut self.counts, Counts::new(self.map))
    }
}

impl Engine for ObservedEngine<'_> {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        let mut observer = Counter { map: self.map, counts: &mut self.counts };
        self.interpreter.call_observed(task, from, scan, &mut observer)
    }
}

/// Counts statements and contacts.
struct Counter<'c> {
    map: &'c Map,
    counts: &'c mut Counts,
}

impl Observer for Counter<'_> {
    fn statement(&mut self, statement: u32, image: &[u8]) {
        self.counts.see(self.map, statement as usize, image);
    }

    fn read(&mut self, _: Accessed, _: Value) {}

    fn write(&mut self, _: Accessed, _: Value) {}
}
