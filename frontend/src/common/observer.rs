//! What a statement interpreter tells an observer: which statement comes next, and which variables
//! it reads and writes.
//!
//! Debuggers and displays of a running program are observers. Each interpreter is generic over its
//! observer, and [`NoObserver`] makes the interpreter that engines use: its methods are empty, so
//! that nothing of them is left in the machine code.

use plcc_abi::{Engine, Outcome, ResumePoint, Scan};

use super::{Accessed, Value};

/// Something that is told of each statement while a statement interpreter runs. It changes nothing of what the program
/// does, unless it answers [`instead`](Self::instead).
pub trait Observer {
    /// A statement is executed next. `statement` is its number: an index in
    /// [`CheckedProgram::statements`](crate::CheckedProgram::statements). `image` is the process
    /// image before it.
    fn statement(&mut self, statement: u32, image: &[u8]);

    /// The statement has read a variable, which has this value.
    fn read(&mut self, variable: Accessed, value: Value);

    /// The statement has written a variable, which has this value now. It may be the one it had.
    fn write(&mut self, variable: Accessed, value: Value);

    /// The value with which the statement goes on instead of the one that it has read. Only those who ask what would be if
    /// a variable had another value give another one.
    fn instead(&mut self, _variable: Accessed, value: Value) -> Value {
        value
    }

    /// Whether anything is done with what is told. Where it costs time to find out what to tell,
    /// interpreters ask this first.
    fn is_active(&self) -> bool {
        true
    }
}

impl<O: Observer + ?Sized> Observer for &mut O {
    fn statement(&mut self, statement: u32, image: &[u8]) {
        (**self).statement(statement, image);
    }

    fn read(&mut self, variable: Accessed, value: Value) {
        (**self).read(variable, value);
    }

    fn write(&mut self, variable: Accessed, value: Value) {
        (**self).write(variable, value);
    }

    fn instead(&mut self, variable: Accessed, value: Value) -> Value {
        (**self).instead(variable, value)
    }

    fn is_active(&self) -> bool {
        (**self).is_active()
    }
}

/// The observer of an interpreter that nobody observes.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoObserver;

impl Observer for NoObserver {
    #[inline(always)]
    fn statement(&mut self, _: u32, _: &[u8]) {}

    #[inline(always)]
    fn read(&mut self, _: Accessed, _: Value) {}

    #[inline(always)]
    fn write(&mut self, _: Accessed, _: Value) {}

    #[inline(always)]
    fn is_active(&self) -> bool {
        false
    }
}

/// A statement interpreter, which can be observed while it runs a scan.
pub trait StatementInterpreter: Engine {
    /// Runs one scan of a task as [`Engine::call`] does, with the same result, and tells `observer`
    /// of it.
    fn call_observed(
        &mut self,
        task: usize,
        from: Option<ResumePoint>,
        scan: &mut Scan<'_>,
        observer: &mut dyn Observer,
    ) -> Outcome;

    /// Executes one statement alone, as a scan of the task does that comes to it, and tells `observer` of it. Here a
    /// register that is handed from one statement to the next (NCT's OP) is told as read and written like a variable. Gives
    /// the number of the statement that follows; `None` where the task ends, waits or is stopped behind it, or has no such
    /// statement.
    fn execute(
        &mut self,
        task: usize,
        statement: u32,
        scan: &mut Scan<'_>,
        observer: &mut dyn Observer,
    ) -> Option<u32>;
}
