//! The trace of one tick: its statements in the order in which they were executed, what each of them read and
//! wrote, and the process image before each.

use plcc_frontend::CheckedProgram;
use plcc_frontend::common::{Accessed, Observer, StatementInterpreter, Value};
use plcc_runtime::{Event, Setting, Stop, VariableKey};

use crate::DebugError;
use crate::history::{History, TickResult};
use crate::observers::{Observed, TickObserver};
use crate::program::DebuggedProgram;

/// A variable that a statement has read or written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Access {
    /// The variable.
    pub variable: Accessed,
    /// The value that was read, or the one that the variable had after the write.
    pub value: Value,
    /// Whether it was written.
    pub is_write: bool,
}

/// A statement that was executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// The statement's number.
    pub statement: u32,
    /// The task.
    pub task: usize,
    /// The number of the call of a task to which the statement belongs, counted from 0 in each tick.
    pub call: usize,
    /// How many subroutine calls are open.
    pub depth: usize,
    /// The index of its first access in the trace.
    accesses: usize,
    /// How many changes of the image came before it.
    changes: usize,
}

/// A call of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Call {
    /// The task.
    pub task: usize,
    /// Whether it went on with a scan that was suspended before.
    pub resumed: bool,
    /// Whether the task goes on where this call has ended.
    pub suspended: bool,
}

/// The statements of a tick.
#[derive(Clone, Debug, Default)]
pub struct TickTrace {
    /// The tick.
    pub tick: u64,
    /// The state before the tick, before its stimulus.
    pub before: Vec<u8>,
    /// The calls of tasks, in order.
    pub calls: Vec<Call>,
    /// What was executed.
    pub steps: Vec<Step>,
    accesses: Vec<Access>,
    /// The image before the first scan of the tick; without a scan, the image after the tick.
    base: Vec<u8>,
    /// Bytes that changed since, in order: offset and new value.
    changes: Vec<(u32, u8)>,
    /// The events of the tick.
    pub events: Vec<Event>,
    /// The forces in effect at its end.
    pub forces: Vec<(VariableKey, Setting)>,
    /// Why the program was stopped in this tick, if it was.
    pub stop: Option<Stop>,
    /// Whether the clock left the tick out.
    pub skipped: bool,
    /// Whether the watchdog stopped a scan of it.
    pub cut: bool,
}

impl TickTrace {
    /// Runs a tick of a history in the statement interpreter and records it. `placed` says of each statement whether it
    /// has a place in the source ([`StatementPlaces::placed`](plcc_frontend::presentation::StatementPlaces::placed)).
    ///
    /// # Errors
    /// When there is no such tick.
    pub fn record(
        program: &DebuggedProgram,
        placed: &[bool],
        interpreter: &mut dyn StatementInterpreter,
        history: &mut dyn History,
        tick: u64,
    ) -> Result<(Self, TickResult), DebugError> {
        let cut = cut_statements(program, history, tick)?;
        let before = history.before(tick)?;
        let mut recorder = TraceRecorder::new(program.checked(), placed, tick);
        let mut engine = Observed::new(interpreter, &mut recorder).cut_at(cut);
        let result = history.run(tick, &mut engine)?;
        let mut trace = recorder.finish(history.executive().image());
        (trace.skipped, trace.cut) = (result.skipped, result.cut);
        trace.before = before;
        trace.forces = history.executive().forces();
        (trace.events, trace.stop) = (result.events.clone(), result.stop.clone());
        Ok((trace, result))
    }

    /// What a step read and wrote, in order. Empty for a step that does not exist.
    pub fn accesses(&self, step: usize) -> &[Access] {
        let Some(first) = self.steps.get(step) else { return &[] };
        let end = self.steps.get(step + 1).map_or(self.accesses.len(), |next| next.accesses);
        self.accesses.get(first.accesses..end).unwrap_or(&[])
    }

    /// Everything that was read and written before a step, in order.
    pub fn accesses_before(&self, step: usize) -> &[Access] {
        let end = self.steps.get(step).map_or(self.accesses.len(), |step| step.accesses);
        self.accesses.get(..end).unwrap_or(&[])
    }

    /// The process image before a step. After the last step it is that at the end of the tick.
    pub fn image(&self, step: usize) -> Vec<u8> {
        let mut image = self.base.clone();
        let end = self.steps.get(step).map_or(self.changes.len(), |step| step.changes);
        for &(offset, value) in self.changes.get(..end).unwrap_or(&[]) {
            if let Some(byte) = image.get_mut(offset as usize) {
                *byte = value;
            }
        }
        image
    }
}

/// As [`Debugger::cut_statements`](crate::Debugger::cut_statements).
pub(crate) fn cut_statements(
    program: &DebuggedProgram,
    history: &mut dyn History,
    tick: u64,
) -> Result<Vec<u32>, DebugError> {
    let Some((file, line)) = history.cut_at(tick)? else { return Ok(vec![]) };
    let Some(file) = program.file(&file) else { return Ok(vec![]) };
    Ok(match program.places().statements_from(file, line) {
        Some((found, statements)) if found == line => statements.to_vec(),
        _ => vec![],
    })
}

/// Records the trace of a tick.
pub struct TraceRecorder<'a> {
    program: &'a dyn CheckedProgram,
    /// By a statement's number: whether it has a place in the source, and so is a step of the trace.
    placed: &'a [bool],
    trace: TickTrace,
    /// The image when changes were last looked for.
    seen: Vec<u8>,
    task: usize,
    calls: usize,
    /// Whether the statement that runs is a step of the trace.
    in_step: bool,
}

impl std::fmt::Debug for TraceRecorder<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.trace.fmt(f)
    }
}

impl<'a> TraceRecorder<'a> {
    /// Begins the trace of a tick. `placed` says of each statement whether it has a place in the source; the
    /// others are not in the trace.
    pub fn new(program: &'a dyn CheckedProgram, placed: &'a [bool], tick: u64) -> Self {
        let trace = TickTrace { tick, ..TickTrace::default() };
        Self { program, placed, trace, seen: vec![], task: 0, calls: 0, in_step: false }
    }

    /// The trace, given the image at the end of the tick.
    pub fn finish(mut self, image: &[u8]) -> TickTrace {
        self.see(image);
        self.trace
    }

    /// Notes what has changed in the image.
    fn see(&mut self, image: &[u8]) {
        const BLOCK: usize = 64;
        if self.seen.len() != image.len() {
            self.seen = image.to_vec();
            self.trace.base = image.to_vec();
            return;
        }
        let blocks = self.seen.chunks_mut(BLOCK).zip(image.chunks(BLOCK));
        for (number, (seen, now)) in blocks.enumerate() {
            if seen == now {
                continue;
            }
            for (at, (old, &new)) in seen.iter_mut().zip(now).enumerate() {
                if *old != new {
                    *old = new;
                    self.trace.changes.push(((number * BLOCK + at) as u32, new));
                }
            }
        }
    }

    fn access(&mut self, variable: Accessed, value: Value, is_write: bool) {
        if self.in_step {
            self.trace.accesses.push(Access { variable, value, is_write });
        }
    }
}

impl Observer for TraceRecorder<'_> {
    fn statement(&mut self, statement: u32, image: &[u8]) {
        self.in_step = self.placed.get(statement as usize).copied().unwrap_or(false);
        if !self.in_step {
            return;
        }
        self.see(image);
        self.trace.steps.push(Step {
            statement,
            task: self.task,
            call: self.calls.saturating_sub(1),
            depth: self.program.calls(image).len(),
            accesses: self.trace.accesses.len(),
            changes: self.trace.changes.len(),
        });
    }

    fn read(&mut self, variable: Accessed, value: Value) {
        self.access(variable, value, false);
    }

    fn write(&mut self, variable: Accessed, value: Value) {
        self.access(variable, value, true);
    }
}

impl TickObserver for TraceRecorder<'_> {
    fn call_begins(&mut self, task: usize, resumed: bool, image: &[u8]) {
        self.trace.calls.push(Call { task, resumed, suspended: false });
        self.task = task;
        self.calls += 1;
        self.in_step = false;
        self.see(image);
    }

    fn call_ends(&mut self, suspended: bool, image: &[u8]) {
        if let Some(call) = self.trace.calls.last_mut() {
            call.suspended = suspended;
        }
        self.see(image);
        self.in_step = false;
    }
}
