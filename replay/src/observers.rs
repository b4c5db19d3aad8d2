//! The engine that runs a tick for the debugger: the statement interpreter with an observer, who is
//! also told where each call of a task begins and ends.

use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};

use plcc_abi::{Engine, Host, HostFn, Outcome, ResumePoint, Scan, TimeLimit};
use plcc_frontend::common::{Accessed, Observer, StatementInterpreter, Value};

/// An observer of whole ticks.
pub trait TickObserver: Observer {
    /// A call of a task begins: its number, and whether it goes on with a scan that was suspended. What
    /// has changed in the image since the last call was changed by the executive.
    fn call_begins(&mut self, task: usize, resumed: bool, image: &[u8]);

    /// The statement that ran last has sent a text: PMAC's SEND, DISPLAY or COMMAND.
    fn text_sent(&mut self) {}

    /// The call has ended; `suspended` says whether the task goes on there at its next call.
    fn call_ends(&mut self, suspended: bool, image: &[u8]);
}

/// A statement interpreter with an observer, as an engine.
pub struct Observed<'a> {
    interpreter: &'a mut dyn StatementInterpreter,
    observer: &'a mut dyn TickObserver,
    cut: Option<Cut>,
}

/// Where a scan is stopped, as the watchdog stopped it.
struct Cut {
    /// The statements of the line. The first one that is executed is the last.
    statements: Vec<u32>,
    /// The scan is late when this is 1.
    epoch: AtomicU64,
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
        Self { interpreter, observer, cut: None }
    }

    /// Stops the scan that comes to one of these statements first, as the watchdog does; without statements no scan is
    /// stopped.
    pub fn cut_at(mut self, statements: Vec<u32>) -> Self {
        self.cut = (!statements.is_empty()).then(|| Cut { statements, epoch: AtomicU64::new(0) });
        self
    }
}

impl Engine for Observed<'_> {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        self.observer.call_begins(task, from.is_some(), scan.image);
        let sent = Cell::new(0);
        let cut = self.cut.as_ref();
        let mut observer = WithTexts { observer: &mut *self.observer, sent: &sent, told: 0, cut };
        let mut host = CountingHost { host: &mut *scan.host, sent: &sent, cut };
        // Where a scan is to be stopped, its time is up when the epoch is set.
        let limit = cut.map_or(scan.limit, |cut| TimeLimit { epoch: &cut.epoch, limit: 1 });
        let mut counted = Scan { image: &mut *scan.image, host: &mut host, limit };
        let outcome = self.interpreter.call_observed(task, from, &mut counted, &mut observer);
        observer.tell();
        self.observer.call_ends(matches!(outcome, Outcome::Suspended(_)), scan.image);
        outcome
    }
}

/// Passes everything on to the host, and counts the texts that the program sends. Where a scan is to be stopped, it
/// gives no more time.
struct CountingHost<'a> {
    host: &'a mut dyn Host,
    sent: &'a Cell<usize>,
    cut: Option<&'a Cut>,
}

impl Host for CountingHost<'_> {
    fn call(&mut self, image: &mut [u8], function: HostFn, args: [u64; 4]) -> u64 {
        if function == HostFn::PmacEvent {
            self.sent.set(self.sent.get() + 1);
        }
        self.host.call(image, function, args)
    }

    fn extend_time(&mut self) -> Option<u64> {
        match self.cut {
            Some(_) => None,
            None => self.host.extend_time(),
        }
    }
}

/// Passes everything on to the observer, and tells it of the texts that were sent.
struct WithTexts<'a> {
    observer: &'a mut dyn TickObserver,
    sent: &'a Cell<usize>,
    told: usize,
    cut: Option<&'a Cut>,
}

impl WithTexts<'_> {
    fn tell(&mut self) {
        for _ in self.told..self.sent.get() {
            self.observer.text_sent();
        }
        self.told = self.sent.get();
    }
}

impl Observer for WithTexts<'_> {
    fn statement(&mut self, statement: u32, image: &[u8]) {
        self.tell();
        self.observer.statement(statement, image);
        if let Some(cut) = self.cut
            && cut.statements.contains(&statement)
        {
            cut.epoch.store(1, Ordering::Relaxed);
        }
    }

    fn read(&mut self, variable: Accessed, value: Value) {
        self.observer.read(variable, value);
    }

    fn write(&mut self, variable: Accessed, value: Value) {
        self.observer.write(variable, value);
    }
}
