//! An engine that times the calls of another one.

use std::hint::black_box;
use std::time::Instant;

use plcc_abi::{Engine, Outcome, ResumePoint, Scan};

use super::figures::Samples;

/// Times each call of an engine, less what looking at the clock takes.
pub(super) struct Timed {
    engine: Box<dyn Engine>,
    tasks: Vec<Samples>,
    /// The nanoseconds that measuring takes by itself: reading the clock twice.
    clock: u64,
    /// Nanoseconds in the engine since [`begin`](Self::begin).
    scan: u64,
    /// Calls since then.
    calls: u64,
}

impl Timed {
    pub(super) fn new(engine: Box<dyn Engine>, tasks: usize) -> Self {
        let tasks = vec![Samples::default(); tasks];
        Self { engine, tasks, clock: clock(), scan: 0, calls: 0 }
    }

    /// A tick begins.
    pub(super) fn begin(&mut self) {
        (self.scan, self.calls) = (0, 0);
    }

    /// The tick is over. Gives the nanoseconds that it spent in the engine, and the nanoseconds that
    /// measuring took.
    pub(super) fn finish(&self) -> (u64, u64) {
        (self.scan, self.clock * (self.calls + 1))
    }

    pub(super) fn samples(&self, task: usize) -> Option<&Samples> {
        self.tasks.get(task)
    }
}

/// The least time between two looks at the clock, in nanoseconds.
fn clock() -> u64 {
    (0..10_000).map(|_| black_box(Instant::now()).elapsed().as_nanos() as u64).min().unwrap_or(0)
}

impl Engine for Timed {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        let start = Instant::now();
        let outcome = self.engine.call(task, from, scan);
        let ns = (start.elapsed().as_nanos() as u64).saturating_sub(self.clock);
        self.scan += ns;
        self.calls += 1;
        if let Some(samples) = self.tasks.get_mut(task) {
            samples.push(ns);
        }
        outcome
    }
}
