//! A control for the tests of the run: an executive with three variables, without a program.

use std::any::Any;
use std::cell::{Cell, RefCell};
use std::ops::Range;
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

use plcc_abi::engine::NoHost;
use plcc_abi::pmi::{PmiTables, Role, Symbol, Type};
use plcc_abi::{Engine, Program, Scan, Tables};

use super::Clock;
use plcc_runtime::online_change::{Plan, TakeOver};
use plcc_runtime::safe_outputs::{SafeLines, SafeOutputs};
use plcc_runtime::watchdog::Watchdog;
use plcc_runtime::{
    CheckpointError, ClockDecision, DeferredAssignment, Event, EventBody, Executive, NameError,
    Names, Place, Properties, Purpose, Restored, Setting, Stop, TaskStatus, Value, ValueError,
    VariableKey, names_of,
};

/// `A`, `P10` and `ARR`, an array of both; stops in a tick.
#[derive(Default)]
pub(super) struct Control {
    pub(super) values: [i64; 2],
    /// Further elements of `ARR`.
    pub(super) further: Vec<i64>,
    pub(super) log: Rc<RefCell<Vec<(u64, i64)>>>,
    pub(super) tick: u64,
    pub(super) stops: Option<u64>,
    /// How often the outputs were made safe.
    pub(super) made_safe: u32,
    pub(super) lines: SafeLines,
    pub(super) skipped: u64,
    /// How long each of the first ticks takes, in milliseconds on the clock.
    pub(super) durations: Vec<u64>,
    pub(super) clock: SetClock,
}

/// A clock that stands but for what is waited and worked.
#[derive(Clone, Debug)]
pub(super) struct SetClock(Rc<Cell<Instant>>);

impl Default for SetClock {
    fn default() -> Self {
        Self(Rc::new(Cell::new(Instant::now())))
    }
}

impl Clock for SetClock {
    fn now(&self) -> Instant {
        self.0.get()
    }

    fn sleep(&self, time: Duration) {
        self.0.set(self.0.get() + time);
    }
}

const NAMES: [&str; 3] = ["A", "P10", "ARR"];

/// The names of the control: those of a PMI program, but for what the language says of names and values.
#[derive(Debug)]
pub(super) struct ControlNames(Arc<dyn Names>);

impl ControlNames {
    pub(super) fn new() -> Self {
        let symbol = |(index, name): (usize, &str)| Symbol {
            name: name.into(),
            ty: if index == 0 { Type::Logical } else { Type::Integer },
            offset: 0,
            elements: (name == "ARR").then_some(2),
            role: Role::Variable,
            dumped: name != "ARR",
            retained: false,
        };
        let symbols = NAMES.into_iter().enumerate().map(symbol).collect();
        Self(names_of(&Program {
            image_size: 0,
            regions: vec![],
            tasks: vec![],
            files: vec![],
            tables: Tables::Pmi(PmiTables { symbols, ..PmiTables::default() }),
            names: vec![],
        }))
    }

    /// The key of the variable with this name.
    pub(super) fn key(name: &str) -> VariableKey {
        Self::new().find(name, Purpose::Watch).unwrap()
    }
}

impl Names for ControlNames {
    fn find(&self, name: &str, _: Purpose) -> Result<VariableKey, NameError> {
        self.0
            .find(name, Purpose::Watch)
            .map_err(|_| NameError::Unknown { name: name.into(), suggestion: Some("A".into()) })
    }

    fn canonical(&self, key: VariableKey) -> String {
        self.0.canonical(key)
    }

    fn properties(&self, key: VariableKey) -> Properties {
        self.0.properties(key)
    }

    fn element(&self, key: VariableKey, index: u32) -> Option<VariableKey> {
        self.0.element(key, index)
    }

    fn parse(&self, _: VariableKey, text: &str) -> Result<Setting, ValueError> {
        let error = |_| ValueError { value: text.into(), reason: "is not an integer".into() };
        text.parse().map(Setting::Int).map_err(error)
    }

    fn declared(&self) -> Vec<(String, VariableKey)> {
        self.0.declared()
    }

    fn outputs(&self) -> Vec<(String, VariableKey)> {
        vec![]
    }

    fn shown_in_image(&self) -> Vec<VariableKey> {
        vec![]
    }

    fn safe_lines(&self, _: &SafeOutputs) -> Result<SafeLines, Vec<NameError>> {
        Ok(SafeLines::default())
    }

    fn share_forced_bits(&self, _: VariableKey, _: VariableKey) -> bool {
        false
    }
}

impl Control {
    /// The index of a variable in [`NAMES`].
    fn index(key: VariableKey) -> Option<usize> {
        let name = ControlNames::new().canonical(key);
        NAMES.iter().position(|known| *known == name)
    }
}

impl Executive for Control {
    fn tick_ns(&self) -> u64 {
        1_000_000
    }

    fn tick(&mut self, engine: &mut dyn Engine, events: &mut Vec<Event>) -> Result<(), Stop> {
        let _ = engine.call(0, None, &mut Scan::new(&mut [], &mut NoHost));
        let tick = self.tick;
        if let Some(&ms) = self.durations.get(tick as usize) {
            self.clock.sleep(Duration::from_millis(ms));
        }
        self.tick += 1;
        self.log.borrow_mut().push((tick, self.values[0]));
        if self.values[0] == 3 {
            let body = EventBody::Send { text: "drei \u{B}".into(), port: None };
            events.push(Event { tick, body });
        }
        let place = Place { file: "a\"b.pmi".into(), line: 7 };
        let stop = Stop { code: "HALT".into(), message: "it \"halts\"".into(), place: Some(place) };
        if self.stops == Some(tick) { Err(stop) } else { Ok(()) }
    }

    fn skip_ticks(&mut self, count: u64) {
        self.skipped += count;
        self.tick += count;
    }

    fn names(&self) -> Arc<dyn Names> {
        Arc::new(ControlNames::new())
    }

    fn read(&self, key: VariableKey) -> Value {
        match Self::index(key).and_then(|index| self.values.get(index)) {
            Some(value) => Value::Int(*value),
            None => Value::Array(
                self.values.iter().chain(&self.further).copied().map(Value::Int).collect(),
            ),
        }
    }

    fn read_into(&self, key: VariableKey, value: &mut Value) {
        *value = self.read(key);
    }

    fn write(&mut self, key: VariableKey, value: Setting) {
        let slot = Self::index(key).and_then(|index| self.values.get_mut(index));
        if let (Some(slot), Setting::Int(value)) = (slot, value) {
            *slot = value;
        }
    }

    fn drive_safe_outputs(&mut self) {
        self.made_safe += 1;
    }

    fn safe_lines(&self) -> &SafeLines {
        &self.lines
    }

    fn resume(&mut self, _: &[u8]) -> Result<(), CheckpointError> {
        Err(CheckpointError::NoCheckpoint)
    }

    // What the run does not use.

    fn checkpoint(&self) -> Vec<u8> {
        vec![]
    }

    fn state_into(&self, _: &mut Vec<u8>) {}

    fn compared_ranges(&self) -> Vec<Range<u32>> {
        vec![]
    }

    fn clock_decisions(&self) -> &[ClockDecision] {
        &[]
    }

    fn follow_clock(&mut self, _: Option<&[ClockDecision]>) {}

    fn retained_into(&self, _: &mut Vec<u8>) -> bool {
        false
    }

    fn retained_revision(&self) -> Option<u64> {
        None
    }

    fn restore(&mut self, _: &[u8]) -> Result<Restored, String> {
        Ok(Restored::default())
    }

    fn shortest_time_limit(&self) -> Option<Duration> {
        None
    }

    fn set_watchdog(&mut self, _: Watchdog) {}

    fn image(&self) -> &[u8] {
        &[]
    }

    fn set_image(&mut self, _: &[u8]) {}

    fn set_safe_lines(&mut self, _: SafeLines) {}

    fn force(&mut self, _: VariableKey, _: Option<Setting>) -> Result<(), &'static str> {
        Err("can't be forced")
    }

    fn each_force(&self, _: &mut dyn FnMut(VariableKey, Setting)) {}

    fn is_held(&self, _: VariableKey) -> bool {
        false
    }

    fn each_deferred_assignment(&self, _: &mut dyn FnMut(DeferredAssignment<'_>)) {}

    fn task_statuses(&self) -> Vec<TaskStatus> {
        vec![]
    }

    fn fingerprint(&self) -> u64 {
        0
    }

    fn used_ranges(&self) -> Vec<Range<u32>> {
        vec![]
    }

    fn take_over(&mut self, _: &mut dyn Executive, _: &Plan) -> TakeOver {
        TakeOver::Impossible
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }
}
