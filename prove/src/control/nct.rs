//! The slice of an NCT control (NCT 1.2, 1.3; `runtime/src/nct/tick.rs`).
//!
//! `:000` is taken to come to its end in each slice. Where it may not, that is one of the conditions on which the logic does
//! not follow the program.

use std::ops::Range;

use plcc_abi::nct::{
    FLAG_BYTES, FlagLocation, H_COUNT, IMAGE_BYTES, LINE_BYTES, M_COUNT, NctName, NctTables,
    RETAINED_FROM, RH_COUNT, T_COUNT, context, layout::region,
};

use super::Source;
use super::writes::Writes;
use crate::logic::{FALSE, Lit, Memory, TRUE};
use crate::scan::Code;
use crate::system::{First, Form, Maker, Observed, System, Variable};

/// Safepoints that :001 and :002 may pass.
const MAX_SAFEPOINTS: u32 = 1_000_000;
/// Milliseconds of a slice.
const SLICE_MS: u64 = 20;
/// Y546, by which the program enables :002.
const LEVEL2_ENABLE: (usize, u8) = (54, 6);
/// I510, which is 1 in the first slice.
const FIRST_CALL: (usize, u8) = (51, 0);
/// I543, which is 1 when :000 begins at its label.
const LEVEL0_START: (usize, u8) = (54, 3);

/// A part of the image, and whether its bytes are 0 or 1.
type Part = (Range<u32>, bool);

struct Slice<'s> {
    source: &'s Source<'s>,
    tables: &'s NctTables,
    code: &'s Code<'s>,
    maker: Maker,
    memory: Memory,
    /// Whether the modules of this slice have all come to their ends so far.
    on: Lit,
    /// The image where one has not.
    stopped: Option<(Lit, Memory)>,
    /// Register OP of each module.
    op: Vec<Vec<Lit>>,
}

pub(super) fn system(source: &Source<'_>, tables: &NctTables, code: &Code<'_>) -> System {
    let mut maker = Maker::default();
    let memory = Memory::of_bytes(source.image);
    let (first_latch, first) = maker.latch(First::Constant(true));
    maker.next(first_latch, FALSE);
    let (running_latch, running) = maker.latch(First::Constant(true));
    let modules = source.program.tasks.len();
    let (op_latches, op): (Vec<_>, Vec<_>) =
        (0..modules).map(|_| maker.latch_number(16, 0)).unzip();
    let mut slice = Slice { source, tables, code, maker, memory, on: TRUE, stopped: None, op };
    slice.keep();
    let parts = slice.input_parts();
    let level0 = slice.keep_beside(&parts);
    slice.inputs();
    let has_level2 = modules > 2;
    if has_level2 {
        slice.level2();
    }
    slice.count(first);
    slice.latch(first);
    slice.run(1, TRUE, MAX_SAFEPOINTS);
    let level0_next = slice.level0(&parts, &level0.1);
    slice.drive();
    if has_level2 {
        for _ in 1..SLICE_MS / source.settings.level2_ms.max(1) {
            slice.level2();
        }
    }
    let Slice { mut maker, mut memory, on, stopped, op, .. } = slice;
    let lines_out = region_of(source, region::LINES_OUT);
    if let Some((_, mut stopped)) = stopped {
        for byte in lines_out.take(LINE_BYTES) {
            stopped.set_byte(byte as usize, [FALSE; 8]);
        }
        memory.choose(&mut maker.builder.graph, on, &stopped);
    }
    let goes_on = maker.builder.graph.and(running, on);
    maker.next(running_latch, goes_on);
    for (latches, op) in op_latches.iter().zip(&op) {
        maker.next_all(latches, op);
    }
    maker.next_all(&level0.0, &level0_next);
    observe(tables, &mut maker, &memory);
    maker.finish(memory, running, goes_on)
}

/// The bytes of a region.
fn region_of(source: &Source<'_>, name: &str) -> Range<u32> {
    source.program.region(name).map_or(0..0, |it| it.offset..it.offset + it.size)
}

/// The bit of a byte at a location.
fn bit_of(memory: &Memory, location: &FlagLocation, bit: u8) -> Lit {
    if location.unpacked {
        memory.bit((location.offset + u32::from(bit)) as usize, 0)
    } else {
        memory.bit(location.offset as usize, bit)
    }
}

fn set_bit(memory: &mut Memory, location: &FlagLocation, bit: u8, value: Lit) {
    if location.unpacked {
        memory.store((location.offset + u32::from(bit)) as usize, &[value]);
    } else {
        memory.set_bit(location.offset as usize, bit, value);
    }
}

impl Slice<'_> {
    /// Makes latches of all that the program writes, and of what survives power-off.
    fn keep(&mut self) {
        let source = self.source;
        let own = region_of(source, region::CONTEXT);
        let is_bits = |offset: u32| {
            let mut regions = source.program.regions.iter();
            regions.any(|it| it.bits && (it.offset..it.offset + it.size).contains(&offset))
        };
        let writes = Writes::of(source.module);
        let mut kept: std::collections::BTreeSet<u32> = writes.bytes().into_iter().collect();
        let calls_host = source.module.funcs().any(|(_, func)| {
            func.blocks().any(|(_, block)| {
                let mut insts = block.insts.iter().map(|&inst| func.inst(inst));
                insts.any(|it| matches!(it, plcc_ir::InstData::HostCall { .. }))
            })
        });
        if calls_host {
            for (number, location) in self.tables.flags.iter().enumerate() {
                debug_assert!(number < FLAG_BYTES, "the flag is outside the image");
                let count = if location.unpacked { 8 } else { 1 };
                kept.extend(location.offset..location.offset + count);
            }
        }
        kept.extend(self.input_parts().into_iter().flat_map(|(range, _)| range));
        let mut free = std::collections::BTreeSet::new();
        for location in self.tables.flags.iter().skip(RETAINED_FROM) {
            let count = if location.unpacked { 8 } else { 1 };
            let bytes = location.offset..location.offset + count;
            kept.extend(bytes.clone());
            if !source.settings.as_declared {
                free.extend(bytes);
            }
        }
        for offset in kept {
            if own.contains(&offset) {
                continue;
            }
            let mask = if is_bits(offset) { 1 } else { 0xFF };
            let free = free.contains(&offset);
            self.maker.keep_byte(&mut self.memory, offset, mask, free);
        }
        if source.settings.as_declared {
            return;
        }
        for (byte, location) in self.tables.flags.iter().enumerate().skip(RETAINED_FROM) {
            for bit in 0..8 {
                let name = NctName::F { byte: byte as u16, bit: Some(bit) }.to_string();
                let bits = vec![bit_of(&self.memory, location, bit)];
                let form = Form::Unsigned;
                let key = name.clone();
                self.maker.retained.push(Variable {
                    name,
                    key,
                    bits,
                    form,
                    is_pulse: false,
                    first: 0,
                });
            }
        }
    }

    /// The parts of the image that hold the inputs of the module that runs, now and before.
    fn input_parts(&self) -> Vec<Part> {
        let [bytes, bits] = region::INPUT;
        let [previous_bytes, previous_bits] = region::PREVIOUS;
        let part = |name, bits| (region_of(self.source, name), bits);
        vec![
            part(bytes, false),
            part(bits, true),
            part(previous_bytes, false),
            part(previous_bits, true),
        ]
    }

    /// Latches for the inputs of :000, which wait beside the image.
    fn keep_beside(&mut self, parts: &[Part]) -> (Vec<usize>, Vec<Lit>) {
        let count = parts.iter().map(|(range, bits)| range.len() * if *bits { 1 } else { 8 });
        self.maker.latch_number(count.sum(), 0)
    }

    /// The bits of the parts.
    fn read(&self, parts: &[Part]) -> Vec<Lit> {
        let mut all = vec![];
        for (range, bits) in parts {
            for byte in range.clone() {
                let byte = self.memory.byte(byte as usize);
                all.extend(byte.into_iter().take(if *bits { 1 } else { 8 }));
            }
        }
        all
    }

    fn write(&mut self, parts: &[Part], values: &[Lit]) {
        let mut values = values.iter().copied();
        for (range, bits) in parts {
            for byte in range.clone() {
                let mut new = [FALSE; 8];
                for slot in new.iter_mut().take(if *bits { 1 } else { 8 }) {
                    *slot = values.next().unwrap_or(FALSE);
                }
                self.memory.set_byte(byte as usize, new);
            }
        }
    }

    /// Gives a new value to all that comes from outside before the slice begins: the physical lines and the registers that the
    /// NC writes. Its flags come when the inputs are latched.
    fn inputs(&mut self) {
        let lines = region_of(self.source, region::LINES_IN);
        for byte in 0..LINE_BYTES as u32 {
            for bit in 0..8 {
                let lit = self.line(byte as u8, bit);
                self.memory.set_bit((lines.start + byte) as usize, bit, lit);
            }
        }
        let writes = Writes::of(self.source.module);
        let registers = region_of(self.source, region::RH);
        // NCT 2.5: the registers of each hundred below 50 are the NC's.
        for number in (0..RH_COUNT).filter(|number| number % 100 < 50) {
            let at = registers.start + u32::from(number) * 2;
            if writes.any(at..at + 2) {
                continue;
            }
            let name = NctName::Rh(number).to_string();
            let bits = self.maker.input(name, 16, Form::Unsigned);
            self.memory.store(at as usize, &bits);
        }
    }

    /// An input, by its byte and bit.
    fn line(&mut self, byte: u8, bit: u8) -> Lit {
        let name = NctName::I { byte, bit: Some(bit) }.to_string();
        self.maker.input(name, 1, Form::Unsigned).first().copied().unwrap_or(FALSE)
    }

    /// Lets the timers go down (NCT 2.4). Before slice 0 no time has passed.
    fn count(&mut self, first: Lit) {
        let (slices, slice) = self.maker.latch_number(6, 0);
        let (seconds, second) = self.maker.latch_number(6, 0);
        // The number of the slice in its second, and of the second in its minute.
        let graph = &mut self.maker.builder.graph;
        let is_second = !graph.is_not_zero(&slice);
        let is_second = graph.and(is_second, !first);
        let is_whole = !graph.is_not_zero(&second);
        let is_minute = graph.and(is_second, is_whole);
        let mut wrap = |now: &[Lit], last: i64| {
            let (one, last) = (graph.number(6, 1), graph.number(6, last));
            let is_last = graph.equal(now, &last);
            let more = graph.add(now, &one);
            let zero = graph.number(6, 0);
            (graph.choose_bits(is_last, &zero, &more), is_last)
        };
        let (next_slice, is_last) = wrap(&slice, 49);
        let (next_second, _) = wrap(&second, 59);
        let next_second = graph.choose_bits(is_last, &next_second, &second);
        self.maker.next_all(&slices, &next_slice);
        self.maker.next_all(&seconds, &next_second);
        for (name, count, when) in [
            (region::T, T_COUNT, !first),
            (region::H, H_COUNT, is_second),
            (region::M, M_COUNT, is_minute),
        ] {
            let words = region_of(self.source, name);
            for number in 0..u32::from(count) {
                let at = (words.start + number * 2) as usize;
                let graph = &mut self.maker.builder.graph;
                let word = self.memory.load(at, 2);
                let runs = graph.is_not_zero(&word);
                let counts = graph.and(runs, when);
                let ones = graph.number(16, -1);
                let less = graph.add(&word, &ones);
                let new = graph.choose_bits(counts, &less, &word);
                self.memory.store(at, &new);
            }
        }
    }

    /// Copies the physical lines and the NC's flags into the inputs of :001.
    fn latch(&mut self, first: Lit) {
        let parts = self.input_parts();
        let (now, before) = parts.split_at(2);
        let values = self.read(now);
        self.write(before, &values);
        let lines = region_of(self.source, region::LINES_IN);
        let inputs = &self.tables.inputs;
        for byte in 0..IMAGE_BYTES {
            let Some(location) = inputs.get(byte) else { continue };
            for bit in 0..8 {
                let value = match (byte, bit) {
                    FIRST_CALL => first,
                    LEVEL0_START => TRUE,
                    _ if byte < LINE_BYTES => self.memory.bit(lines.start as usize + byte, bit),
                    _ => self.line(byte as u8, bit),
                };
                set_bit(&mut self.memory, location, bit, value);
            }
        }
    }

    /// Runs a module on a condition, if those before it have come to their ends.
    fn run(&mut self, module: usize, cond: Lit, fuel: u32) {
        let graph = &mut self.maker.builder.graph;
        let cond = graph.and(self.on, cond);
        let at = (region_of(self.source, region::CONTEXT).start + context::OP) as usize;
        let mut entered = self.memory.clone();
        let op = self.op.get(module).cloned().unwrap_or_default();
        entered.store(at, &op);
        let ends = self.code.scan(&mut self.maker.builder, module, cond, &entered, fuel);
        let trapped = ends.trap.as_ref().map_or(FALSE, |(trapped, _)| *trapped);
        if let Some((_, mut memory)) = ends.end {
            let graph = &mut self.maker.builder.graph;
            let left = memory.load(at, 2);
            if let Some(op) = self.op.get_mut(module) {
                *op = graph.choose_bits(cond, &left, op);
            }
            memory.choose(graph, cond, &self.memory);
            self.memory = memory;
        }
        if let Some((trapped, memory)) = ends.trap {
            match &mut self.stopped {
                None => self.stopped = Some((trapped, memory)),
                Some((before, kept)) => {
                    let graph = &mut self.maker.builder.graph;
                    kept.choose(graph, *before, &memory);
                    *before = graph.or(*before, trapped);
                }
            }
        }
        let graph = &mut self.maker.builder.graph;
        self.on = graph.and(self.on, !trapped);
    }

    /// Runs :002 where it is enabled.
    fn level2(&mut self) {
        let (byte, bit) = LEVEL2_ENABLE;
        let enabled = self.tables.outputs.get(byte);
        let enabled = enabled.map_or(FALSE, |location| bit_of(&self.memory, location, bit));
        self.run(2, enabled, MAX_SAFEPOINTS);
    }

    /// Runs :000 with its own inputs, which become those of :001. Gives what they are afterwards.
    fn level0(&mut self, parts: &[Part], level0: &[Lit]) -> Vec<Lit> {
        let shown = self.read(parts);
        let (now, _) = parts.split_at(2);
        let count = self.read(now).len();
        let (inputs, _) = shown.split_at(count.min(shown.len()));
        let (before, _) = level0.split_at(count.min(level0.len()));
        let own: Vec<Lit> = inputs.iter().chain(before).copied().collect();
        self.write(parts, &own);
        let already = self.stopped.as_ref().map_or(FALSE, |(cond, _)| *cond);
        self.run(0, TRUE, self.source.settings.level0_safepoints);
        let after = self.read(parts);
        self.write(parts, &shown);
        // Where :000 is stopped, the inputs of :001 are shown again too.
        if let Some((cond, mut stopped)) = self.stopped.take() {
            let mut values = shown.iter().copied();
            let graph = &mut self.maker.builder.graph;
            for (range, bits) in parts {
                for byte in range.clone() {
                    let mut new = stopped.byte(byte as usize);
                    for slot in new.iter_mut().take(if *bits { 1 } else { 8 }) {
                        let value = values.next().unwrap_or(FALSE);
                        *slot = graph.choose(already, *slot, value);
                    }
                    stopped.set_byte(byte as usize, new);
                }
            }
            self.stopped = Some((cond, stopped));
        }
        after
    }

    /// Copies the outputs to the physical lines.
    fn drive(&mut self) {
        let lines = region_of(self.source, region::LINES_OUT).start as usize;
        let count = usize::from(self.source.settings.boards) * 10;
        for byte in 0..count.min(LINE_BYTES) {
            let Some(location) = self.tables.outputs.get(byte) else { continue };
            for bit in 0..8 {
                let value = bit_of(&self.memory, location, bit);
                self.memory.set_bit(lines + byte, bit, value);
            }
        }
    }
}

/// Notes what is seen of the program: its outputs and flags to the NC, and what survives power-off.
fn observe(tables: &NctTables, maker: &mut Maker, memory: &Memory) {
    let latches: std::collections::BTreeSet<Lit> =
        maker.latches.iter().map(|latch| latch.lit).collect();
    let outputs = tables.outputs.iter().enumerate().map(|it| (it, false));
    let kept = tables.flags.iter().enumerate().skip(RETAINED_FROM).map(|it| (it, true));
    for ((byte, location), is_retained) in outputs.chain(kept) {
        for bit in 0..8 {
            let name = match is_retained {
                false => NctName::Y { byte: byte as u8, bit: Some(bit) },
                true => NctName::F { byte: byte as u16, bit: Some(bit) },
            };
            let name = name.to_string();
            let lit = bit_of(memory, location, bit);
            // What the program does not write says nothing.
            let is_kept = latches.contains(&lit);
            if lit == FALSE || is_retained && is_kept {
                continue;
            }
            let place = match location.unpacked {
                true => (location.offset + u32::from(bit), 0),
                false => (location.offset, bit),
            };
            let bits = vec![(name.clone(), place, lit)];
            maker.observed.push(Observed { name, is_retained, bits });
        }
    }
}
