//! What program code may ask of a PMAC while it runs.

use std::collections::VecDeque;

use plcc_abi::{
    Host, HostFn, ResumePoint,
    image::{read_u32, write_f64},
    pmac::{
        Definition, Far, Layout, Memory, PlcOp, PmacTables, Run, Space, Text, View, math::finite,
        pure_functions,
    },
};

use crate::{DisplayedText, Event, EventBody};

/// What becomes of a PLC when its turn comes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Status {
    /// There is none, or it is empty.
    #[default]
    Absent,
    /// It is passed over.
    Disabled,
    /// It runs.
    Enabled,
    /// It is passed over until RESUME.
    Paused,
}

/// A PLC or PLCC.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plc {
    pub(super) status: Status,
    /// ENABLE was said since its last scan began, so the next one begins at the top.
    pub(super) restart: bool,
    pub(super) task: usize,
    /// Where its last scan was suspended; `None` when the next begins at the top.
    pub(super) resume: Option<ResumePoint>,
}

/// What becomes of all PLCs, or all PLCCs, by number. `enabled` says the same as the states, so
/// that the next in turn is found at once.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plcs {
    plcs: [Plc; 32],
    enabled: u32,
}

impl Plcs {
    /// The first that runs, from a number on.
    pub(super) fn next(&self, from: u32) -> Option<u32> {
        let bits = self.enabled.checked_shr(from)?;
        (bits != 0).then(|| from + bits.trailing_zeros())
    }

    pub(super) fn get_mut(&mut self, number: u32) -> Option<&mut Plc> {
        self.plcs.get_mut(number as usize)
    }

    /// Puts a PLC in its place.
    fn put(&mut self, number: u32, plc: Plc) {
        if let Some(slot) = self.plcs.get_mut(number as usize) {
            *slot = plc;
            self.note(number);
        }
    }

    fn note(&mut self, number: u32) {
        let runs = self.plcs.get(number as usize).is_some_and(|p| p.status == Status::Enabled);
        let bit = 1_u32.checked_shl(number).unwrap_or(0);
        self.enabled = if runs { self.enabled | bit } else { self.enabled & !bit };
    }

    /// ENABLE to RESUME of one.
    fn apply(&mut self, op: PlcOp, number: u32) {
        let Some(plc) = self.plcs.get_mut(number as usize) else {
            return;
        };
        match (op, plc.status) {
            (_, Status::Absent) => {}
            (PlcOp::Enable, _) => {
                plc.status = Status::Enabled;
                plc.restart = true;
            }
            (PlcOp::Disable, _) => plc.status = Status::Disabled,
            (PlcOp::Pause, Status::Enabled) => plc.status = Status::Paused,
            (PlcOp::Resume, Status::Paused) => plc.status = Status::Enabled,
            (PlcOp::Pause | PlcOp::Resume, _) => {}
        }
        self.note(number);
    }
}

/// Commands that wait at most, for runs without background steps: more of them are lost.
const QUEUE: usize = 1 << 16;

/// A command that waits for its turn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Queued {
    pub(super) task: u32,
    /// The Q-variables of the coordinate system that its PLC addressed.
    pub(super) q_base: u32,
}

/// What becomes of a [`Text`] when its statement runs.
pub(super) enum Said {
    /// The same event every time.
    Always(EventBody),
    /// A value is shown.
    Value { position: u32, width: u32, decimals: u32 },
    /// A command is queued.
    Queue { body: EventBody, task: u32 },
}

impl Said {
    fn new(text: &Text) -> Self {
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
            Text::Command { text, error, task } => {
                let body = EventBody::Command { text: text.as_str().into(), error: shared(error) };
                match (error, task) {
                    (None, Some(task)) => return Self::Queue { body, task: *task },
                    _ => body,
                }
            }
            Text::Macro { text } => EventBody::Macro { text: text.as_str().into() },
        })
    }
}

/// A PMAC but for its image.
pub(super) struct Control {
    pub(super) tables: PmacTables,
    /// What the texts of the tables come to, in their order.
    pub(super) said: Vec<Said>,
    pub(super) layout: Layout,
    pub(super) far: Far,
    pub(super) plcs: Plcs,
    pub(super) plccs: Plcs,
    pub(super) queue: VecDeque<Queued>,
    /// The context of what is running.
    pub(super) running: u32,
    /// The tick's number.
    pub(super) tick: u64,
    pub(super) events: Vec<Event>,
    /// What the last SAVE kept: the image's regions `p q i mdef`. There is room for it from the
    /// start, so that SAVE is nothing but copying.
    kept: Vec<u8>,
    /// Whether there was one.
    is_kept: bool,
}

impl Control {
    pub(super) fn new(tables: PmacTables, layout: Layout) -> Self {
        let (mut plcs, mut plccs) = (Plcs::default(), Plcs::default());
        for program in &tables.programs {
            let status = match (program.enabled, program.paused) {
                (true, _) => Status::Enabled,
                (false, true) => Status::Paused,
                (false, false) => Status::Disabled,
            };
            let task = program.task as usize;
            let plc = Plc { status, restart: false, task, resume: None };
            if program.compiled { &mut plccs } else { &mut plcs }.put(program.number, plc);
        }
        let mut kept = vec![0; layout.mload as usize];
        if tables.save {
            Run::unpack(&tables.initial, &mut kept);
        }
        Self {
            kept,
            is_kept: tables.save,
            far: tables.far.clone(),
            said: tables.texts.iter().map(Said::new).collect(),
            tables,
            layout,
            plcs,
            plccs,
            queue: VecDeque::with_capacity(64),
            running: 0,
            tick: 0,
            events: Vec::with_capacity(64),
        }
    }

    fn view<'a>(&'a self, image: &'a [u8]) -> View<'a> {
        View { image, layout: &self.layout, far: &self.far }
    }

    fn memory<'a>(&'a mut self, image: &'a mut [u8]) -> Memory<'a> {
        Memory { image, layout: &self.layout, far: &mut self.far }
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
        self.is_kept.then_some(&self.kept)
    }

    /// Keeps what an image, or what is before `mload` in it, holds.
    pub(super) fn save(&mut self, image: &[u8]) {
        if let Some(now) = image.get(..self.kept.len()) {
            self.kept.copy_from_slice(now);
            self.is_kept = true;
        }
    }

    /// ENABLE to RESUME.
    fn command_plcs(&mut self, op: PlcOp, compiled: bool, first: u32, last: u32) {
        let plcs = if compiled { &mut self.plccs } else { &mut self.plcs };
        for number in first..=last.min(31) {
            plcs.apply(op, number);
        }
    }

    /// SEND, DISPLAY, COMMAND, or a write to the MACRO ring.
    fn tell(&mut self, image: &[u8], index: u32, value: f64) {
        let Some(said) = self.said.get(index as usize) else {
            return;
        };
        let body = match said {
            Said::Always(body) => body.clone(),
            Said::Value { position, width, decimals } => EventBody::Display {
                text: DisplayedText::Value { value, width: *width, decimals: *decimals },
                position: Some(i64::from(*position)),
            },
            Said::Queue { body, task } => {
                if self.queue.len() < QUEUE {
                    let q_base = read_u32(image, self.layout.q_base + 4 * self.running);
                    self.queue.push_back(Queued { task: *task, q_base });
                }
                body.clone()
            }
        };
        self.events.push(Event { tick: self.tick, body });
    }

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

fn space(number: u64) -> Space {
    if number as u32 == 0 { Space::X } else { Space::Y }
}

impl Host for Control {
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
                self.tell(image, a as u32, f64::from_bits(b));
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
            _ => pure_functions::call(function, args).unwrap_or(0),
        }
    }
}
