//! What a PMAC keeps from tick to tick.

use std::collections::BTreeMap;

use plcc_abi::image::{read_f64, read_u32};
use plcc_abi::pmac::layout::{DEFINITION_SIZE, DOUBLE_SIZE, WORD_SIZE};
use plcc_abi::pmac::{Kind, Layout, PmacName, Variable as Named};

use super::access::Access;
use super::host::Pmac;
use super::values::{Stored, Values, values};
use super::{Clocks, TIMER_END};
use crate::logic::{FALSE, Graph, Lit, Memory};
use crate::scan::{Builder, Code};
use crate::system::{First, Form, Maker, Variable};

/// A double of which a few bits are kept.
pub(super) struct Short {
    offset: u32,
    values: Values,
    latches: Vec<usize>,
}

impl Short {
    fn new(offset: u32, values: Values, image: &[u8], maker: &mut Maker) -> (Self, Vec<Lit>) {
        let first = read_f64(image, offset);
        let (width, first) = match &values {
            // The number of a value among them.
            Values::Few(values) => {
                let place = values.iter().position(|value| *value == first.to_bits());
                (usize::BITS - (values.len() - 1).leading_zeros(), place.unwrap_or(0) as i64)
            }
            Values::Integer((low, high)) => {
                let size = low.unsigned_abs().max(high.unsigned_abs());
                (65 - size.leading_zeros(), first as i64)
            }
        };
        let (latches, bits) = maker.latch_number(width as usize, first);
        (Self { offset, values, latches }, bits)
    }

    /// The double that bits are.
    fn double(&self, bits: &[Lit], builder: &mut Builder) -> Vec<Lit> {
        let Builder { graph, tables, .. } = builder;
        match &self.values {
            Values::Integer(_) => graph.float_of_int(bits),
            Values::Few(values) => {
                let value = |x: &[u64]| {
                    let place = usize::try_from(*x.first()?).ok()?;
                    Some(values.get(place).copied().unwrap_or(0))
                };
                let found = tables.operation(graph, &[bits], 64, value);
                found.unwrap_or_else(|| vec![FALSE; 64])
            }
        }
    }

    /// Says what the bits become, given the double at the end of a tick.
    pub(super) fn finish(&self, maker: &mut Maker, memory: &Memory) {
        let double = memory.load(self.offset as usize, DOUBLE_SIZE as usize);
        let Builder { graph, tables, .. } = &mut maker.builder;
        let next = match &self.values {
            Values::Integer(_) => graph.bits_of_float(&double),
            Values::Few(values) => {
                let place = |x: &[u64]| {
                    let place = values.iter().position(|value| Some(value) == x.first());
                    Some(place.unwrap_or(0) as u64)
                };
                let found = tables.operation(graph, &[&double], self.latches.len(), place);
                found.unwrap_or_else(|| {
                    let mut next = vec![FALSE; self.latches.len()];
                    for (place, &value) in values.iter().enumerate() {
                        let value = graph.number(64, value as i64);
                        let is_this = graph.equal(&double, &value);
                        for (bit, slot) in next.iter_mut().enumerate() {
                            if place >> bit & 1 == 1 {
                                *slot = graph.or(*slot, is_this);
                            }
                        }
                    }
                    next
                })
            }
        };
        maker.next_all(&self.latches, &next);
    }
}

/// What is kept of a program.
pub(super) struct Keeper<'k> {
    pub(super) pmac: &'k Pmac,
    pub(super) code: &'k Code<'k>,
    pub(super) access: &'k Access,
    pub(super) clocks: &'k Clocks,
    pub(super) image: &'k [u8],
    /// Whether P, Q and I may be anything at power-up, since the program keeps them.
    pub(super) is_free: bool,
    /// Whether a double comes from outside.
    pub(super) is_input: &'k dyn Fn(u32) -> bool,
}

impl Keeper<'_> {
    /// Makes latches of all that the program and the control write, and lets the time of a tick pass for the timers that are
    /// I-variables. Gives the doubles of which a few bits are kept.
    pub(super) fn keep(&self, maker: &mut Maker, memory: &mut Memory) -> Vec<Short> {
        let mut words: BTreeMap<u32, u32> = self.access.written.clone();
        for offset in self.clocks.words() {
            words.insert(offset, 0xFF_FFFF);
        }
        for (offset, mask) in words {
            // An M-variable without a definition keeps its value in the place of one.
            let layout = &self.pmac.layout;
            let is_star = (layout.mdef..layout.reference_definitions).contains(&offset);
            let free = self.is_free && is_star;
            for (byte, mask) in (offset..offset + WORD_SIZE).zip(mask.to_le_bytes()) {
                maker.keep_byte(memory, byte, mask, free);
            }
            if free {
                let bits = memory.load(offset as usize, WORD_SIZE as usize);
                let bits = bits.into_iter().take(21).collect();
                let number = (offset - layout.mdef) / DEFINITION_SIZE;
                let name = PmacName::Variable(Named { kind: Kind::M, number, system: 1 });
                let first = (i64::from(read_u32(self.image, offset)) << 43) >> 43;
                self.retain(name.to_string(), (bits, Form::Signed), first, maker);
            }
        }
        self.plcs(maker, memory);
        self.doubles(maker, memory)
    }

    /// The states of the PLCs.
    fn plcs(&self, maker: &mut Maker, memory: &mut Memory) {
        for (at, plc) in self.pmac.programs.iter().enumerate() {
            let state = self.pmac.state_at(at) as u32;
            let changes = self.access.plcs.iter().any(|(compiled, numbers)| {
                *compiled == plc.compiled && numbers.contains(&plc.number)
            });
            if changes {
                maker.keep_byte(memory, state, 0b111, false);
            }
            let task = self.code.module.tasks.get(plc.task as usize);
            let points = task.map_or(0, |task| task.resume_points.len());
            let mask = u32::MAX.checked_shr((points as u32).leading_zeros()).unwrap_or(0);
            for (byte, mask) in (state + 2..state + 4).zip(mask.to_le_bytes()) {
                maker.keep_byte(memory, byte, mask, false);
            }
        }
    }

    fn doubles(&self, maker: &mut Maker, memory: &mut Memory) -> Vec<Short> {
        let layout = &self.pmac.layout;
        let timers = self.clocks.doubles(layout, &|offset| {
            self.access.reads(offset) || self.access.doubles.contains_key(&offset)
        });
        let mut stores = self.access.doubles.clone();
        for &offset in &timers {
            let counted = Stored::Integer((TIMER_END, -TIMER_END - 1));
            stores.entry(offset).or_default().push(counted);
        }
        let is_free = |offset: u32| self.is_free && offset < layout.mdef;
        let first = |offset: u32| {
            let is_open = is_free(offset) || (self.is_input)(offset);
            Some(Values::one(read_f64(self.image, offset).to_bits())).filter(|_| !is_open)
        };
        let known = values(self.code.module, &stores, &first);
        let mut all = vec![];
        for &offset in stores.keys() {
            let at = offset as usize;
            let is_timer = timers.contains(&offset);
            let Some(values) = known.get(&offset).cloned() else {
                self.double(offset, is_free(offset), maker, memory);
                if is_timer {
                    let graph = &mut maker.builder.graph;
                    let time = memory.load(at, DOUBLE_SIZE as usize);
                    let time = count_down(graph, &time);
                    memory.store(at, &time);
                }
                continue;
            };
            let (short, mut bits) = Short::new(offset, values, self.image, maker);
            if is_timer {
                bits = less_by_one(&mut maker.builder.graph, &bits, TIMER_END);
            }
            let double = short.double(&bits, &mut maker.builder);
            memory.store(at, &double);
            all.push(short);
        }
        all
    }

    /// A double of which all bits are kept.
    fn double(&self, offset: u32, free: bool, maker: &mut Maker, memory: &mut Memory) {
        for byte in offset..offset + DOUBLE_SIZE {
            maker.keep_byte(memory, byte, 0xFF, free);
        }
        if !free {
            return;
        }
        let bits = memory.load(offset as usize, DOUBLE_SIZE as usize);
        let double = valid(&mut maker.builder.graph, &bits);
        memory.store(offset as usize, &double);
        let name = double_name(&self.pmac.layout, offset);
        let first = read_f64(self.image, offset).to_bits() as i64;
        self.retain(name, (bits, Form::Double), first, maker);
    }

    /// Notes what was kept while the power was off.
    fn retain(&self, name: String, of: (Vec<Lit>, Form), first: i64, maker: &mut Maker) {
        let (key, (bits, form)) = (name.clone(), of);
        maker.retained.push(Variable { name, key, bits, form, is_pulse: false, first });
    }
}

/// A number less by one, but not less than `end`.
pub(super) fn less_by_one(graph: &mut Graph, bits: &[Lit], end: i64) -> Vec<Lit> {
    let (end, ones) = (graph.number(bits.len(), end), graph.number(bits.len(), -1));
    let is_end = graph.equal(bits, &end);
    let less = graph.add(bits, &ones);
    graph.choose_bits(is_end, bits, &less)
}

/// The same of a double.
fn count_down(graph: &mut Graph, time: &[Lit]) -> Vec<Lit> {
    let number = |graph: &Graph, value: f64| graph.number(64, value.to_bits() as i64);
    let (one, end) = (number(graph, 1.0), number(graph, TIMER_END as f64));
    let less = graph.subtract_floats(time, &one);
    let (_, is_below, _) = graph.compare_floats(&less, &end);
    graph.choose_bits(is_below, &end, &less)
}

/// The double that bits from outside are: a finite one, and 0 for -0. [`Form::Double`] does the same.
pub(super) fn valid(graph: &mut Graph, bits: &[Lit]) -> Vec<Lit> {
    let exponent = bits.iter().copied().skip(52).take(11);
    let is_special = graph.all(exponent);
    let is_not_zero = graph.any(bits.iter().copied().take(63));
    let mut double = bits.to_vec();
    if let Some(lowest) = double.get_mut(52) {
        *lowest = graph.and(*lowest, !is_special);
    }
    if let Some(sign) = double.last_mut() {
        *sign = graph.and(*sign, is_not_zero);
    }
    double
}

/// What the double at an offset is called.
pub(super) fn double_name(layout: &Layout, offset: u32) -> String {
    let (kind, region) = match offset {
        _ if offset >= layout.thumbwheels => (Kind::M, layout.thumbwheels),
        _ if offset >= layout.i => (Kind::I, layout.i),
        _ if offset >= layout.q => (Kind::Q, layout.q),
        _ => (Kind::P, layout.p),
    };
    let (mut number, mut system) = ((offset - region) / DOUBLE_SIZE, 1);
    if kind == Kind::Q {
        let block = layout.count / layout.systems();
        (system, number) = (number / block + 1, number % block);
    }
    PmacName::Variable(Named { kind, number, system }).to_string()
}

/// Latches of a number, which is not in the image.
pub(super) fn number(maker: &mut Maker, count: u64) -> (Vec<usize>, Vec<Lit>) {
    let width = 64 - count.leading_zeros() as usize;
    (0..width).map(|_| maker.latch(First::Constant(false))).unzip()
}
