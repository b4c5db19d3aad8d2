//! An executive that another one can replace between two ticks.

use std::any::Any;
use std::io;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use plcc_abi::Engine;

use super::entry::Action;
use super::recorder::{Recorder, RecorderProgram};
use plcc_runtime::online_change::{Plan, TakeOver};
use plcc_runtime::safe_outputs::SafeLines;
use plcc_runtime::watchdog::Watchdog;
use plcc_runtime::{
    CheckpointError, ClockDecision, DeferredAssignment, Event, Executive, Names, Restored, Setting,
    Stop, TaskStatus, Value, VariableKey,
};

/// The executive of whichever program runs now.
pub struct ReplaceableExecutive {
    executive: Box<dyn Executive + Send>,
    /// The engine of the present program. `None` for the program with which the run began: its engine is given to
    /// every call of `tick`.
    engine: Option<Box<dyn Engine + Send>>,
    /// What watches the scans of every program.
    watchdog: Option<Watchdog>,
    /// What records the run.
    recorder: Option<Box<Recorder>>,
}

impl ReplaceableExecutive {
    /// Begins with the executive of a program. The engine that [`tick`](Executive::tick) is given must be
    /// one of that program.
    pub fn new(executive: Box<dyn Executive + Send>) -> Self {
        Self { executive, engine: None, watchdog: None, recorder: None }
    }

    /// From now on `recorder` records what acts on the control and what its ticks do.
    pub fn record(&mut self, recorder: Recorder) {
        self.recorder = Some(Box::new(recorder));
    }

    /// Whether the record waits for idle time to take a checkpoint
    /// ([`checkpoint_in_idle_time`](Self::checkpoint_in_idle_time)).
    pub fn waits_for_idle_time(&self) -> bool {
        self.recorder.as_ref().is_some_and(|recorder| recorder.waits_for_idle_time())
    }

    /// Has the record take the checkpoint that it waits for, if `idle`, the time until the next tick, is enough for it.
    /// To be called in real time, after a tick, when everything else of it is done.
    pub fn checkpoint_in_idle_time(&mut self, idle: Duration) {
        if let Some(recorder) = &mut self.recorder {
            recorder.checkpoint_in_idle_time(self.executive.as_ref(), idle);
        }
    }

    /// Ends the record, if there is one. `stop` is why the control stopped the program, if it did.
    ///
    /// # Errors
    /// Why the record could not be written, in simulated time.
    pub fn end_record(&mut self, stop: Option<&Stop>) -> io::Result<()> {
        self.recorder.take().map_or(Ok(()), |recorder| recorder.end(stop))
    }

    /// Tells the recorder of something that is about to act on the control.
    fn note(&mut self, action: Action) {
        if let Some(recorder) = &mut self.recorder {
            recorder.act(self.executive.as_ref(), action);
        }
    }

    /// Carries an online change out: the executive of another program takes the state of this one over, as `plan`
    /// says, and takes its place. What was here is in the arguments afterwards. Nothing is allocated or freed.
    pub fn change_program(
        &mut self,
        executive: &mut Box<dyn Executive + Send>,
        engine: &mut Option<Box<dyn Engine + Send>>,
        recorder_program: &mut RecorderProgram,
        plan: &Plan,
    ) -> TakeOver {
        match executive.take_over(self.executive.as_mut(), plan) {
            TakeOver::Done => {}
            not_done => return not_done,
        }
        if let Some(watchdog) = &self.watchdog {
            executive.set_watchdog(watchdog.clone());
        }
        std::mem::swap(&mut self.executive, executive);
        std::mem::swap(&mut self.engine, engine);
        if let Some(recorder) = &mut self.recorder {
            recorder.replaced(recorder_program);
        }
        TakeOver::Done
    }
}

/// Each method is passed on to the executive of the program that runs. None may be left out, not even one that the
/// trait has for all: a test compares the two lists.
impl Executive for ReplaceableExecutive {
    fn tick_ns(&self) -> u64 {
        self.executive.tick_ns()
    }

    fn tick(&mut self, engine: &mut dyn Engine, events: &mut Vec<Event>) -> Result<(), Stop> {
        if let Some(recorder) = &mut self.recorder {
            recorder.checkpoint_if_due(self.executive.as_ref());
        }
        let first = events.len();
        let result = match &mut self.engine {
            Some(own) => self.executive.tick(own.as_mut(), events),
            None => self.executive.tick(engine, events),
        };
        if let Some(recorder) = &mut self.recorder {
            let events = events.get(first..).unwrap_or_default();
            recorder.end_tick(self.executive.as_ref(), events, result.as_ref().copied());
        }
        result
    }

    fn skip_ticks(&mut self, count: u64) {
        self.note(Action::Skip(count));
        self.executive.skip_ticks(count);
    }

    fn names(&self) -> Arc<dyn Names> {
        self.executive.names()
    }

    fn read(&self, key: VariableKey) -> Value {
        self.executive.read(key)
    }

    fn read_into(&self, key: VariableKey, value: &mut Value) {
        self.executive.read_into(key, value);
    }

    fn write(&mut self, key: VariableKey, value: Setting) {
        self.note(Action::Write(key, value));
        self.executive.write(key, value);
    }

    fn retained_into(&self, out: &mut Vec<u8>) -> bool {
        self.executive.retained_into(out)
    }

    fn retained_revision(&self) -> Option<u64> {
        self.executive.retained_revision()
    }

    fn retained(&self) -> Option<Vec<u8>> {
        self.executive.retained()
    }

    fn restore(&mut self, retained: &[u8]) -> Result<Restored, String> {
        self.executive.restore(retained)
    }

    fn shortest_time_limit(&self) -> Option<Duration> {
        self.executive.shortest_time_limit()
    }

    fn set_watchdog(&mut self, watchdog: Watchdog) {
        self.watchdog = Some(watchdog.clone());
        self.executive.set_watchdog(watchdog);
    }

    fn image(&self) -> &[u8] {
        self.executive.image()
    }

    fn set_image(&mut self, image: &[u8]) {
        self.executive.set_image(image);
    }

    fn set_safe_lines(&mut self, lines: SafeLines) {
        self.executive.set_safe_lines(lines);
    }

    fn safe_lines(&self) -> &SafeLines {
        self.executive.safe_lines()
    }

    fn drive_safe_outputs(&mut self) {
        self.note(Action::SafeOutputs);
        self.executive.drive_safe_outputs();
    }

    fn checkpoint(&self) -> Vec<u8> {
        self.executive.checkpoint()
    }

    fn resume(&mut self, checkpoint: &[u8]) -> Result<(), CheckpointError> {
        self.executive.resume(checkpoint)
    }

    fn state_into(&self, out: &mut Vec<u8>) {
        self.executive.state_into(out);
    }

    fn compared_ranges(&self) -> Vec<Range<u32>> {
        self.executive.compared_ranges()
    }

    fn clock_decisions(&self) -> &[ClockDecision] {
        self.executive.clock_decisions()
    }

    fn follow_clock(&mut self, decisions: Option<&[ClockDecision]>) {
        self.executive.follow_clock(decisions);
    }

    fn force(&mut self, key: VariableKey, value: Option<Setting>) -> Result<(), &'static str> {
        self.note(Action::Force(key, value));
        self.executive.force(key, value)
    }

    fn each_force(&self, see: &mut dyn FnMut(VariableKey, Setting)) {
        self.executive.each_force(see);
    }

    fn forces(&self) -> Vec<(VariableKey, Setting)> {
        self.executive.forces()
    }

    fn is_held(&self, key: VariableKey) -> bool {
        self.executive.is_held(key)
    }

    fn each_deferred_assignment(&self, see: &mut dyn FnMut(DeferredAssignment<'_>)) {
        self.executive.each_deferred_assignment(see);
    }

    fn fingerprint(&self) -> u64 {
        self.executive.fingerprint()
    }

    fn task_statuses(&self) -> Vec<TaskStatus> {
        self.executive.task_statuses()
    }

    fn used_ranges(&self) -> Vec<Range<u32>> {
        self.executive.used_ranges()
    }

    /// Gives this value, not the executive in it, since an online change needs the `ReplaceableExecutive`.
    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }

    fn notes_at_end(&self) -> Vec<String> {
        self.executive.notes_at_end()
    }

    fn take_over(&mut self, old: &mut dyn Executive, plan: &Plan) -> TakeOver {
        self.executive.take_over(old, plan)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    /// The names of the functions in a part of a source.
    fn functions(source: &str) -> BTreeSet<&str> {
        let lines = source.lines().filter_map(|line| line.strip_prefix("    fn "));
        lines.filter_map(|line| line.split(['(', '<']).next()).collect()
    }

    #[test]
    fn every_method_of_an_executive_is_passed_on() {
        let declared = include_str!("../../runtime/src/executive.rs")
            .split("pub trait Executive")
            .nth(1)
            .unwrap();
        let passed_on = include_str!("replaceable.rs").split("#[cfg(test)]").next().unwrap();
        let passed_on = passed_on.split("impl Executive for").nth(1).unwrap();
        assert!(functions(declared).len() > 20);
        assert_eq!(functions(declared), functions(passed_on));
    }
}
