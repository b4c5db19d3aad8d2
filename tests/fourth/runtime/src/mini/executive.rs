//! The executive.

use std::any::Any;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use plcc_abi::engine::NoHost;
use plcc_abi::image::{read_i32, read_u8, write_i32, write_u8};
use plcc_abi::mini::{Kind, Symbol};
use plcc_abi::{Engine, Outcome, Program, Scan, Tables, TimeLimit, TrapCode};
use serde::{Deserialize, Serialize};

use super::Copies;
use super::names::{self, MiniNames};
use crate::checkpoint::{CheckpointError, ProgramIdentity, write_state};
use crate::clock_decisions::ClockDecisions;
use crate::control::Control;
use crate::force_list::ForceList;
use crate::names::Names;
use crate::online_change::{Plan, TakeOver};
use crate::safe_outputs::SafeLines;
use crate::watchdog::Watchdog;
use crate::{
    ClockDecision, DeferredAssignment, Event, Executive, Place, Restored, Setting, Stop, TaskStatus, Value, VariableKey,
};

/// The time between two scans in nanoseconds.
const PERIOD_NS: u64 = 10_000_000;

/// What is kept outside the image.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct State {
    tick: u64,
    /// By the variables' indices.
    forces: ForceList<u32, i64>,
}

/// The executive of a program.
#[derive(Clone, Debug)]
pub struct MiniExecutive {
    image: Vec<u8>,
    names: Arc<MiniNames>,
    safe_lines: SafeLines,
    watchdog: Option<Watchdog>,
    state: State,
    identity: ProgramIdentity,
    decisions: ClockDecisions,
    files: Vec<String>,
}

impl MiniExecutive {
    /// A control at power-up.
    ///
    /// # Errors
    /// When the program is in another language, or its tables don't fit its image.
    pub fn new(program: &Program) -> Result<Self, String> {
        let Tables::Mini(tables) = &program.tables else { return Err("it is no MINI".into()) };
        tables.validate(program)?;
        let names = MiniNames::new(tables);
        Ok(Self {
            image: vec![0; program.image_size as usize],
            safe_lines: names.all_off(),
            names: Arc::new(names),
            watchdog: None,
            state: State::default(),
            identity: ProgramIdentity::new(program),
            decisions: ClockDecisions::default(),
            files: program.files.clone(),
        })
    }

    fn put(&mut self, symbol: &Symbol, value: i64) {
        match symbol.kind {
            Kind::Number => write_i32(&mut self.image, symbol.offset, value as i32),
            Kind::Input | Kind::Output => {
                write_u8(&mut self.image, symbol.offset, u8::from(value != 0));
            }
        }
    }

    /// Puts the forced values of inputs or of outputs in their places.
    fn put_forces(&mut self, kind: Kind) {
        let names = Arc::clone(&self.names);
        let forces: Vec<(u32, i64)> =
            self.state.forces.entries().map(|(&index, &value)| (index, value)).collect();
        for (index, value) in forces {
            if let Some(symbol) = names.symbol(names::key(index)).filter(|one| one.kind == kind) {
                self.put(symbol, value);
            }
        }
    }
}

impl Executive for MiniExecutive {
    fn tick_ns(&self) -> u64 {
        PERIOD_NS
    }

    fn tick(&mut self, engine: &mut dyn Engine, _: &mut Vec<Event>) -> Result<(), Stop> {
        self.decisions.begin_tick();
        self.put_forces(Kind::Input);
        let limit = self.watchdog.as_ref().map_or(TimeLimit::NONE, Watchdog::begin_scan);
        let mut scan = Scan { image: &mut self.image, host: &mut NoHost, limit };
        let result = match engine.call(0, None, &mut scan) {
            Outcome::End => {
                self.put_forces(Kind::Output);
                Ok(())
            }
            Outcome::Suspended(_) => {
                self.drive_safe_outputs();
                Err(Stop::internal_error(TrapCode::Internal))
            }
            Outcome::Trap(trap) => {
                self.drive_safe_outputs();
                if trap.code == TrapCode::Watchdog {
                    self.decisions.note(ClockDecision::Cut);
                    let place = trap.statement.and_then(|at| Place::new(&self.files, at));
                    let message = "the scan took too long".into();
                    Err(Stop { code: "WATCHDOG".into(), message, place })
                } else {
                    Err(Stop::internal_error(trap.code))
                }
            }
        };
        if let Some(watchdog) = &self.watchdog {
            watchdog.end();
        }
        self.state.tick += 1;
        result
    }

    fn skip_ticks(&mut self, count: u64) {
        self.state.tick = self.state.tick.saturating_add(count);
    }

    fn names(&self) -> Arc<dyn Names> {
        self.names.clone()
    }

    fn read(&self, key: VariableKey) -> Value {
        Value::Int(self.names.symbol(key).map_or(0, |symbol| match symbol.kind {
            Kind::Number => read_i32(&self.image, symbol.offset).into(),
            Kind::Input | Kind::Output => read_u8(&self.image, symbol.offset).into(),
        }))
    }

    fn read_into(&self, key: VariableKey, value: &mut Value) {
        *value = self.read(key);
    }

    fn write(&mut self, key: VariableKey, value: Setting) {
        let names = Arc::clone(&self.names);
        if let Some(symbol) = names.symbol(key) {
            self.put(symbol, value.integer());
        }
    }

    fn force(&mut self, key: VariableKey, value: Option<Setting>) -> Result<(), &'static str> {
        let symbol = self.names.symbol(key).filter(|symbol| symbol.kind != Kind::Number);
        let (Some(_), Some(index)) = (symbol, names::index(key)) else {
            return Err("is neither an input nor an output, and can't be forced");
        };
        match value {
            Some(value) => self.state.forces.set(index, value.integer()),
            None => {
                self.state.forces.remove(&index);
                Ok(())
            }
        }
    }

    fn each_force(&self, see: &mut dyn FnMut(VariableKey, Setting)) {
        for (&index, &value) in self.state.forces.entries() {
            see(names::key(index), Setting::Int(value));
        }
    }

    fn is_held(&self, key: VariableKey) -> bool {
        let is_input = self.names.symbol(key).is_some_and(|symbol| symbol.kind == Kind::Input);
        is_input && names::index(key).is_some_and(|index| self.state.forces.get(&index).is_some())
    }

    fn each_deferred_assignment(&self, _: &mut dyn FnMut(DeferredAssignment<'_>)) {}

    fn fingerprint(&self) -> u64 {
        self.identity.fingerprint()
    }

    fn take_over(&mut self, old: &mut dyn Executive, plan: &Plan) -> TakeOver {
        let old = old.as_any_mut().downcast_mut::<Self>();
        let (Some(old), Some(copies)) = (old, plan.of_control::<Copies>()) else {
            return TakeOver::Impossible;
        };
        for &(from, to, length) in copies {
            for byte in 0..length {
                let value = read_u8(&old.image, from + byte);
                write_u8(&mut self.image, to + byte, value);
            }
        }
        self.state.tick = old.state.tick;
        TakeOver::Done
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }

    fn retained_into(&self, _: &mut Vec<u8>) -> bool {
        false
    }

    fn retained_revision(&self) -> Option<u64> {
        None
    }

    fn restore(&mut self, _: &[u8]) -> Result<Restored, String> {
        Err("this control keeps nothing".into())
    }

    fn shortest_time_limit(&self) -> Option<Duration> {
        None
    }

    fn set_watchdog(&mut self, watchdog: Watchdog) {
        self.watchdog = Some(watchdog);
    }

    fn image(&self) -> &[u8] {
        &self.image
    }

    fn set_image(&mut self, image: &[u8]) {
        if image.len() == self.image.len() {
            self.image.copy_from_slice(image);
        }
    }

    fn set_safe_lines(&mut self, lines: SafeLines) {
        self.safe_lines = lines;
    }

    fn safe_lines(&self) -> &SafeLines {
        &self.safe_lines
    }

    fn drive_safe_outputs(&mut self) {
        self.safe_lines.drive(&mut self.image);
    }

    fn checkpoint(&self) -> Vec<u8> {
        self.identity.write(&self.image, &self.state)
    }

    fn resume(&mut self, checkpoint: &[u8]) -> Result<(), CheckpointError> {
        let (image, state): (_, State) = self.identity.read(self.image.len(), checkpoint)?;
        let forces = state.forces.with_room().ok_or(CheckpointError::Damaged)?;
        (self.image, self.state) = (image, State { forces, ..state });
        Ok(())
    }

    fn state_into(&self, out: &mut Vec<u8>) {
        write_state(&self.state, out);
    }

    fn compared_ranges(&self) -> Vec<Range<u32>> {
        self.identity.image_without(self.image.len(), &[], &[])
    }

    fn clock_decisions(&self) -> &[ClockDecision] {
        self.decisions.noted()
    }

    fn follow_clock(&mut self, _: Option<&[ClockDecision]>) {}

    fn task_statuses(&self) -> Vec<TaskStatus> {
        vec![]
    }

    fn used_ranges(&self) -> Vec<Range<u32>> {
        vec![]
    }
}
