//! The servo cycle of a PMAC (rulings, Time; `runtime/src/pmac/tick.rs`).
//!
//! Motors and motion programs are not simulated, so that motion programs do not run.

mod access;
mod host;
mod keep;
mod outside;
mod places;
mod values;

use std::collections::BTreeSet;
use std::ops::RangeInclusive;
use std::rc::Rc;

use plcc_abi::image::read_f64;
use plcc_abi::pmac::layout::{DOUBLE_SIZE, WORD_SIZE};
use plcc_abi::pmac::{
    COMMAND_CONTEXT, Controller, Layout, Place, PmacName, PmacTables, Space, View, context,
};

use self::access::Access;
use self::keep::{Keeper, Short, less_by_one};
use self::outside::Outside;
use super::Source;
use crate::logic::{FALSE, Lit, Memory, TRUE};
use crate::scan::{Code, Reason, number};
use crate::system::{Maker, Observed, System};

pub(crate) use host::Pmac;

/// What housekeeping sets the watchdog's register to.
const WATCHDOG_START: i64 = 4095;
/// By how much each real-time interrupt lowers it.
const WATCHDOG_STEP: i64 = 8;
/// The most negative value of a timer, where it stops.
const TIMER_END: i64 = -0x80_0000;

/// Where the control itself counts.
#[derive(Debug)]
struct Clocks {
    /// The servo cycle counter X:0.
    cycles: u32,
    /// The timers X and Y:$700 and $701.
    timers: Vec<u32>,
    /// The watchdog's register, of a PMAC alone.
    watchdog: Option<u32>,
}

impl Clocks {
    fn new(layout: &Layout) -> Self {
        let word = |space, address| match layout.place(space, address) {
            Place::Word(offset) => Some(offset),
            _ => None,
        };
        let timers = [(Space::X, 0x700), (Space::Y, 0x700), (Space::X, 0x701), (Space::Y, 0x701)];
        Self {
            cycles: word(Space::X, 0).unwrap_or(layout.words),
            timers: timers.into_iter().filter_map(|(space, at)| word(space, at)).collect(),
            watchdog: match layout.controller {
                Controller::Pmac => word(Space::Y, 0x1F),
                Controller::Turbo => None,
            },
        }
    }

    /// The words that the control counts in.
    fn words(&self) -> impl Iterator<Item = u32> {
        self.timers.iter().copied().chain([self.cycles]).chain(self.watchdog)
    }

    /// The timers of a Turbo PMAC that are I-variables, Isx11 and Isx12, those for which `matters` says so.
    fn doubles(&self, layout: &Layout, matters: &dyn Fn(u32) -> bool) -> BTreeSet<u32> {
        if layout.controller == Controller::Pmac {
            return BTreeSet::new();
        }
        let systems = 1..=layout.systems();
        let all = systems.flat_map(|system| [11, 12].map(|timer| 5000 + 100 * system + timer));
        all.map(|number| layout.i_offset(number)).filter(|&offset| matters(offset)).collect()
    }
}

/// A tick that is being written.
struct Tick<'s> {
    source: &'s Source<'s>,
    code: &'s Code<'s>,
    pmac: Rc<Pmac>,
    maker: Maker,
    memory: Memory,
    clocks: Clocks,
    /// The PLC that ran last in background: its place among the interpreted ones from 1 on, by rising number.
    last: Vec<Lit>,
}

pub(super) fn system(
    source: &Source<'_>,
    tables: &PmacTables,
    code: &Code<'_>,
    named: &BTreeSet<String>,
) -> System {
    let layout = Layout::new(tables.controller);
    let pmac = Rc::new(Pmac::new(tables, layout));
    let mut maker = Maker::default();
    maker.builder.pmac = Some(Rc::clone(&pmac));
    let mut memory = Memory::of_bytes(source.image);
    memory.grow(pmac.size());
    pmac.power_up(&mut memory);
    let clocks = Clocks::new(&layout);
    let view = View { image: source.image, layout: &layout, sparse: &tables.sparse };
    let tasks = tables.programs.iter().map(|plc| plc.task as usize).chain(pmac.command_tasks());
    let mut access = Access::of(code, tasks, &layout, view, &tables.l);
    access.note_named(named, &layout);
    let own: BTreeSet<u32> = clocks.words().collect();
    // What the download says of a variable that the program only reads is a setting of the machine.
    let is_set = |offset: u32| source.settings.as_declared && read_f64(source.image, offset) != 0.0;
    let outside = Outside::of(tables, view, &access, named, &own, &is_set);
    let is_free = access.saves && !source.settings.as_declared;
    let keeper = Keeper {
        pmac: &pmac,
        code,
        access: &access,
        clocks: &clocks,
        image: source.image,
        is_free,
        is_input: &|offset| outside.has_double(offset),
    };
    let kept = keeper.keep(&mut maker, &mut memory);
    outside.put(source.image, &mut maker, &mut memory);
    let plcs = tables.programs.iter().filter(|plc| !plc.compiled && plc.number > 0).count();
    let (last_latches, last) = keep::number(&mut maker, plcs as u64);
    let mut tick = Tick { source, code, pmac: Rc::clone(&pmac), maker, memory, clocks, last };
    tick.count_time();
    tick.servo_cycle();
    let Tick { mut maker, memory, last, .. } = tick;
    maker.next_all(&last_latches, &last);
    finish(&kept, &mut maker, &memory);
    observe(tables, view, &access, &pmac, (&mut maker, &memory), is_free);
    maker.finish(memory, TRUE, TRUE)
}

fn finish(kept: &[Short], maker: &mut Maker, memory: &Memory) {
    for short in kept {
        short.finish(maker, memory);
    }
}

impl Tick<'_> {
    /// The servo cycle counter goes up, the timers go down.
    fn count_time(&mut self) {
        let at = self.clocks.cycles as usize;
        let mut cycles = self.memory.load(at, 3);
        let graph = &mut self.maker.builder.graph;
        let one = graph.number(cycles.len(), 1);
        cycles = graph.add(&cycles, &one);
        self.memory.store(at, &cycles);
        for at in self.clocks.timers.clone() {
            let time = self.memory.load(at as usize, 3);
            let time = less_by_one(&mut self.maker.builder.graph, &time, TIMER_END);
            self.memory.store(at as usize, &time);
        }
    }

    fn servo_cycle(&mut self) {
        let interval =
            number(&self.memory.load(self.i(8), 8)).map(|bits| f64::from_bits(bits as u64) as u32);
        if interval.is_none() {
            let text =
                "the program changes I8, the time between its interrupts, which is not followed"
                    .into();
            let reason = self.maker.builder.reason(Reason { text, place: None });
            self.maker.builder.escapes.push((TRUE, reason));
        }
        let interval = interval.unwrap_or(0);
        let (latches, left) = keep::number(&mut self.maker, interval.into());
        let graph = &mut self.maker.builder.graph;
        let is_due = !graph.is_not_zero(&left);
        let full = graph.number(left.len(), interval.into());
        let ones = graph.number(left.len(), -1);
        let less = graph.add(&left, &ones);
        let next = graph.choose_bits(is_due, &full, &less);
        self.maker.next_all(&latches, &next);
        self.interrupt(is_due);
        for _ in 0..self.source.settings.background_steps {
            self.background_step();
        }
        if self.source.settings.background_steps == 0 {
            self.pmac.queue.borrow_mut().clear();
        }
    }

    /// The offset of an I-variable.
    fn i(&self, number: u32) -> usize {
        self.pmac.layout.i_offset(number) as usize
    }

    /// Whether I5 is one of two values.
    fn i5(&mut self, values: [f64; 2]) -> Lit {
        let i5 = self.memory.load(self.i(5), DOUBLE_SIZE as usize);
        let graph = &mut self.maker.builder.graph;
        let mut any = FALSE;
        for value in values {
            // What is behind the point does not count.
            let bound = |value: f64| value.to_bits() as i64;
            let (low, high) =
                (graph.number(64, bound(value)), graph.number(64, bound(value + 1.0)));
            let (_, below, _) = graph.compare_floats(&i5, &low);
            let (_, above, _) = graph.compare_floats(&i5, &high);
            let is_it = graph.and(!below, above);
            any = graph.or(any, is_it);
        }
        any
    }

    /// The real-time interrupt: PLC 0, then PLCC 0.
    fn interrupt(&mut self, is_due: Lit) {
        if let Some(at) = self.clocks.watchdog {
            let left = self.memory.load(at as usize, WORD_SIZE as usize);
            let graph = &mut self.maker.builder.graph;
            let step = graph.number(left.len(), WATCHDOG_STEP);
            let (less, is_enough) = graph.subtract(&left, &step);
            let less: Vec<Lit> = less.into_iter().map(|bit| graph.and(bit, is_enough)).collect();
            let left = graph.choose_bits(is_due, &less, &left);
            self.memory.store(at as usize, &left);
        }
        let on = self.i5([1.0, 3.0]);
        let on = self.maker.builder.graph.and(on, is_due);
        for compiled in [false, true] {
            for plc in self.plcs(compiled, 0..=0) {
                self.run_if_enabled(plc, on);
            }
        }
    }

    /// PLCs or PLCCs by rising number.
    fn plcs(&self, compiled: bool, numbers: RangeInclusive<u32>) -> Vec<usize> {
        let plcs = self.pmac.programs.iter().enumerate();
        let wanted =
            plcs.filter(|(_, plc)| plc.compiled == compiled && numbers.contains(&plc.number));
        let mut found: Vec<(u32, usize)> = wanted.map(|(at, plc)| (plc.number, at)).collect();
        found.sort_unstable();
        found.into_iter().map(|(_, at)| at).collect()
    }

    /// The next interpreted PLC, all PLCCs, housekeeping, commands.
    fn background_step(&mut self) {
        self.next_plc();
        for plc in self.plcs(true, 1..=31) {
            let on = self.i5([2.0, 3.0]);
            self.run_if_enabled(plc, on);
        }
        if let Some(at) = self.clocks.watchdog {
            let start = self.maker.builder.graph.number(32, WATCHDOG_START);
            self.memory.store(at as usize, &start);
        }
        self.commands();
    }

    /// Runs the enabled PLC after the one that ran last, around from 31 to 1.
    fn next_plc(&mut self) {
        let on = self.i5([2.0, 3.0]);
        let plcs = self.plcs(false, 1..=31);
        let graph = &mut self.maker.builder.graph;
        let enabled: Vec<Lit> =
            plcs.iter().map(|&plc| self.pmac.is_enabled(&self.memory, plc)).collect();
        // Those after the last one, and all of them where none of these is enabled.
        let mut after = vec![];
        for (place, &enabled) in enabled.iter().enumerate() {
            let this = graph.number(self.last.len(), place as i64 + 1);
            let is_after = graph.less_unsigned(&self.last, &this);
            after.push(graph.and(enabled, is_after));
        }
        let any_after = graph.any(after.iter().copied());
        let (mut before, mut chosen) = (FALSE, vec![]);
        for (&after, &enabled) in after.iter().zip(&enabled) {
            let wanted = graph.choose(any_after, after, enabled);
            chosen.push(graph.all([on, wanted, !before]));
            before = graph.or(before, wanted);
        }
        let begin = self.memory.clone();
        for ((place, &plc), &chosen) in (1..).zip(&plcs).zip(&chosen) {
            let graph = &mut self.maker.builder.graph;
            let this = graph.number(self.last.len(), place);
            self.last = graph.choose_bits(chosen, &this, &self.last);
            let Some(ended) = self.scan(plc, chosen, &begin) else { continue };
            let mut ended = ended;
            ended.choose(&mut self.maker.builder.graph, chosen, &self.memory);
            self.memory = ended;
        }
    }

    fn run_if_enabled(&mut self, plc: usize, on: Lit) {
        let enabled = self.pmac.is_enabled(&self.memory, plc);
        let cond = self.maker.builder.graph.and(on, enabled);
        let begin = self.memory.clone();
        if let Some(mut ended) = self.scan(plc, cond, &begin) {
            ended.choose(&mut self.maker.builder.graph, cond, &begin);
            self.memory = ended;
        }
    }

    /// The image after a scan of a PLC; `None` where it does not run.
    fn scan(&mut self, plc: usize, cond: Lit, begin: &Memory) -> Option<Memory> {
        let program = *self.pmac.programs.get(plc)?;
        let task = program.task as usize;
        let points = self.code.module.tasks.get(task)?.resume_points.len();
        let builder = &mut self.maker.builder;
        let mut entered = begin.clone();
        let conds = self.pmac.begin(&mut builder.graph, &mut entered, plc, cond, points);
        self.pmac.running.set(context(program.compiled, program.number));
        let ends = self.code.scan_from(builder, task, &conds, &entered, u32::MAX);
        ends.end.map(|(_, memory)| memory)
    }

    /// Does the commands that wait, in their order.
    fn commands(&mut self) {
        let at = self.pmac.layout.q_base_at(COMMAND_CONTEXT) as usize;
        let queue = std::mem::take(&mut *self.pmac.queue.borrow_mut());
        for command in queue {
            let before = self.memory.clone();
            let mut now = before.clone();
            now.store(at, &command.q_base);
            self.pmac.running.set(COMMAND_CONTEXT);
            for task in command.tasks {
                let builder = &mut self.maker.builder;
                let ends = self.code.scan(builder, task as usize, command.cond, &now, u32::MAX);
                if let Some((_, memory)) = ends.end {
                    now = memory;
                }
            }
            now.choose(&mut self.maker.builder.graph, command.cond, &before);
            self.memory = now;
        }
    }
}

/// Notes what is seen of the program: its outputs, the I-variables that it writes, and the P- and Q-variables where it keeps
/// them.
fn observe(
    tables: &PmacTables,
    view: View<'_>,
    access: &Access,
    pmac: &Pmac,
    (maker, memory): (&mut Maker, &Memory),
    keeps: bool,
) {
    let layout = &pmac.layout;
    let mut add = |name: String, places: Vec<places::BitPlace>, is_retained| {
        let bits = places.into_iter().enumerate().map(|(number, (offset, bit))| {
            let line = outside::line(layout, (offset, bit));
            let key = line.unwrap_or_else(|| format!("{name}.{number}"));
            (key, (offset, bit), memory.bit(offset as usize, bit))
        });
        let bits = bits.collect();
        maker.observed.push(Observed { name, is_retained, bits });
    };
    for output in &tables.outputs {
        let number = output.variable.map(|variable| variable.number);
        let name = match output.variable {
            Some(variable) => PmacName::Variable(variable),
            None => PmacName::Memory(output.definition),
        };
        if let Some(bits) = places::bits(view.layout, number, output.definition) {
            add(name.to_string(), bits.places, false);
        }
    }
    for &offset in access.doubles.keys().filter(|offset| **offset < layout.mdef) {
        let is_i = offset >= layout.i;
        if is_i || keeps {
            add(keep::double_name(layout, offset), places::double(offset).places, !is_i);
        }
    }
}
