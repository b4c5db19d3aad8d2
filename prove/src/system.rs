//! A control with its program as a system of states: what it keeps from tick to tick, what comes from outside in each, and
//! what a tick makes of both.

use rustc_hash::FxHashMap;

use crate::logic::{Graph, Lit, Memory};
use crate::scan::Builder;

/// What a bit of the state is at power-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum First {
    /// This.
    Constant(bool),
    /// Anything: it was kept while the power was off.
    Free,
    /// The same as another bit that was kept, by that one's literal.
    As(Lit),
}

/// A bit that the control keeps from tick to tick.
#[derive(Clone, Copy, Debug)]
pub struct Latch {
    /// The input of the graph that is its value at the beginning of a tick.
    pub lit: Lit,
    /// What it is at power-up.
    pub first: First,
    /// What it is at the end of the tick.
    pub next: Lit,
    /// Where it lies in the process image, offset and bit, if it does.
    pub place: Option<(u32, u8)>,
}

/// How bits are a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Without a sign; one bit is 0 or 1.
    Unsigned,
    /// In two's complement.
    Signed,
    /// A double. It is finite, and what would be -0 is 0.
    Double,
}

/// A variable that comes from outside: in each tick, or at power-up.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Its name, as a stimulus takes it.
    pub name: String,
    /// Another name for it, which all programs of the control have in common.
    pub key: String,
    /// Its bits, the lowest first.
    pub bits: Vec<Lit>,
    /// How they are a number.
    pub form: Form,
    /// Whether the control puts it back to 0 in each tick, before it comes from outside.
    pub is_pulse: bool,
    /// The number that it is until something comes from outside.
    pub first: i64,
}

impl Variable {
    /// The number that its bits are.
    pub fn number(&self, value: impl Fn(Lit) -> bool) -> i64 {
        let bits = self.bits.iter().enumerate();
        let number = bits.fold(0_i64, |number, (place, &bit)| {
            number | i64::from(value(bit)).wrapping_shl(place as u32)
        });
        let spare = 64 - self.bits.len().clamp(1, 64) as u32;
        match self.form {
            Form::Unsigned => number,
            Form::Signed => number.wrapping_shl(spare).wrapping_shr(spare),
            Form::Double => {
                let special = 0x7FF_i64 << 52;
                let number = if number & special == special { number & !(1 << 52) } else { number };
                if number.wrapping_shl(1) == 0 { 0 } else { number }
            }
        }
    }

    /// The number as a stimulus has it; of a double it is its bits.
    pub fn text(&self, number: i64) -> String {
        match self.form {
            Form::Double => f64::from_bits(number as u64).to_string(),
            Form::Unsigned | Form::Signed => number.to_string(),
        }
    }
}

/// Something that the machine sees of a program, or that survives power-off.
#[derive(Clone, Debug)]
pub struct Observed {
    /// Its name.
    pub name: String,
    /// Whether it is kept while the power is off, rather than seen by the machine.
    pub is_retained: bool,
    /// Its bits: what each is called in all programs of the control, where it lies in the image, and its literal at the end of
    /// a tick.
    pub bits: Vec<(String, (u32, u8), Lit)>,
}

/// A time that is abstracted: what goes down to 0 by itself goes down by any amount in a tick.
#[derive(Clone, Debug)]
pub struct Elapse {
    /// Whether it runs at the beginning of the tick.
    pub running: Lit,
    /// Whether it is through in this tick.
    pub expires: Lit,
    /// Whether it runs at the end of the tick.
    pub runs_on: Lit,
    /// Whether it begins anew in the tick, and runs at its end.
    pub starts: Lit,
    /// How many ticks it takes from the tick that starts it.
    pub ticks: u64,
}

/// How exactly time is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Time {
    /// Tick by tick.
    Exact,
    /// A timer is off, runs, or is through; how long it runs is left open.
    Abstract,
}

/// A control with its program.
#[derive(Clone, Debug)]
pub struct System {
    /// The graph, and what of it is not known.
    pub builder: Builder,
    /// What is kept from tick to tick.
    pub latches: Vec<Latch>,
    /// What comes from outside in each tick.
    pub inputs: Vec<Variable>,
    /// What was kept while the power was off.
    pub retained: Vec<Variable>,
    /// The process image at the end of the tick.
    pub memory: Memory,
    /// Whether the program was still running at the beginning of the tick.
    pub running: Lit,
    /// Whether the program is stopped in this tick.
    pub stops: Lit,
    /// The times that are abstracted.
    pub elapses: Vec<Elapse>,
    /// What is seen of the program.
    pub observed: Vec<Observed>,
    /// Latches that are known to be always the same as others, by their nodes.
    pub same: FxHashMap<u32, Lit>,
}

impl System {
    /// The graph.
    pub fn graph(&mut self) -> &mut Graph {
        &mut self.builder.graph
    }

    /// The condition that the logic does not follow the program in this tick.
    pub fn escape(&mut self) -> Lit {
        let escapes: Vec<Lit> = self.builder.escapes.iter().map(|(lit, _)| *lit).collect();
        let any = self.builder.graph.any(escapes);
        self.builder.graph.and(any, self.running)
    }
}

/// A system that is being made.
#[derive(Debug, Default)]
pub(crate) struct Maker {
    pub(crate) builder: Builder,
    pub(crate) latches: Vec<Latch>,
    /// The latches that become what their bit of the image is at the end of a tick.
    image_bits: Vec<usize>,
    pub(crate) inputs: Vec<Variable>,
    pub(crate) retained: Vec<Variable>,
    pub(crate) elapses: Vec<Elapse>,
    pub(crate) observed: Vec<Observed>,
}

impl Maker {
    /// A latch; what it becomes is said later.
    pub(crate) fn latch(&mut self, first: First) -> (usize, Lit) {
        let lit = self.builder.graph.input();
        self.latches.push(Latch { lit, first, next: lit, place: None });
        (self.latches.len() - 1, lit)
    }

    /// Latches that are a number at power-up.
    pub(crate) fn latch_number(&mut self, width: usize, first: i64) -> (Vec<usize>, Vec<Lit>) {
        (0..width).map(|bit| self.latch(First::Constant(first >> bit.min(63) & 1 == 1))).unzip()
    }

    /// Says where a latch lies in the process image.
    pub(crate) fn lies_at(&mut self, latch: usize, offset: u32, bit: u8) {
        if let Some(latch) = self.latches.get_mut(latch) {
            latch.place = Some((offset, bit));
        }
    }

    /// Says what a latch becomes.
    pub(crate) fn next(&mut self, latch: usize, next: Lit) {
        if let Some(latch) = self.latches.get_mut(latch) {
            latch.next = next;
        }
    }

    /// Says what latches become.
    pub(crate) fn next_all(&mut self, latches: &[usize], next: &[Lit]) {
        for (&latch, &next) in latches.iter().zip(next) {
            self.next(latch, next);
        }
    }

    /// Makes the bits of a byte of the image latches, those of `mask` at most. Gives their literals.
    pub(crate) fn keep_byte(&mut self, memory: &mut Memory, offset: u32, mask: u8, free: bool) {
        for bit in (0..8).filter(|bit| mask >> bit & 1 == 1) {
            let now = memory.bit(offset as usize, bit).value().unwrap_or(false);
            let first = if free { First::Free } else { First::Constant(now) };
            let (index, lit) = self.latch(first);
            memory.set_bit(offset as usize, bit, lit);
            self.lies_at(index, offset, bit);
            self.image_bits.push(index);
        }
    }

    /// A variable that comes from outside in each tick.
    pub(crate) fn input(&mut self, name: String, width: usize, form: Form) -> Vec<Lit> {
        let bits = self.builder.graph.inputs(width);
        let key = name.clone();
        self.inputs.push(Variable {
            name,
            key,
            bits: bits.clone(),
            form,
            is_pulse: false,
            first: 0,
        });
        bits
    }

    /// The system, whose image is `memory` at the end of a tick.
    pub(crate) fn finish(mut self, memory: Memory, running: Lit, goes_on: Lit) -> System {
        for &index in &std::mem::take(&mut self.image_bits) {
            let place = self.latches.get(index).and_then(|latch| latch.place);
            if let Some((offset, bit)) = place {
                self.next(index, memory.bit(offset as usize, bit));
            }
        }
        let Self { mut builder, latches, inputs, retained, elapses, observed, .. } = self;
        let stops = builder.graph.and(running, !goes_on);
        let same = FxHashMap::default();
        System {
            builder,
            latches,
            inputs,
            retained,
            memory,
            running,
            stops,
            elapses,
            observed,
            same,
        }
    }
}
