//! Executes single statements again, with other values of what they read.

use plcc_abi::{Host, HostFn, Scan};
use plcc_frontend::common::{Accessed, Observer, StatementInterpreter, Value};

/// What a statement did.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trial {
    /// What it read, in order, with the values with which it went on.
    pub(crate) reads: Vec<(Accessed, Value)>,
    /// What it wrote, in order.
    pub(crate) writes: Vec<(Accessed, Value)>,
    /// The statement that follows.
    pub(crate) next: Option<u32>,
    /// Whether the task has the statement.
    pub(crate) ran: bool,
    /// Whether the host takes part in it, which does nothing here, so that the values written are not those of a scan.
    pub(crate) is_of_host: bool,
}

/// Executes a statement of a task on an image. What it reads has the values `given`; of two for one variable the first
/// counts, and what is not among them has the value in the image.
pub(crate) fn execute(
    interpreter: &mut dyn StatementInterpreter,
    task: usize,
    statement: u32,
    image: &mut [u8],
    given: &[(Accessed, Value)],
) -> Trial {
    let mut host = IdleHost(false);
    let mut observer = Given { given, trial: Trial::default() };
    let mut scan = Scan::new(image, &mut host);
    let next = interpreter.execute(task, statement, &mut scan, &mut observer);
    Trial { next, is_of_host: host.0, ..observer.trial }
}

/// Notes what a statement does, and gives it other values.
struct Given<'a> {
    given: &'a [(Accessed, Value)],
    trial: Trial,
}

impl Observer for Given<'_> {
    fn statement(&mut self, _: u32, _: &[u8]) {
        self.trial.ran = true;
    }

    fn read(&mut self, _: Accessed, _: Value) {}

    fn write(&mut self, variable: Accessed, value: Value) {
        self.trial.writes.push((variable, value));
    }

    fn instead(&mut self, variable: Accessed, value: Value) -> Value {
        let given = self.given.iter().find(|(of, _)| *of == variable);
        let value = given.map_or(value, |(_, value)| *value);
        self.trial.reads.push((variable, value));
        value
    }
}

/// A host that does nothing, and notes whether it was asked to do something that it can't leave out.
struct IdleHost(bool);

impl Host for IdleHost {
    fn call(&mut self, _: &mut [u8], function: HostFn, _: [u64; 4]) -> u64 {
        self.0 |= !function.is_pure();
        0
    }
}
