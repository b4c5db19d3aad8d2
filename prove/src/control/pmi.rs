//! The scan of a PMI control (rulings, Scan; `runtime/src/pmi/tick.rs`).

use std::collections::BTreeSet;

use plcc_abi::pmi::{Format, Lines, PmiTables, Role, Symbol, Timer, TimerKind, Type};

use super::Source;
use super::writes::Writes;
use crate::logic::{FALSE, Lit, Memory, TRUE};
use crate::scan::{Code, Reason};
use crate::system::{Elapse, First, Form, Maker, Observed, System, Time, Variable};

/// The unit of timers in nanoseconds.
const TIMER_UNIT: u64 = 20_000_000;

fn width(ty: Type) -> usize {
    match ty {
        Type::Logical => 1,
        Type::Integer => 16,
        Type::Long => 32,
    }
}

/// The counter of a timer, as it is kept.
struct Counter {
    timer: Timer,
    idle: (usize, Lit),
    /// What is left, or that it runs.
    value: (Vec<usize>, Vec<Lit>),
    /// Whether the time that is left is kept.
    exact: bool,
}

pub(super) fn system(
    source: &Source<'_>,
    tables: &PmiTables,
    code: &Code<'_>,
    time: Time,
    named: &BTreeSet<String>,
) -> System {
    let mut maker = Maker::default();
    let mut memory = Memory::of_bytes(source.image);
    let writes = Writes::of(source.module);
    let (first_latch, first) = maker.latch(First::Constant(true));
    maker.next(first_latch, FALSE);
    let (running_latch, running) = maker.latch(First::Constant(true));
    let from_outside = from_outside(source, tables, &writes, named);
    let counters = keep(source, tables, &writes, &from_outside, time, &mut maker, &mut memory);
    inputs(tables, &from_outside, &mut maker, &mut memory);
    // No time has passed before the first scan.
    count_down(source, first, &counters, &mut maker, &mut memory);
    latch(tables, &mut maker, &mut memory);
    memory.set_byte(tables.special.ipl as usize, byte_of(first));
    let ends = code.scan(&mut maker.builder, 0, TRUE, &memory, u32::MAX);
    let trapped = ends.trap.as_ref().map_or(FALSE, |(cond, _)| *cond);
    let mut end = match ends.end {
        Some((_, mut memory)) => {
            drive(tables, &mut maker, &mut memory);
            memory
        }
        None => memory.clone(),
    };
    if let Some((_, mut stopped)) = ends.trap {
        stopped.set_byte(tables.special.estop as usize, byte_of(TRUE));
        for lines in tables.symbols.iter().filter_map(|symbol| symbol.role.output()) {
            stopped.set_byte((tables.ports + u32::from(lines.port)) as usize, [FALSE; 8]);
        }
        end.choose(&mut maker.builder.graph, !trapped, &stopped);
    }
    let goes_on = maker.builder.graph.and(running, !trapped);
    maker.next(running_latch, goes_on);
    for counter in &counters {
        let cell = end.load(counter.timer.counter as usize, 4);
        let graph = &mut maker.builder.graph;
        let idle_mark = graph.number(32, -1);
        let idle = graph.equal(&cell, &idle_mark);
        let runs = graph.is_not_zero(&cell);
        let runs = graph.and(runs, !idle);
        let value = if counter.exact { cell } else { vec![runs] };
        maker.next(counter.idle.0, idle);
        maker.next_all(&counter.value.0, &value);
    }
    for (elapse, counter) in maker.elapses.iter_mut().zip(counters.iter().filter(|it| !it.exact)) {
        let latch = counter.value.0.first().and_then(|&index| maker.latches.get(index));
        elapse.runs_on = latch.map_or(FALSE, |latch| latch.next);
        let cell = end.load(counter.timer.counter as usize, 4);
        let graph = &mut maker.builder.graph;
        let preset = graph.number(32, counter.timer.preset.into());
        let starts = graph.equal(&cell, &preset);
        elapse.starts = graph.and(starts, elapse.runs_on);
    }
    observe(source, tables, &writes, &from_outside, &mut maker, &end);
    maker.finish(end, running, goes_on)
}

fn byte_of(bit: Lit) -> [Lit; 8] {
    let mut byte = [FALSE; 8];
    byte[0] = bit;
    byte
}

/// The bytes of a symbol.
fn bytes(symbol: &Symbol) -> std::ops::Range<u32> {
    symbol.offset..symbol.offset + symbol.elements.unwrap_or(1) * symbol.ty.size()
}

/// The executive variables that the control or the operator gives: those that the program does not assign, or only clears.
fn from_outside<'t>(
    source: &Source<'_>,
    tables: &'t PmiTables,
    writes: &Writes,
    named: &BTreeSet<String>,
) -> Vec<&'t Symbol> {
    let is_given = |symbol: &&Symbol| {
        let base = symbol.name.split('[').next().unwrap_or_default();
        symbol.role == Role::Variable
            && symbol.name.starts_with('@')
            && symbol.offset != tables.special.ipl
            && (symbol.dumped || named.iter().any(|it| it.split('[').next() == Some(base)))
            && writes.only_clear(bytes(symbol))
            // What survives power-off is the program's own, and as it was left.
            && !(symbol.retained && source.settings.as_declared)
    };
    tables.symbols.iter().filter(is_given).collect()
}

/// Makes latches of all that is kept from scan to scan.
fn keep(
    source: &Source<'_>,
    tables: &PmiTables,
    writes: &Writes,
    from_outside: &[&Symbol],
    time: Time,
    maker: &mut Maker,
    memory: &mut Memory,
) -> Vec<Counter> {
    let mut kept: BTreeSet<u32> = writes.bytes().into_iter().collect();
    kept.extend(tables.timers.iter().map(|timer| timer.delayed));
    let own = [tables.special.ipl, tables.special.estop];
    let logical = source.program.regions.iter().filter(|region| region.bits);
    let is_logical: Vec<_> = logical.map(|it| it.offset..it.offset + it.size).collect();
    let mut free = BTreeSet::new();
    for symbol in tables.symbols.iter().filter(|it| it.retained && it.dumped) {
        if !source.settings.as_declared && writes.any(bytes(symbol)) {
            free.extend(bytes(symbol));
            kept.extend(bytes(symbol));
        }
    }
    for symbol in from_outside {
        bytes(symbol).for_each(|byte| {
            kept.remove(&byte);
        });
    }
    for timer in &tables.timers {
        (timer.counter..timer.counter + 4).for_each(|byte| {
            kept.remove(&byte);
        });
    }
    for &offset in kept.iter().filter(|offset| !own.contains(offset)) {
        let mask = if is_logical.iter().any(|it| it.contains(&offset)) { 1 } else { 0xFF };
        maker.keep_byte(memory, offset, mask, free.contains(&offset));
    }
    for symbol in tables.symbols.iter().filter(|it| free.contains(&it.offset)) {
        let size = symbol.ty.size();
        for element in 0..symbol.elements.unwrap_or(1) {
            let mut bits = memory.load((symbol.offset + element * size) as usize, size as usize);
            bits.truncate(width(symbol.ty));
            let name = match symbol.elements {
                Some(_) => format!("{}[{element}]", symbol.name),
                None => symbol.name.clone(),
            };
            let form = if symbol.ty == Type::Logical { Form::Unsigned } else { Form::Signed };
            let key = name.clone();
            maker.retained.push(Variable { name, key, bits, form, is_pulse: false, first: 0 });
        }
    }
    let counters = tables.timers.iter().map(|&timer| {
        let idle = maker.latch(First::Constant(true));
        let preset = timer.preset.max(0);
        let exact = time == Time::Exact || timer.preset < 0;
        let bits = match exact {
            false => 1,
            true if timer.preset < 0 => 32,
            true => (32 - preset.leading_zeros()) as usize,
        };
        let value = maker.latch_number(bits, 0);
        for (&latch, bit) in value.0.iter().zip(0_u32..).filter(|_| exact) {
            maker.lies_at(latch, timer.counter + bit / 8, (bit % 8) as u8);
        }
        let graph = &mut maker.builder.graph;
        let idle_mark = graph.number(32, -1);
        let left = match exact {
            true => graph.resize(&value.1, 32, FALSE),
            false => {
                let runs = value.1.first().copied().unwrap_or(FALSE);
                // A statement only asks whether it is idle, so that any number says that it runs; this one is not that of
                // a timer that begins.
                let left = graph.number(32, if preset == 1 { 2 } else { 1 });
                let zero = graph.number(32, 0);
                graph.choose_bits(runs, &left, &zero)
            }
        };
        let cell = graph.choose_bits(idle.1, &idle_mark, &left);
        memory.store(timer.counter as usize, &cell);
        Counter { timer, idle, value, exact }
    });
    counters.collect()
}

/// Gives a new value to all that comes from outside.
fn inputs(tables: &PmiTables, from_outside: &[&Symbol], maker: &mut Maker, memory: &mut Memory) {
    for symbol in from_outside {
        let size = symbol.ty.size();
        let form = if symbol.ty == Type::Logical { Form::Unsigned } else { Form::Signed };
        for element in 0..symbol.elements.unwrap_or(1) {
            let name = match symbol.elements {
                Some(_) => format!("{}[{element}]", symbol.name),
                None => symbol.name.clone(),
            };
            let bits = maker.input(name, width(symbol.ty), form);
            memory.store((symbol.offset + element * size) as usize, &bits);
            if let Some(input) = maker.inputs.last_mut() {
                input.is_pulse = symbol.offset == tables.special.crset;
            }
        }
    }
    if !from_outside.iter().any(|symbol| symbol.offset == tables.special.crset) {
        memory.set_byte(tables.special.crset as usize, [FALSE; 8]);
    }
    // The lines of inputs, each once. One with a name of its own is called by that.
    let mut seen = BTreeSet::new();
    let all = || tables.symbols.iter().filter_map(|it| Some((it, it.role.input()?)));
    let single = all().filter(|(_, lines)| lines.format == Format::Bit);
    let groups = all().filter(|(_, lines)| lines.format != Format::Bit);
    for (symbol, lines) in single.chain(groups) {
        for bit in lines.low..(lines.low + lines.count).min(8) {
            if !seen.insert((lines.port, bit)) {
                continue;
            }
            let name = match lines.format {
                Format::Bit => symbol.name.clone(),
                _ => format!("PORT{}.{bit}", lines.port),
            };
            let lit = maker.input(name, 1, Form::Unsigned);
            if let Some(input) = maker.inputs.last_mut() {
                input.key = format!("PORT{}.{bit}", lines.port);
            }
            let offset = (tables.ports + u32::from(lines.port)) as usize;
            memory.set_bit(offset, bit, lit.first().copied().unwrap_or(FALSE));
        }
    }
}

/// Lets the timers go down by the time between two scans.
fn count_down(
    source: &Source<'_>,
    first: Lit,
    counters: &[Counter],
    maker: &mut Maker,
    memory: &mut Memory,
) {
    let period = source.settings.period_ns;
    let units = period / TIMER_UNIT;
    if units == 0 || !period.is_multiple_of(TIMER_UNIT) {
        if !counters.is_empty() {
            let text = "the time between two scans is not a multiple of the timers' 20 ms";
            let reason = maker.builder.reason(Reason { text: text.into(), place: None });
            maker.builder.escapes.push((TRUE, reason));
        }
        return;
    }
    for counter in counters {
        let timer = &counter.timer;
        let at = timer.counter as usize;
        let count = memory.load(at, 4);
        let graph = &mut maker.builder.graph;
        let sign = count.last().copied().unwrap_or(FALSE);
        let is_zero = !graph.is_not_zero(&count);
        let runs = graph.and(!sign, !is_zero);
        let counts = graph.and(runs, !first);
        let (left, is_through) = if counter.exact {
            let step = graph.number(32, units.min(i32::MAX as u64) as i64);
            let (less, _) = graph.subtract(&count, &step);
            let is_more = graph.less_unsigned(&step, &count);
            let zero = graph.number(32, 0);
            (graph.choose_bits(is_more, &less, &zero), !is_more)
        } else {
            let expires = graph.input();
            let zero = graph.number(32, 0);
            let left = graph.choose_bits(expires, &zero, &count);
            maker.elapses.push(Elapse {
                running: runs,
                expires: graph.and(counts, expires),
                runs_on: FALSE,
                starts: FALSE,
                ticks: (timer.preset.max(1) as u64).div_ceil(units),
            });
            (left, expires)
        };
        let new = graph.choose_bits(counts, &left, &count);
        memory.store(at, &new);
        let expires = graph.and(counts, is_through);
        let delayed = memory.bit(timer.delayed as usize, 0);
        let on = Lit::constant(timer.kind == TimerKind::E);
        let delayed = maker.builder.graph.choose(expires, on, delayed);
        memory.set_byte(timer.delayed as usize, byte_of(delayed));
    }
}

/// Copies the physical lines into the inputs' variables.
fn latch(tables: &PmiTables, maker: &mut Maker, memory: &mut Memory) {
    for symbol in &tables.symbols {
        let Some(lines) = symbol.role.input() else { continue };
        let port = memory.byte((tables.ports + u32::from(lines.port)) as usize);
        let (low, count) = (usize::from(lines.low), usize::from(lines.count));
        let bits: Vec<Lit> = port.iter().copied().skip(low).take(count).collect();
        let graph = &mut maker.builder.graph;
        let value = match lines.format {
            Format::Bit => bits,
            Format::Binary => graph.resize(&bits, 16, FALSE),
            Format::TwosComplement => graph.resize_signed(&bits, 16),
            Format::Bcd => {
                let digits = graph.resize(&bits, 8, FALSE);
                let (ones, tens) = digits.split_at(4);
                let (ones, tens) = (graph.resize(ones, 16, FALSE), graph.resize(tens, 16, FALSE));
                let ten = graph.number(16, 10);
                let tens = graph.multiply(&tens, &ten);
                graph.add(&tens, &ones)
            }
        };
        memory.store(symbol.offset as usize, &value);
    }
}

/// Puts the outputs' values on their physical lines.
fn drive(tables: &PmiTables, maker: &mut Maker, memory: &mut Memory) {
    for symbol in &tables.symbols {
        let Some(lines) = symbol.role.output() else { continue };
        let bits = encode(lines, symbol, maker, memory);
        let offset = (tables.ports + u32::from(lines.port)) as usize;
        for (place, bit) in (lines.low..(lines.low + lines.count).min(8)).enumerate() {
            memory.set_bit(offset, bit, bits.get(place).copied().unwrap_or(FALSE));
        }
    }
}

/// The bits of an output's value, at the lowest places.
fn encode(lines: Lines, symbol: &Symbol, maker: &mut Maker, memory: &Memory) -> Vec<Lit> {
    let at = symbol.offset as usize;
    match lines.format {
        Format::Bit => vec![memory.bit(at, 0)],
        Format::Binary | Format::TwosComplement => memory.load(at, 1),
        Format::Bcd => {
            let value = memory.load(at, 2);
            let graph = &mut maker.builder.graph;
            let (hundred, ten) = (graph.number(16, 100), graph.number(16, 10));
            let (_, rest) = graph.divide_signed(&value, &hundred);
            let sign = rest.last().copied().unwrap_or(FALSE);
            let moved = graph.add(&rest, &hundred);
            let rest = graph.choose_bits(sign, &moved, &rest);
            let (tens, ones) = graph.divide_unsigned(&rest, &ten);
            ones.into_iter().take(4).chain(tens.into_iter().take(4)).collect()
        }
    }
}

/// Notes what is seen of the program: the lines of its outputs, the variables that it gives to the control, and what survives
/// power-off.
fn observe(
    source: &Source<'_>,
    tables: &PmiTables,
    writes: &Writes,
    from_outside: &[&Symbol],
    maker: &mut Maker,
    memory: &Memory,
) {
    for symbol in &tables.symbols {
        let mut bits = vec![];
        if let Role::Output(lines) = symbol.role {
            let offset = tables.ports + u32::from(lines.port);
            for bit in lines.low..(lines.low + lines.count).min(8) {
                let key = format!("PORT{}.{bit}", lines.port);
                bits.push((key, (offset, bit), memory.bit(offset as usize, bit)));
            }
        } else {
            let is_given = symbol.role == Role::Variable
                && symbol.name.starts_with('@')
                && writes.any(bytes(symbol))
                && (symbol.retained || !from_outside.iter().any(|it| it.offset == symbol.offset));
            if !is_given {
                continue;
            }
            let logical = symbol.ty == Type::Logical;
            for (number, offset) in bytes(symbol).enumerate() {
                for bit in 0..if logical { 1 } else { 8 } {
                    let key = format!("{}.{number}.{bit}", symbol.name);
                    bits.push((key, (offset, bit), memory.bit(offset as usize, bit)));
                }
            }
        }
        let is_retained = symbol.retained;
        maker.observed.push(Observed { name: symbol.name.clone(), is_retained, bits });
    }
    debug_assert!(source.image.len() >= tables.ports as usize, "the ports are in the image");
}
