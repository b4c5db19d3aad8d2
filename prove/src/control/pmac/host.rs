//! What program code may ask a PMAC for (`runtime/src/pmac/host.rs`), and the state of its PLCs (`state.rs`). That state lies
//! behind the process image here, so that it goes the same ways as the image.

use std::cell::{Cell, RefCell};

use plcc_abi::HostFn;
use plcc_abi::pmac::layout::{CONTEXTS, WORD_SIZE};
use plcc_abi::pmac::{
    CommandStep, Definition, Kind, Layout, Place, PlcOp, PmacName, PmacTables, Program, Range,
    Space, Text, Variable, motion::registers,
};

use super::places::{self, Bits, Coded};
use crate::logic::{FALSE, Graph, Lit, Memory, TRUE};
use crate::scan::{Builder, Reason, number as constant_of, pmac_range};

/// Bytes of the state of a PLC: flags, and two bytes for where it goes on.
const STATE_SIZE: usize = 4;
const ENABLED: u8 = 0;
const PAUSED: u8 = 1;
const RESTART: u8 = 2;
/// Bits of the number of the place at which a PLC goes on.
const RESUME_BITS: usize = 16;

/// A command that waits for the end of the background step.
#[derive(Debug)]
pub(super) struct Queued {
    pub(super) cond: Lit,
    /// The tasks that it runs.
    pub(super) tasks: Vec<u32>,
    /// The first Q-variable of the coordinate system that its PLC addresses.
    pub(super) q_base: Vec<Lit>,
}

/// A PMAC as its programs see it.
#[derive(Debug)]
pub(crate) struct Pmac {
    pub(super) layout: Layout,
    /// The PLCs and PLCCs.
    pub(super) programs: Vec<Program>,
    l: Vec<(u32, Definition)>,
    ranges: Vec<(u32, Range)>,
    /// For each text the tasks that it runs, if it is a command.
    commands: Vec<Vec<u32>>,
    /// Where the states of the PLCs begin.
    states: usize,
    /// The context of what is running.
    pub(super) running: Cell<u32>,
    pub(super) queue: RefCell<Vec<Queued>>,
}

impl Pmac {
    pub(super) fn new(tables: &PmacTables, layout: Layout) -> Self {
        let command = |text: &Text| match text {
            Text::Command { error: None, steps, .. } => {
                let tasks = steps.iter().filter_map(|step| match step {
                    CommandStep::Task(task) => Some(*task),
                    // Nothing moves where motors are not simulated.
                    CommandStep::Motion(_) => None,
                });
                tasks.collect()
            }
            _ => vec![],
        };
        Self {
            layout,
            programs: tables.programs.clone(),
            l: tables.l.clone(),
            ranges: tables.ranges.clone(),
            commands: tables.texts.iter().map(command).collect(),
            states: (layout.size as usize).next_multiple_of(64),
            running: Cell::new(0),
            queue: RefCell::default(),
        }
    }

    /// The size of the image with the states behind it.
    pub(super) fn size(&self) -> usize {
        self.states + STATE_SIZE * self.programs.len()
    }

    /// The tasks that commands run.
    pub(super) fn command_tasks(&self) -> impl Iterator<Item = usize> {
        self.commands.iter().flatten().map(|task| *task as usize)
    }

    pub(super) fn state_at(&self, plc: usize) -> usize {
        self.states + STATE_SIZE * plc
    }

    fn resume_at(&self, plc: usize) -> usize {
        self.state_at(plc) + 2
    }

    /// The states after load.
    pub(super) fn power_up(&self, memory: &mut Memory) {
        for (at, plc) in self.programs.iter().enumerate() {
            let state = self.state_at(at);
            memory.set_bit(state, ENABLED, Lit::constant(plc.enabled));
            memory.set_bit(state, PAUSED, Lit::constant(!plc.enabled && plc.paused));
        }
    }

    pub(super) fn is_enabled(&self, memory: &Memory, plc: usize) -> Lit {
        memory.bit(self.state_at(plc), ENABLED)
    }

    /// Begins a scan of a PLC, and gives the conditions on which it begins at the top and on which it goes on at each of
    /// `points` resume points.
    pub(super) fn begin(
        &self,
        graph: &mut Graph,
        memory: &mut Memory,
        plc: usize,
        cond: Lit,
        points: usize,
    ) -> Vec<Lit> {
        let (state, resume) = (self.state_at(plc), memory.load(self.resume_at(plc), 2));
        let goes_on = graph.and(cond, !memory.bit(state, RESTART));
        let mut all = vec![FALSE];
        for point in 1..=points as i64 {
            let number = graph.number(RESUME_BITS, point);
            let is_this = graph.equal(&resume, &number);
            all.push(graph.and(goes_on, is_this));
        }
        let elsewhere = graph.any(all.iter().copied());
        if let Some(top) = all.first_mut() {
            *top = graph.and(cond, !elsewhere);
        }
        memory.set_bit(state, RESTART, FALSE);
        memory.store(self.resume_at(plc), &graph.number(RESUME_BITS, 0));
        all
    }

    /// Notes that the scan of a task is suspended at a resume point.
    pub(crate) fn suspend(&self, graph: &Graph, memory: &mut Memory, task: usize, point: usize) {
        let plc = self.programs.iter().position(|plc| plc.task as usize == task);
        if let Some(plc) = plc {
            memory.store(self.resume_at(plc), &graph.number(RESUME_BITS, point as i64 + 1));
        }
    }

    /// Enables, disables, pauses or resumes PLCs.
    fn apply(&self, graph: &mut Graph, memory: &mut Memory, op: PlcOp, plc: usize) {
        let state = self.state_at(plc);
        let (enabled, paused) = (memory.bit(state, ENABLED), memory.bit(state, PAUSED));
        let (enabled, paused) = match op {
            PlcOp::Enable => {
                memory.set_bit(state, RESTART, TRUE);
                (TRUE, FALSE)
            }
            PlcOp::Disable => (FALSE, FALSE),
            PlcOp::Pause => (FALSE, graph.or(enabled, paused)),
            PlcOp::Resume => (graph.or(enabled, paused), FALSE),
        };
        memory.set_bit(state, ENABLED, enabled);
        memory.set_bit(state, PAUSED, paused);
    }

    /// A call of a function of the control on a condition. Gives its result.
    pub(crate) fn call(
        &self,
        builder: &mut Builder,
        cond: Lit,
        memory: &mut Memory,
        (function, args): (HostFn, &[Vec<Lit>]),
        reason: &Reason,
    ) -> Vec<Lit> {
        let constant =
            |at: usize| args.get(at).and_then(|bits| constant_of(bits)).map(|number| number as u32);
        let value = |at: usize| args.get(at).map_or(&[][..], Vec::as_slice);
        let escape = |builder: &mut Builder, text: &str| {
            let reason = builder.reason(Reason { text: text.to_owned(), ..reason.clone() });
            builder.escapes.push((cond, reason));
        };
        match function {
            HostFn::PmacMRead => {
                let bits = constant(0).and_then(|number| self.m(memory, number));
                let found = bits.and_then(|bits| read(&mut builder.graph, memory, &bits));
                found.unwrap_or_else(|| {
                    let text = MEMORY.to_owned();
                    builder.unknown(64, Reason { text, ..reason.clone() })
                })
            }
            HostFn::PmacMWrite => {
                match constant(0).and_then(|number| self.m(memory, number)) {
                    Some(bits) => write(builder, memory, &bits, value(1), reason),
                    None => escape(builder, MEMORY),
                }
                vec![]
            }
            HostFn::PmacWordRead => {
                let text = MEMORY.to_owned();
                let mut word = builder.unknown(24, Reason { text, ..reason.clone() });
                word.resize(32, FALSE);
                word
            }
            HostFn::PmacWordWrite => {
                let space = constant(0).map(|it| if it == 0 { Space::X } else { Space::Y });
                match space.zip(constant(1)).map(|(it, address)| self.layout.place(it, address)) {
                    // Whatever is read there may be anything.
                    Some(Place::Sparse) => {}
                    Some(Place::Word(offset)) => {
                        let word: Vec<Lit> = value(2).iter().copied().take(24).collect();
                        memory.store(offset as usize, &word);
                    }
                    _ => escape(builder, MEMORY),
                }
                vec![]
            }
            HostFn::PmacIWrite => {
                match constant(0) {
                    Some(number) => self.write_i(builder, memory, number, value(1), reason),
                    None => escape(builder, "assigns to an I-variable whose number is computed"),
                }
                vec![]
            }
            HostFn::PmacPlc => {
                let op = constant(0).and_then(PlcOp::from_number);
                let rest = (constant(1), constant(2), constant(3));
                let (Some(op), (Some(compiled), Some(first), Some(last))) = (op, rest) else {
                    escape(builder, "enables PLCs whose numbers are computed");
                    return vec![];
                };
                for (at, plc) in self.programs.iter().enumerate() {
                    if plc.compiled == (compiled != 0) && (first..=last).contains(&plc.number) {
                        self.apply(&mut builder.graph, memory, op, at);
                    }
                }
                vec![]
            }
            HostFn::PmacEvent => {
                let tasks = constant(0).and_then(|text| self.commands.get(text as usize));
                if let Some(tasks) = tasks.filter(|tasks| !tasks.is_empty()) {
                    let at = self.layout.q_base_at(self.running.get()) as usize;
                    let (tasks, q_base) = (tasks.clone(), memory.load(at, WORD_SIZE as usize));
                    self.queue.borrow_mut().push(Queued { cond, tasks, q_base });
                }
                vec![]
            }
            // What is kept comes back at the next power-up.
            HostFn::PmacSave => vec![],
            HostFn::PmacAddressMotor => {
                if let Some(context) = constant(0).filter(|context| *context < CONTEXTS) {
                    let at = self.layout.motor_at(context) as usize;
                    let last = f64::from(registers::motors(self.layout.controller));
                    match constant_of(value(1)).map(|bits| f64::from_bits(bits as u64)) {
                        Some(motor) if (0.5..last + 0.5).contains(&motor) => {
                            memory.store(at, &builder.graph.number(32, motor.round() as i64));
                        }
                        Some(_) => {}
                        None => {
                            let motor = builder.unknown(6, reason.clone());
                            memory.store(at, &builder.graph.resize(&motor, 32, FALSE));
                        }
                    }
                }
                vec![]
            }
            HostFn::PmacRangeWrite => {
                let kind = constant(0).and_then(Kind::from_number);
                let (Some(kind), Some(first), Some(count)) = (kind, constant(1), constant(2))
                else {
                    escape(builder, "assigns to a range of another coordinate system");
                    return vec![];
                };
                let (count, step) = (count & 0xFFFF, count >> 16);
                let finite = builder.graph.finite(value(3));
                for number in (0..count).map(|k| first.wrapping_add(k * step)) {
                    let bits = match kind {
                        Kind::I => {
                            self.write_i(builder, memory, number, &finite, reason);
                            continue;
                        }
                        Kind::M => self.m(memory, number),
                        Kind::P => Some(places::double(self.layout.p_offset(number))),
                        Kind::Q => Some(places::double(self.layout.q_offset(number))),
                        Kind::L => self.l(number),
                    };
                    match bits {
                        Some(bits) => write(builder, memory, &bits, &finite, reason),
                        None => escape(builder, MEMORY),
                    }
                }
                vec![]
            }
            HostFn::PmacDefine => {
                escape(builder, "defines an M-variable anew");
                vec![]
            }
            _ => {
                escape(builder, &reason.text);
                let width = match function {
                    HostFn::PmacStatement | HostFn::PmacMotionReady | HostFn::PmacMotion => 32,
                    _ => 0,
                };
                builder.unknown(width, reason.clone())
            }
        }
    }

    /// The bits of an M-variable, as it is defined; `None` where that is not known, or they are not words of the image.
    fn m(&self, memory: &Memory, number: u32) -> Option<Bits> {
        let number = number & (self.layout.count - 1);
        let at = self.layout.definition_offset(number) as usize;
        let kind = constant_of(&memory.load(at + 4, 4))? as u32 as u64;
        let definition = match Definition::decode(kind << 32) {
            Definition::Star => Definition::Star,
            _ => {
                let low = constant_of(&memory.load(at, 4))? as u32 as u64;
                Definition::decode(kind << 32 | low)
            }
        };
        places::bits(&self.layout, Some(number), definition)
    }

    fn l(&self, number: u32) -> Option<Bits> {
        let at = self.l.binary_search_by_key(&number, |(number, _)| *number).ok()?;
        places::bits(&self.layout, None, self.l.get(at)?.1)
    }

    fn write_i(
        &self,
        builder: &mut Builder,
        memory: &mut Memory,
        number: u32,
        value: &[Lit],
        reason: &Reason,
    ) {
        let number = number & (self.layout.count - 1);
        let range = self.ranges.binary_search_by_key(&number, |(number, _)| *number).ok();
        let range = range.and_then(|at| self.ranges.get(at)).map(|(_, range)| *range);
        let at = self.layout.i_offset(number) as usize;
        let graph = &mut builder.graph;
        let finite = stored(graph, value);
        let (found, known) = match (range, constant_of(value)) {
            (Some(range), Some(bits)) => {
                let value = range.convert(f64::from_bits(bits as u64));
                (graph.number(64, value.to_bits() as i64), TRUE)
            }
            (None, _) => (finite, TRUE),
            (Some(Range::Integer(low, high)), None) => pmac_range(graph, value, low, high),
            (Some(Range::Real(low, high)), None) => {
                let (low, high) = (low.to_bits() as i64, high.to_bits() as i64);
                let (low, high) = (graph.number(64, low), graph.number(64, high));
                let (_, below, _) = graph.compare_floats(&finite, &low);
                let (_, above, _) = graph.compare_floats(&high, &finite);
                let inside = graph.and(!below, !above);
                (finite, inside)
            }
        };
        let open = match known {
            TRUE => found.clone(),
            _ => builder.unknown(64, reason.clone()),
        };
        let new = builder.graph.choose_bits(known, &found, &open);
        memory.store(at, &new);
    }

    /// The value of a variable, by its name, as a double; `None` where it is not known.
    pub(crate) fn value(&self, graph: &mut Graph, memory: &Memory, name: &str) -> Option<Vec<Lit>> {
        let bits = match PmacName::parse(name, &self.layout).ok()? {
            PmacName::Plc { compiled, number } => {
                let is_it = |plc: &Program| plc.compiled == compiled && plc.number == number;
                let plc = self.programs.iter().position(is_it)?;
                let state = self.state_at(plc);
                let state = [memory.bit(state, ENABLED), memory.bit(state, PAUSED), FALSE];
                return Some(graph.float_of_int(&state));
            }
            PmacName::Memory(definition) => places::bits(&self.layout, None, definition)?,
            PmacName::Variable(Variable { kind, number, system }) => match kind {
                Kind::P => places::double(self.layout.p_offset(number)),
                Kind::I => places::double(self.layout.i_offset(number)),
                Kind::Q => {
                    places::double(self.layout.q_offset(self.layout.q_base_of(system) + number))
                }
                Kind::M => self.m(memory, number)?,
                Kind::L => self.l(number)?,
            },
            PmacName::Motion(_) => return None,
        };
        read(graph, memory, &bits)
    }
}

const MEMORY: &str = "names memory that is not followed";

/// A double that a variable can hold: finite and not -0.
fn stored(graph: &mut Graph, value: &[Lit]) -> Vec<Lit> {
    let mut value = graph.finite(value);
    let (sign, rest) = value.split_last().map_or((FALSE, &[][..]), |(sign, rest)| (*sign, rest));
    let is_not_zero = graph.is_not_zero(rest);
    if let Some(slot) = value.last_mut() {
        *slot = graph.and(sign, is_not_zero);
    }
    value
}

/// The value of bits as a double.
pub(super) fn read(graph: &mut Graph, memory: &Memory, bits: &Bits) -> Option<Vec<Lit>> {
    let places = bits.places.iter();
    let mut found: Vec<Lit> =
        places.map(|&(offset, bit)| memory.bit(offset as usize, bit)).collect();
    match bits.coded {
        Coded::Double => return Some(found),
        Coded::Signed => {}
        Coded::Unsigned => found.push(FALSE),
        Coded::Decimal(complemented) => {
            let mut sum = graph.number(26, 0);
            for digit in found.chunks(4).rev() {
                let digit: Vec<Lit> =
                    digit.iter().map(|bit| bit.complement_if(complemented)).collect();
                let ten = graph.number(26, 10);
                let tens = graph.multiply(&sum, &ten);
                let digit = graph.resize(&digit, 26, FALSE);
                sum = graph.add(&tens, &digit);
            }
            found = sum;
        }
        Coded::Other => return None,
    }
    Some(graph.float_of_int(&found))
}

/// Gives bits a value, which is a double.
fn write(builder: &mut Builder, memory: &mut Memory, bits: &Bits, value: &[Lit], reason: &Reason) {
    let new = match bits.coded {
        Coded::Double => stored(&mut builder.graph, value),
        Coded::Signed | Coded::Unsigned => builder.graph.bits_of_float(value),
        Coded::Decimal(_) | Coded::Other => builder.unknown(bits.places.len(), reason.clone()),
    };
    for (&(offset, bit), lit) in bits.places.iter().zip(new) {
        memory.set_bit(offset as usize, bit, lit);
    }
}
