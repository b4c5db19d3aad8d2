//! The scan (rulings, Scan): time, inputs, program, outputs, faults and messages.

use std::any::Any;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use memmap2::MmapMut;
use plcc_abi::engine::NoHost;
use plcc_abi::image::{read_u8, write_i16, write_i32, write_u8};
use plcc_abi::place::Direction;
use plcc_abi::pmi::{FlipFlop, Lines, PORTS, PmiVariable, Role, Special, Timer, Type};
use plcc_abi::{Engine, Outcome, Program, Scan, Tables, TimeLimit, TrapCode};
use thiserror::Error;

use crate::aliased_names::with_given;
use crate::checkpoint::{CheckpointError, ProgramIdentity, write_state};
use crate::clock_decisions::ClockDecisions;
use crate::image_memory::{ImageMemoryError, image_memory};
use crate::names::Names;
use crate::online_change::{Plan, TakeOver};
use crate::safe_outputs::SafeLines;
use crate::watchdog::Watchdog;
use crate::{
    ClockDecision, DeferredAssignment, Event, Executive, Restored, Setting, Stop, TaskStatus,
    Value, VariableKey,
};

use super::events::{Announcements, value};
use super::names::{self, PmiNames};
use super::state::State;
use super::{macros, port_lines, validate};

/// The unit of timers in nanoseconds.
const TIMER_UNIT: u64 = 20_000_000;

/// The settings of a PMI control that can be chosen for a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PmiOptions {
    /// Time between two scans in nanoseconds, 20 ms on the control.
    pub period_ns: u64,
}

impl Default for PmiOptions {
    fn default() -> Self {
        Self { period_ns: TIMER_UNIT }
    }
}

/// Why a program can't be run.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PmiLoadError {
    /// It is in another language.
    #[error("this is not a PMI program")]
    OtherDialect,
    /// Its tables don't fit its image.
    #[error("the program is damaged: {0}")]
    Damaged(String),
    /// There is no memory for its image.
    #[error(transparent)]
    Memory(#[from] ImageMemoryError),
}

/// The executive of a PMI program.
#[derive(Debug)]
pub struct PmiExecutive {
    pub(super) image: MmapMut,
    pub(super) names: Arc<PmiNames>,
    /// The same with the names that people gave.
    all_names: Arc<dyn Names>,
    timers: Vec<Timer>,
    flipflops: Vec<FlipFlop>,
    /// The physical lines of each input, and the offset of its variable in the image.
    inputs: Vec<(Lines, u32)>,
    /// The same for each output.
    pub(super) outputs: Vec<(Lines, u32)>,
    safe_lines: SafeLines,
    watchdog: Option<Watchdog>,
    announcements: Announcements,
    /// The variables that the executive itself sets.
    pub(super) special: Special,
    /// The offset of port 0 in the image.
    pub(super) ports: u32,
    period_ns: u64,
    pub(super) state: State,
    identity: ProgramIdentity,
    decisions: ClockDecisions,
    /// The names of the program's sources.
    pub(super) files: Vec<String>,
}

impl PmiExecutive {
    /// Makes a control at power-up.
    ///
    /// # Errors
    /// When the program is of another dialect, or its tables don't fit its image.
    pub fn new(program: &Program, options: PmiOptions) -> Result<Self, PmiLoadError> {
        let Tables::Pmi(tables) = &program.tables else { return Err(PmiLoadError::OtherDialect) };
        validate::tables(tables, program).map_err(PmiLoadError::Damaged)?;
        let mut image = image_memory(program.image_size)?;
        for &(offset, ty, value) in &tables.initial {
            write(&mut image, ty, offset, value.into());
        }
        let symbols = || tables.symbols.iter();
        let inputs = symbols().filter_map(|s| Some((s.role.input()?, s.offset))).collect();
        let outputs: Vec<_> =
            symbols().filter_map(|s| Some((s.role.output()?, s.offset))).collect();
        let announcements = Announcements::new(&tables.faults, &tables.messages);
        let announced = vec![false; announcements.count()];
        let names = Arc::new(PmiNames::new(tables));
        Ok(Self {
            inputs,
            safe_lines: names.all_off(),
            outputs,
            watchdog: None,
            all_names: with_given(names.clone(), &program.names),
            names,
            timers: tables.timers.clone(),
            flipflops: tables.flipflops.clone(),
            announcements,
            special: tables.special,
            ports: tables.ports,
            image,
            period_ns: options.period_ns.max(1),
            state: State { announced, ..State::default() },
            identity: ProgramIdentity::new(program),
            decisions: ClockDecisions::default(),
            files: program.files.clone(),
        })
    }

    /// Begins a tick, if nothing has begun it yet: ends the pulse of @CRSET. A stimulus begins the tick too,
    /// before the scan, so that what it sets stays.
    fn begin(&mut self) {
        if !self.state.tick_begun {
            self.state.tick_begun = true;
            write_u8(&mut self.image, self.special.crset, 0);
        }
    }

    /// Lets the timers go down by the time of `ticks` ticks.
    fn count_down(&mut self, ticks: u64) {
        let time = self.period_ns.saturating_mul(ticks);
        self.state.timer_remainder = self.state.timer_remainder.saturating_add(time);
        let units = self.state.timer_remainder / TIMER_UNIT;
        self.state.timer_remainder %= TIMER_UNIT;
        if units == 0 {
            return;
        }
        let units = i32::try_from(units).unwrap_or(i32::MAX);
        for timer in &self.timers {
            macros::count_down(&mut self.image, timer, units);
        }
    }

    /// Copies the physical lines into the inputs' variables, then the values of forced inputs.
    fn latch(&mut self) {
        for &(lines, offset) in &self.inputs {
            let port = read_u8(&self.image, self.ports + u32::from(lines.port));
            let port = self.state.forces.latched(lines.port, port);
            let value = port_lines::decode(lines, port);
            let ty = port_lines::variable_type(lines);
            write(&mut self.image, ty, offset, value.into());
        }
        let image = &mut self.image;
        self.state.forces.apply_to_inputs(|lines, offset, value| {
            write(image, port_lines::variable_type(lines), offset, value.into());
        });
    }

    /// Puts the outputs' values on their physical lines, then those of forced outputs.
    fn drive(&mut self) {
        for &(lines, offset) in &self.outputs {
            let value = value(&self.image, port_lines::variable_type(lines), offset) as i16;
            port_lines::drive(&mut self.image, self.ports, lines, value);
        }
        self.state.forces.apply_to_outputs(&mut self.image, self.ports);
    }

    /// Assigns to the symbol with this index from outside. Of an input its lines are set; a timer or a
    /// flip-flop reacts as to an assignment of the program.
    fn assign(&mut self, index: u32, element: u32, number: i64) {
        let Some(symbol) = self.names.symbol(index) else { return };
        let (ty, role) = (symbol.ty, symbol.role);
        let offset = symbol.offset + element * ty.size();
        if let Role::Input(lines) = role {
            let number = if port_lines::variable_type(lines) == Type::Logical {
                i16::from(number != 0)
            } else {
                number as i16
            };
            return port_lines::drive(&mut self.image, self.ports, lines, number);
        }
        write(&mut self.image, ty, offset, number);
        match role {
            Role::TimerControl(timer) => {
                if let Some(timer) = self.timers.get(timer as usize) {
                    macros::control(&mut self.image, timer);
                }
            }
            Role::FlipFlopPin(flipflop) => {
                if let Some(flipflop) = self.flipflops.get(flipflop as usize) {
                    macros::pin(&mut self.image, flipflop, offset);
                }
            }
            Role::Variable | Role::Input(_) | Role::Output(_) | Role::Constant => {}
        }
    }

    fn set_variable(&mut self, variable: PmiVariable, value: Setting) {
        let number = value.integer();
        match variable {
            PmiVariable::Symbol(index) => self.assign(index, 0, number),
            PmiVariable::Element(index, element) => self.assign(index, element, number),
            PmiVariable::Counter(timer) => {
                if let Some(timer) = self.timers.get(timer as usize) {
                    write_i32(&mut self.image, timer.counter, number as i32);
                }
            }
            PmiVariable::Line(port, bit) => {
                let at = self.ports + u32::from(port);
                let others = read_u8(&self.image, at) & !(1 << bit);
                write_u8(&mut self.image, at, others | u8::from(number != 0) << bit);
            }
        }
    }

    fn value(&self, variable: PmiVariable) -> Value {
        match variable {
            PmiVariable::Symbol(index) => {
                match self.names.symbol(index).and_then(|symbol| symbol.elements) {
                    Some(count) => {
                        Value::Array((0..count).map(|i| self.element(index, i)).collect())
                    }
                    None => self.element(index, 0),
                }
            }
            PmiVariable::Element(index, element) => self.element(index, element),
            PmiVariable::Counter(timer) => {
                let timer = self.timers.get(timer as usize);
                let count = timer.map_or(0, |t| value(&self.image, Type::Long, t.counter));
                Value::Int(count.into())
            }
            PmiVariable::Line(port, bit) if u32::from(port) < PORTS => {
                let port = read_u8(&self.image, self.ports + u32::from(port));
                Value::Int((port >> bit & 1).into())
            }
            PmiVariable::Line(..) => Value::Int(0),
        }
    }

    fn element(&self, index: u32, element: u32) -> Value {
        let read =
            |s: &plcc_abi::pmi::Symbol| value(&self.image, s.ty, s.offset + element * s.ty.size());
        Value::Int(self.names.symbol(index).map_or(0, read).into())
    }
}

/// Writes a variable, converted as an assignment converts.
pub(super) fn write(image: &mut [u8], ty: Type, offset: u32, value: i64) {
    match ty {
        Type::Logical => write_u8(image, offset, u8::from(value != 0)),
        Type::Integer => write_i16(image, offset, value as i16),
        Type::Long => write_i32(image, offset, value as i32),
    }
}

impl Executive for PmiExecutive {
    fn tick_ns(&self) -> u64 {
        self.period_ns
    }

    fn tick(&mut self, engine: &mut dyn Engine, events: &mut Vec<Event>) -> Result<(), Stop> {
        self.decisions.begin_tick();
        self.begin();
        // No time has passed before the first scan.
        if self.state.tick > 0 {
            self.count_down(1);
        }
        self.latch();
        write_u8(&mut self.image, self.special.ipl, u8::from(self.state.tick == 0));
        let limit = self.watchdog.as_ref().map_or(TimeLimit::NONE, Watchdog::begin_scan);
        // A PMI program calls no functions.
        let mut scan = Scan { image: &mut self.image, host: &mut NoHost, limit };
        let result = match engine.call(0, None, &mut scan) {
            Outcome::End => {
                self.drive();
                Ok(())
            }
            // No PMI program is ever suspended.
            Outcome::Suspended(_) => {
                self.emergency_stop();
                Err(Stop::internal_error(TrapCode::Internal))
            }
            Outcome::Trap(trap) => {
                self.emergency_stop();
                if trap.code == TrapCode::Watchdog {
                    self.decisions.note(ClockDecision::Cut);
                }
                Err(self.stop(trap))
            }
        };
        if let Some(watchdog) = &self.watchdog {
            watchdog.end();
        }
        let State { announced, tick, .. } = &mut self.state;
        self.announcements.update(announced, &self.image, *tick, events);
        self.state.tick += 1;
        self.state.tick_begun = false;
        result
    }

    /// A pulse of @CRSET stays until a scan has seen it.
    fn skip_ticks(&mut self, count: u64) {
        self.count_down(count);
        self.state.tick = self.state.tick.saturating_add(count);
    }

    fn names(&self) -> Arc<dyn Names> {
        Arc::clone(&self.all_names)
    }

    fn read(&self, key: VariableKey) -> Value {
        names::variable(key).map_or(Value::Int(0), |variable| self.value(variable))
    }

    fn read_into(&self, key: VariableKey, value: &mut Value) {
        match (names::variable(key), value) {
            (Some(PmiVariable::Symbol(index)), Value::Array(values)) => {
                let count = self.names.symbol(index).and_then(|symbol| symbol.elements);
                values.clear();
                values.extend((0..count.unwrap_or(0)).map(|element| self.element(index, element)));
            }
            (_, value) => *value = self.read(key),
        }
    }

    fn write(&mut self, key: VariableKey, value: Setting) {
        if let Some(variable) = names::variable(key) {
            self.begin();
            self.set_variable(variable, value);
        }
    }

    fn force(&mut self, key: VariableKey, value: Option<Setting>) -> Result<(), &'static str> {
        let neither = "is neither an input nor an output, and can't be forced";
        let variable = names::variable(key).ok_or(neither)?;
        let forces = &mut self.state.forces;
        let Some(value) = value else {
            forces.remove(variable);
            return Ok(());
        };
        match variable {
            PmiVariable::Symbol(index) => {
                let symbol = self.names.symbol(index).ok_or(neither)?;
                forces.set(index, symbol, value.integer())
            }
            PmiVariable::Line(port, bit) => match self.names.direction_of_line(port, bit) {
                Direction::Internal => Err("is a line of no input or output of the program"),
                side => forces.set_line((port, bit), side == Direction::Input, value.integer()),
            },
            PmiVariable::Element(..) | PmiVariable::Counter(_) => Err(neither),
        }
    }

    fn each_force(&self, see: &mut dyn FnMut(VariableKey, Setting)) {
        for (variable, value) in self.state.forces.values() {
            see(names::key(variable), Setting::Int(value.into()));
        }
    }

    fn is_held(&self, key: VariableKey) -> bool {
        names::variable(key).is_some_and(|variable| self.state.forces.holds(variable))
    }

    fn each_deferred_assignment(&self, _: &mut dyn FnMut(DeferredAssignment<'_>)) {}

    fn fingerprint(&self) -> u64 {
        self.identity.fingerprint()
    }

    fn take_over(&mut self, old: &mut dyn Executive, plan: &Plan) -> TakeOver {
        let old = old.as_any_mut().downcast_mut::<Self>();
        let (Some(old), Some(plan)) = (old, plan.of_control()) else {
            return TakeOver::Impossible;
        };
        self.take_over_from(old, plan);
        TakeOver::Done
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }

    fn retained_into(&self, out: &mut Vec<u8>) -> bool {
        self.append_retained(out)
    }

    /// What the control itself changes is not counted, so that the data has to be compared.
    fn retained_revision(&self) -> Option<u64> {
        None
    }

    fn restore(&mut self, retained: &[u8]) -> Result<Restored, String> {
        self.take_retained(retained)
    }

    /// PMI itself limits no scan.
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

    fn state_into(&self, out: &mut Vec<u8>) {
        write_state(&self.state, out);
    }

    fn compared_ranges(&self) -> Vec<Range<u32>> {
        self.identity.image_without(self.image.len(), &["scratch"], &[])
    }

    fn clock_decisions(&self) -> &[ClockDecision] {
        self.decisions.noted()
    }

    /// The clock decides nothing but whether the watchdog stops a scan, after which nothing follows.
    fn follow_clock(&mut self, _decisions: Option<&[ClockDecision]>) {}

    /// A PMI program has one task, which always runs.
    fn task_statuses(&self) -> Vec<TaskStatus> {
        vec![]
    }

    /// The image is small, and all of it counts as used.
    fn used_ranges(&self) -> Vec<Range<u32>> {
        vec![]
    }

    fn resume(&mut self, checkpoint: &[u8]) -> Result<(), CheckpointError> {
        let (image, state): (_, State) = self.identity.read(self.image.len(), checkpoint)?;
        if state.announced.len() != self.state.announced.len() {
            return Err(CheckpointError::Damaged);
        }
        let forces = state.forces.with_room().ok_or(CheckpointError::Damaged)?;
        let state = State { forces, ..state };
        self.image.copy_from_slice(&image);
        self.state = state;
        Ok(())
    }
}
