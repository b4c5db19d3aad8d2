//! The simulated executive as an [`Executive`].

use std::any::Any;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use plcc_abi::{DialectVariable, Engine};

use super::{SimulatedExecutive, State};
use crate::checkpoint::{CheckpointError, split, write_state};
use crate::names::Names;
use crate::online_change::{Plan, TakeOver};
use crate::safe_outputs::SafeLines;
use crate::watchdog::Watchdog;
use crate::{
    ClockDecision, DeferredAssignment, Event, Executive, Restored, Setting, Stop, TaskStatus,
    Value, VariableKey,
};

impl Executive for SimulatedExecutive {
    fn tick_ns(&self) -> u64 {
        self.inner.tick_ns()
    }

    fn tick(&mut self, engine: &mut dyn Engine, events: &mut Vec<Event>) -> Result<(), Stop> {
        self.step();
        self.tell(events);
        self.tick = self.tick.saturating_add(1);
        self.inner.tick(engine, events)
    }

    /// The steps of ticks that are skipped are done, and what they tell is told with the next tick.
    fn skip_ticks(&mut self, count: u64) {
        for _ in 0..count {
            self.step();
        }
        self.tick = self.tick.saturating_add(count);
        self.inner.skip_ticks(count);
    }

    fn names(&self) -> Arc<dyn Names> {
        self.names.clone()
    }

    fn read(&self, key: VariableKey) -> Value {
        match key.0 {
            DialectVariable::Simulator(variable) => self.own_value(variable),
            _ => self.inner.read(key),
        }
    }

    fn read_into(&self, key: VariableKey, value: &mut Value) {
        match key.0 {
            DialectVariable::Simulator(variable) => *value = self.own_value(variable),
            _ => self.inner.read_into(key, value),
        }
    }

    fn write(&mut self, key: VariableKey, value: Setting) {
        self.set(key, value);
    }

    fn retained_into(&self, out: &mut Vec<u8>) -> bool {
        self.inner.retained_into(out)
    }

    fn retained_revision(&self) -> Option<u64> {
        self.inner.retained_revision()
    }

    fn restore(&mut self, retained: &[u8]) -> Result<Restored, String> {
        self.inner.restore(retained)
    }

    fn shortest_time_limit(&self) -> Option<Duration> {
        self.inner.shortest_time_limit()
    }

    fn set_watchdog(&mut self, watchdog: Watchdog) {
        self.inner.set_watchdog(watchdog);
    }

    fn image(&self) -> &[u8] {
        self.inner.image()
    }

    fn set_image(&mut self, image: &[u8]) {
        self.inner.set_image(image);
    }

    fn set_safe_lines(&mut self, lines: SafeLines) {
        self.inner.set_safe_lines(lines);
    }

    fn safe_lines(&self) -> &SafeLines {
        self.inner.safe_lines()
    }

    fn drive_safe_outputs(&mut self) {
        self.inner.drive_safe_outputs();
    }

    fn checkpoint(&self) -> Vec<u8> {
        let mut state = vec![];
        self.state_into(&mut state);
        crate::checkpoint::seal(self.fingerprint(), self.image(), &state)
    }

    /// The executive's own state, the simulator's behind it, and the length of that.
    fn state_into(&self, out: &mut Vec<u8>) {
        self.inner.state_into(out);
        let start = out.len();
        let own = (self.tick, self.simulator.state(), self.slots.remembered());
        write_state(&own, out);
        let length = u32::try_from(out.len().saturating_sub(start)).unwrap_or(u32::MAX);
        out.extend(length.to_le_bytes());
    }

    fn resume(&mut self, checkpoint: &[u8]) -> Result<(), CheckpointError> {
        let (inner, own) = split(checkpoint)?;
        let State { tick, simulator, slots } =
            postcard::from_bytes(own).map_err(|_| CheckpointError::Damaged)?;
        // The simulator is changed first only if all of it fits, and taken back if the executive refuses.
        if !self.slots.fits(&slots) {
            return Err(CheckpointError::Damaged);
        }
        let before = self.simulator.state().clone();
        if !self.simulator.set_state(simulator) {
            return Err(CheckpointError::Damaged);
        }
        if let Err(error) = self.inner.resume(&inner) {
            self.simulator.set_state(before);
            return Err(error);
        }
        self.slots.remember(slots);
        self.tick = tick;
        Ok(())
    }

    fn compared_ranges(&self) -> Vec<Range<u32>> {
        self.inner.compared_ranges()
    }

    fn clock_decisions(&self) -> &[ClockDecision] {
        self.inner.clock_decisions()
    }

    fn follow_clock(&mut self, decisions: Option<&[ClockDecision]>) {
        self.inner.follow_clock(decisions);
    }

    fn force(&mut self, key: VariableKey, value: Option<Setting>) -> Result<(), &'static str> {
        self.inner.force(key, value)
    }

    fn each_force(&self, see: &mut dyn FnMut(VariableKey, Setting)) {
        self.inner.each_force(see);
    }

    fn is_held(&self, key: VariableKey) -> bool {
        self.inner.is_held(key)
    }

    fn each_deferred_assignment(&self, see: &mut dyn FnMut(DeferredAssignment<'_>)) {
        self.inner.each_deferred_assignment(see);
    }

    fn task_statuses(&self) -> Vec<TaskStatus> {
        self.inner.task_statuses()
    }

    fn fingerprint(&self) -> u64 {
        self.inner.fingerprint()
    }

    fn used_ranges(&self) -> Vec<Range<u32>> {
        self.inner.used_ranges()
    }

    /// The other program's control is simulated too, by the same table.
    fn take_over(&mut self, old: &mut dyn Executive, plan: &Plan) -> TakeOver {
        let Some(old) = old.as_any_mut().downcast_mut::<Self>() else {
            return TakeOver::Impossible;
        };
        match self.inner.take_over(old.inner.as_mut(), plan) {
            TakeOver::Done => {}
            not_done => return not_done,
        }
        self.slots.take_over(&old.slots);
        self.simulator.take_over(&mut old.simulator);
        self.tick = old.tick;
        TakeOver::Done
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }

    fn notes_at_end(&self) -> Vec<String> {
        self.simulator.notes()
    }
}
