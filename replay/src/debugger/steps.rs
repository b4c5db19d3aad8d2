//! Single steps, forwards and backwards, and going to a tick.

use super::{Debugger, Direction, Position, StepKind, Stopped};
use crate::DebugError;

/// After so many ticks that execute no statement, a step ends without having found one.
const MAX_EMPTY_TICKS: u64 = 100_000;

impl Debugger<'_> {
    /// Goes to the beginning of a tick.
    ///
    /// # Errors
    /// When there is no such tick.
    pub fn go_to_tick(&mut self, tick: u64) -> Result<(), DebugError> {
        let here = self.position;
        self.enter_version_of(tick)?;
        self.position = Position { tick, step: 0 };
        self.is_fresh = false;
        if let Err(error) = self.trace() {
            self.position = here;
            self.enter_version_of(here.tick)?;
            return Err(error);
        }
        Ok(())
    }

    /// Goes to the end of a tick, after its last statement.
    ///
    /// # Errors
    /// When there is no such tick.
    pub fn go_to_end_of_tick(&mut self, tick: u64) -> Result<(), DebugError> {
        self.go_to_tick(tick)?;
        self.position.step = self.trace()?.steps.len();
        Ok(())
    }

    /// Goes to the end of what is known: of a recording, or of what was run so far.
    ///
    /// # Errors
    /// When nothing is known.
    pub fn go_to_end(&mut self) -> Result<(), DebugError> {
        let last = self.known_ticks().saturating_sub(1).max(self.first_tick());
        self.go_to_tick(last)?;
        let trace = self.trace()?;
        let steps = trace.steps.len();
        // A statement that stopped the program is shown, rather than the end of its tick.
        let has_trap = trace.stop.as_ref().is_some_and(|stop| stop.place.is_some());
        self.position.step = steps.saturating_sub(usize::from(has_trap));
        Ok(())
    }

    /// Goes one step.
    ///
    /// # Errors
    /// When a tick can't be run.
    pub fn step(&mut self, kind: StepKind, direction: Direction) -> Result<Stopped, DebugError> {
        self.is_fresh = false;
        self.look_for_more()?;
        let Some(from) = self.step_here()? else { return self.neighbour(direction) };
        let mut ticks = 0;
        let first_tick = self.position.tick;
        loop {
            self.interruption.check()?;
            let moved = self.neighbour(direction)?;
            if moved != Stopped::Step {
                return Ok(moved);
            }
            let Some(here) = self.step_here()? else { continue };
            let left = here.call != from.call || self.position.tick != first_tick;
            let arrived = match kind {
                StepKind::Statement => true,
                StepKind::Over => here.task != from.task || here.depth <= from.depth,
                StepKind::Out if from.depth > 0 => {
                    here.task == from.task && here.depth < from.depth
                }
                StepKind::Out | StepKind::Scan => {
                    let is_other_scan = here.task == from.task && left;
                    is_other_scan && (direction == Direction::Forward || self.begins_call()?)
                }
            };
            if arrived {
                return Ok(Stopped::Step);
            }
            if self.position.step == 0 {
                ticks += 1;
                if ticks > MAX_EMPTY_TICKS {
                    return Ok(Stopped::Step);
                }
            }
        }
    }

    /// Whether the step at the position is the first one of its call.
    fn begins_call(&mut self) -> Result<bool, DebugError> {
        let at = self.position.step;
        let steps = &self.trace()?.steps;
        let call = |step: usize| steps.get(step).map(|step| step.call);
        Ok(at.checked_sub(1).is_none_or(|before| call(before) != call(at)))
    }

    /// Goes to the statement that is executed next or before, in this tick or another.
    fn neighbour(&mut self, direction: Direction) -> Result<Stopped, DebugError> {
        let start = self.position;
        let moved = match direction {
            Direction::Forward => self.forward_to_statement()?,
            Direction::Back => self.back_to_statement()?,
        };
        if matches!(moved, Stopped::Beginning) {
            self.position = start;
        }
        Ok(moved)
    }

    fn forward_to_statement(&mut self) -> Result<Stopped, DebugError> {
        for _ in 0..MAX_EMPTY_TICKS {
            self.interruption.check()?;
            let at = self.position.step;
            let trace = self.trace()?;
            let (count, stop) = (trace.steps.len(), trace.stop.clone());
            if at + 1 < count {
                self.position.step = at + 1;
                return Ok(Stopped::Step);
            }
            if let Some(stop) = stop {
                self.position.step = count.saturating_sub(usize::from(stop.place.is_some()));
                return Ok(Stopped::ProgramStopped(stop));
            }
            let next = self.position.tick + 1;
            if next >= self.history().known() && !self.history().goes_on() {
                let Some(version) = self.enter_neighbour_version(false)? else {
                    self.position.step = count;
                    return Ok(Stopped::End);
                };
                self.position = Position { tick: version.first, step: 0 };
            } else {
                self.position = Position { tick: next, step: 0 };
            }
            if !self.trace()?.steps.is_empty() {
                return Ok(Stopped::Step);
            }
        }
        Ok(Stopped::Step)
    }

    fn back_to_statement(&mut self) -> Result<Stopped, DebugError> {
        for _ in 0..MAX_EMPTY_TICKS {
            if self.position.step > 0 {
                self.position.step -= 1;
                return Ok(Stopped::Step);
            }
            let before = self.position.tick.checked_sub(1);
            let tick = match before.filter(|tick| *tick >= self.history().first()) {
                Some(tick) => tick,
                None => match self.enter_neighbour_version(true)? {
                    Some(version) => version.end.saturating_sub(1),
                    None => return Ok(Stopped::Beginning),
                },
            };
            self.position = Position { tick, step: 0 };
            self.position.step = self.trace()?.steps.len();
        }
        Ok(Stopped::Step)
    }
}
