//! What program code may call while it runs.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use plcc_abi::{
    Host, HostFn,
    image::{read_f64, read_u32, write_f64, write_u32},
    pmac::{
        CommandStep, Definition, Kind, Layout, MOTION_CONTEXT, Memory, PlcOp, PmacTables, Space,
        Text, View, arithmetic::finite, expression, pure_functions,
    },
};

use crate::{DisplayedText, Event, EventBody};

use super::motion::Motion;
use super::save::Origin;
use super::state::{MAX_QUEUED, Queued, State, Status};

/// A [`Text`], prepared so that its statement need not allocate.
pub(super) enum PreparedText {
    /// The same event every time.
    Always(EventBody),
    /// A value is shown.
    Value { position: u32, width: u32, decimals: u32 },
    /// A command is queued.
    Queue { body: EventBody, steps: Vec<PreparedStep> },
}

/// A part of what a command does.
#[derive(Clone, Copy)]
pub(super) enum PreparedStep {
    /// A task is run.
    Task(u32),
    /// A command for motors or coordinate systems, by its index in the tables.
    Motion(u32),
}

impl PreparedText {
    /// A text's preparation. Commands for motors do nothing where these are not simulated.
    fn new(text: &Text, simulated: bool) -> Self {
        let shared = |text: &Option<String>| text.as_deref().map(Into::into);
        Self::Always(match text {
            Text::Send { text, port } => {
                EventBody::Send { text: text.as_str().into(), port: shared(port) }
            }
            Text::Show { text, position } => EventBody::Display {
                text: text.as_str().into(),
                position: Some(i64::from(*position)),
            },
            &Text::Value { position, width, decimals } => {
                return Self::Value { position, width, decimals };
            }
            Text::Command { text, error, steps } => {
                let body = EventBody::Command { text: text.as_str().into(), error: shared(error) };
                let prepare = |step: &CommandStep| match *step {
                    CommandStep::Task(task) => Some(PreparedStep::Task(task)),
                    CommandStep::Motion(command) => {
                        simulated.then_some(PreparedStep::Motion(command))
                    }
                };
                let steps: Vec<PreparedStep> = steps.iter().filter_map(prepare).collect();
                if error.is_none() && !steps.is_empty() {
                    return Self::Queue { body, steps };
                }
                body
            }
            Text::Macro { text } => EventBody::Macro { text: text.as_str().into() },
        })
    }
}

/// Variables of one kind: `count` of them from number `first` on, `step` apart.
struct VariableRange {
    kind: Kind,
    first: u32,
    /// At most 65 535, as `step`.
    count: u32,
    step: u32,
}

/// A number that was not given before in this process.
pub(super) fn next_revision() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

/// The number of operations of the longest statement that the host executes.
fn longest(tables: &PmacTables) -> usize {
    tables.statements.iter().map(|statement| statement.value.len()).max().unwrap_or(0)
}

/// A PMAC without its image: the tables, the state, and what a tick produces.
pub(super) struct PmacHost {
    pub(super) tables: PmacTables,
    /// The texts of the tables, in their order.
    texts: Vec<PreparedText>,
    pub(super) layout: Layout,
    pub(super) state: State,
    /// The operands of the expression that is evaluated; kept here so that no scan allocates.
    operands: Vec<f64>,
    /// The context of what is running; set before each scan.
    pub(super) running: u32,
    /// The events of this tick so far.
    pub(super) events: Vec<Event>,
    /// This download, as it is noted in what it saves.
    pub(super) origin: Arc<Origin>,
    /// Another number whenever what SAVE keeps may have changed.
    pub(super) saved_revision: u64,
    /// The simulation of motors and coordinate systems, whose state is in `state`.
    pub(super) motion: Option<Motion>,
    /// What is to be said of the run, not of the program.
    pub(super) notes: Vec<String>,
}

impl PmacHost {
    pub(super) fn new(tables: PmacTables, layout: Layout) -> Self {
        let origin = Arc::new(Origin::new(&tables));
        Self {
            origin,
            state: State::new(&tables, &layout),
            operands: Vec::with_capacity(longest(&tables)),
            texts: tables.texts.iter().map(|text| PreparedText::new(text, false)).collect(),
            tables,
            layout,
            running: 0,
            events: Vec::with_capacity(64),
            saved_revision: next_revision(),
            motion: None,
            notes: Vec::new(),
        }
    }

    /// Prepares the texts anew, for a control whose motors are simulated.
    pub(super) fn prepare_texts(&mut self) {
        let texts = &self.tables.texts;
        self.texts = texts.iter().map(|text| PreparedText::new(text, true)).collect();
    }

    /// A part of what the command with this text does.
    pub(super) fn step(&self, text: u32, index: usize) -> Option<PreparedStep> {
        let Some(PreparedText::Queue { steps, .. }) = self.texts.get(text as usize) else {
            return None;
        };
        steps.get(index).copied()
    }

    fn view<'a>(&'a self, image: &'a [u8]) -> View<'a> {
        View { image, layout: &self.layout, sparse: &self.state.sparse }
    }

    fn memory<'a>(&'a mut self, image: &'a mut [u8]) -> Memory<'a> {
        Memory { image, layout: &self.layout, sparse: &mut self.state.sparse }
    }

    /// Assigns to an I-variable.
    pub(super) fn write_i(&self, image: &mut [u8], number: u32, value: f64) {
        let number = number & (self.layout.count - 1);
        let ranges = &self.tables.ranges;
        let value = match ranges.binary_search_by_key(&number, |(number, _)| *number) {
            Ok(index) => ranges.get(index).map_or(value, |(_, range)| range.convert(value)),
            Err(_) => value,
        };
        write_f64(image, self.layout.i_offset(number), finite(value));
    }

    /// An L-variable's definition; `*` where it has none.
    pub(super) fn l_definition(&self, number: u32) -> Definition {
        let l = &self.tables.l;
        match l.binary_search_by_key(&number, |(number, _)| *number) {
            Ok(index) => l.get(index).map_or(Definition::Star, |(_, definition)| *definition),
            Err(_) => Definition::Star,
        }
    }

    /// What the last SAVE kept.
    pub(super) fn saved(&self) -> Option<&[u8]> {
        self.state.saved.exists.then_some(&self.state.saved.image)
    }

    /// Keeps the regions `p q i mdef` of an image. It may end after them.
    pub(super) fn save(&mut self, image: &[u8]) {
        let saved = &mut self.state.saved;
        if let Some(now) = image.get(..saved.image.len()) {
            saved.image.copy_from_slice(now);
            saved.exists = true;
            saved.origin = None;
            self.saved_revision = next_revision();
        }
    }

    /// Enables, disables, pauses or resumes the PLCs from `first` to `last`.
    pub(super) fn command_plcs(&mut self, op: PlcOp, compiled: bool, first: u32, last: u32) {
        let plcs = if compiled { &mut self.state.plccs } else { &mut self.state.plcs };
        for number in first..=last.min(31) {
            plcs.apply(op, number);
        }
    }

    /// The state of a PLC as users see it: 0 disabled (or there is none), 1 enabled, 2 paused.
    pub(super) fn plc_status(&self, compiled: bool, number: u32) -> f64 {
        let plcs = if compiled { &self.state.plccs } else { &self.state.plcs };
        match plcs.all().get(number as usize).map(|plc| plc.status) {
            Some(Status::Enabled) => 1.0,
            Some(Status::Paused) => 2.0,
            Some(Status::Disabled | Status::Absent) | None => 0.0,
        }
    }

    /// SEND, DISPLAY, COMMAND, or a write to the MACRO ring.
    fn emit_event(&mut self, image: &[u8], index: u32, value: f64) {
        let Some(text) = self.texts.get(index as usize) else {
            return;
        };
        let body = match text {
            PreparedText::Always(body) => body.clone(),
            PreparedText::Value { position, width, decimals } => EventBody::Display {
                text: DisplayedText::Value { value, width: *width, decimals: *decimals },
                position: Some(i64::from(*position)),
            },
            PreparedText::Queue { body, .. } => {
                if self.state.queue.len() < MAX_QUEUED {
                    let q_base = read_u32(image, self.layout.q_base_at(self.running));
                    let motor = match &self.motion {
                        None => 0,
                        Some(motion) if self.running == MOTION_CONTEXT => self
                            .state
                            .motion
                            .as_ref()
                            .map_or(1, |state| state.lowest_motor(motion.running)),
                        Some(_) => read_u32(image, self.layout.motor_at(self.running)),
                    };
                    self.state.queue.push_back(Queued { text: index, motor, q_base });
                }
                body.clone()
            }
        };
        self.events.push(Event { tick: self.state.tick, body });
    }

    /// Assigns a value to `count` variables of a kind, in the order of their numbers from `first`
    /// on, `step` apart. A Q's number is that among the variables of all coordinate systems.
    fn write_range(&mut self, image: &mut [u8], range: VariableRange, value: f64) {
        let VariableRange { kind, first, count, step } = range;
        let value = finite(value);
        for k in 0..count {
            self.write(image, kind, first.wrapping_add(k * step), value);
        }
    }

    /// Assigns a finite value to a variable. A Q's number is that among the variables of all coordinate
    /// systems.
    fn write(&mut self, image: &mut [u8], kind: Kind, number: u32, value: f64) {
        match kind {
            Kind::P => write_f64(image, self.layout.p_offset(number), value),
            Kind::Q => write_f64(image, self.layout.q_offset(number), value),
            Kind::I => self.write_i(image, number, value),
            Kind::M => self.memory(image).write_m(number, value),
            Kind::L => {
                let definition = self.l_definition(number);
                self.memory(image).write(definition, value);
            }
        }
    }

    /// Executes a statement by the definitions of M-variables as they are now, by its index in the
    /// tables. Returns whether a condition holds; `false` for an assignment.
    fn statement(&mut self, image: &mut [u8], index: u32) -> bool {
        let Some(statement) = self.tables.statements.get(index as usize) else {
            return false;
        };
        let mut operands = std::mem::take(&mut self.operands);
        let target = statement.target;
        let layout = &self.layout;
        let first_q = read_u32(image, layout.q_base_at(self.running));
        let radians = read_f64(image, layout.i_offset(15)) != 0.0;
        let view = self.view(image);
        let mut read = |kind, number: u32| match kind {
            Kind::P => read_f64(image, layout.p_offset(number)),
            Kind::Q => read_f64(image, layout.q_offset(first_q.wrapping_add(number))),
            Kind::I => read_f64(image, layout.i_offset(number)),
            Kind::M => view.read_m(number),
            Kind::L => view.read(self.l_definition(number)),
        };
        let value = expression::evaluate(&statement.value, &mut operands, radians, &mut read);
        self.operands = operands;
        match target {
            None => value != 0.0,
            Some((kind, number)) => {
                let first = if kind == Kind::Q { first_q } else { 0 };
                self.write(image, kind, first.wrapping_add(u32::from(number)), finite(value));
                false
            }
        }
    }

    /// Carries out a definition of M-variables that the program makes, by its index in the tables.
    fn define(&mut self, image: &mut [u8], index: u32) {
        let Some(define) = self.tables.defines.get(index as usize).copied() else {
            return;
        };
        let last = define.last.min(self.layout.count - 1);
        let mut memory = self.memory(image);
        for number in define.first..=last {
            memory.define(number, define.definition);
        }
    }
}

/// The space of an argument: 0 is X, all others are Y.
fn space(number: u64) -> Space {
    if number as u32 == 0 { Space::X } else { Space::Y }
}

impl Host for PmacHost {
    fn call(&mut self, image: &mut [u8], function: HostFn, args: [u64; 4]) -> u64 {
        let [a, b, c, d] = args;
        match function {
            HostFn::Fmod => {
                let rest = libm::fmod(f64::from_bits(a), f64::from_bits(b));
                if rest.is_nan() { 0 } else { rest.to_bits() }
            }
            HostFn::PmacMRead => self.view(image).read_m(a as u32).to_bits(),
            HostFn::PmacMWrite => {
                self.memory(image).write_m(a as u32, f64::from_bits(b));
                0
            }
            HostFn::PmacWordRead => u64::from(self.view(image).read_word(space(a), b as u32)),
            HostFn::PmacWordWrite => {
                self.memory(image).write_word(space(a), b as u32, c as u32);
                0
            }
            HostFn::PmacIWrite => {
                self.write_i(image, a as u32, f64::from_bits(b));
                0
            }
            HostFn::PmacPlc => {
                if let Some(op) = PlcOp::from_number(a as u32) {
                    self.command_plcs(op, b as u32 != 0, c as u32, d as u32);
                }
                0
            }
            HostFn::PmacEvent => {
                self.emit_event(image, a as u32, f64::from_bits(b));
                0
            }
            HostFn::PmacDefine => {
                self.define(image, a as u32);
                0
            }
            HostFn::PmacSave => {
                self.save(image);
                0
            }
            HostFn::PmacMotionReady => {
                let ready = self.with_motion(image, |machine| machine.ready(a as u32));
                u64::from(ready.unwrap_or(true))
            }
            HostFn::PmacMotionValue => {
                self.with_motion(image, |machine| machine.value(f64::from_bits(a)));
                0
            }
            HostFn::PmacMotion => {
                let suspends = self.with_motion(image, |machine| machine.execute(a as u32));
                u64::from(suspends.unwrap_or(true))
            }
            HostFn::PmacAddressMotor => {
                let number = f64::from_bits(b);
                let last =
                    f64::from(plcc_abi::pmac::motion::registers::motors(self.layout.controller));
                if (0.5..last + 0.5).contains(&number)
                    && (a as u32) < plcc_abi::pmac::layout::CONTEXTS
                {
                    let offset = self.layout.motor_at(a as u32);
                    write_u32(image, offset, number.round() as u32);
                }
                0
            }
            HostFn::PmacStatement => u64::from(self.statement(image, a as u32)),
            HostFn::PmacRangeWrite => {
                if let Some(kind) = Kind::from_number(a as u32) {
                    let (count, step) = (c as u32 & 0xFFFF, c as u32 >> 16);
                    let range = VariableRange { kind, first: b as u32, count, step };
                    self.write_range(image, range, f64::from_bits(d));
                }
                0
            }
            _ => pure_functions::call(function, args).unwrap_or(0),
        }
    }
}
