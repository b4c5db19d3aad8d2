//! Online change of a PMI program: what belongs together in two programs, and how the state of one
//! becomes that of the other.

use plcc_abi::image::{read_u8, write_u8};
use plcc_abi::natural_cmp;
use plcc_abi::pmi::{Announcement, FlipFlop, Format, Lines, PmiTables, Role, Symbol, Timer, Type};

use super::{PmiExecutive, port_lines};
use crate::online_change::{Change, Comparison, Plan, Row};

/// Bytes that are copied from the old image to the new one: their offsets in each, and how many they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Copied {
    from: u32,
    to: u32,
    length: u32,
}

/// How the state of one program becomes that of another one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct PmiTransfer {
    copies: Vec<Copied>,
    /// Lines that outputs of the old program drive and none of the new one does: offset of the port
    /// in the new image, and their bits. They go off.
    cleared_lines: Vec<(u32, u8)>,
    /// For each fault or message that both programs have: its number in the old one and in the new one.
    announced: Vec<(usize, usize)>,
}

/// Physical lines, for people.
fn lines_text(lines: Lines) -> String {
    let Lines { port, low, count, format } = lines;
    let format = match format {
        Format::Bit => return format!("PORT{port}.{low}"),
        Format::Binary => "binary",
        Format::Bcd => "BCD",
        Format::TwosComplement => "two's complement",
    };
    format!("PORT{port}.{low} to PORT{port}.{}, {format}", low + count.saturating_sub(1))
}

/// What a variable is, for people; what differs here needs to be accepted.
fn describe(symbol: &Symbol, tables: &PmiTables) -> String {
    let ty = match symbol.ty {
        Type::Logical => "LOGICAL",
        Type::Integer => "INTEGER",
        Type::Long => "LONG",
    };
    let array = symbol.elements.map_or_else(String::new, |count| format!("[{count}]"));
    let role = match symbol.role {
        Role::Variable => "variable".into(),
        Role::Constant => "constant".into(),
        Role::Input(lines) => format!("input at {}", lines_text(lines)),
        Role::Output(lines) => format!("output at {}", lines_text(lines)),
        Role::TimerControl(timer) => {
            let kind = tables.timers.get(timer as usize).map(|timer| timer.kind);
            kind.map_or_else(String::new, |kind| format!("control contact of a timer {kind:?}"))
        }
        Role::FlipFlopPin(_) => "pin of a flip-flop".into(),
    };
    format!("{ty}{array}, {role}")
}

/// The name of the LOGICAL at an offset.
fn name_at(tables: &PmiTables, offset: u32) -> Option<&str> {
    let found = tables.symbols.iter().find(|s| s.offset == offset && s.ty == Type::Logical);
    found.map(|symbol| symbol.name.as_str())
}

/// The port and the bits in it of each output of a program.
fn driven(tables: &PmiTables) -> impl Iterator<Item = (u16, u8)> + '_ {
    tables.symbols.iter().filter_map(|symbol| match symbol.role {
        Role::Output(lines) => Some((lines.port, port_lines::mask(lines))),
        _ => None,
    })
}

/// Compares two PMI programs.
pub(super) fn compare(old: &PmiTables, new: &PmiTables) -> Comparison {
    let mut plan = PmiTransfer::default();
    let mut rows = vec![];
    let mut kept = 0;
    // Executive variables that no program names are there in both; they are kept in silence.
    let shown = |symbol: &Symbol| symbol.dumped;
    let by_name = |tables: &PmiTables| -> std::collections::HashMap<String, Symbol> {
        tables.symbols.iter().map(|symbol| (symbol.name.clone(), symbol.clone())).collect()
    };
    let (olds, news) = (by_name(old), by_name(new));
    for symbol in &new.symbols {
        let was = olds.get(&symbol.name);
        let named = |of: &Symbol, tables| shown(of).then(|| describe(of, tables));
        let before = was.and_then(|was| named(was, old));
        rows.extend(Row::of(&symbol.name, before, named(symbol, new)));
        let Some(was) = was else { continue };
        let constant = symbol.role == Role::Constant;
        if was.ty == symbol.ty && was.elements == symbol.elements && !constant {
            kept += usize::from(shown(symbol));
            let length = symbol.ty.size() * symbol.elements.unwrap_or(1);
            plan.copies.push(Copied { from: was.offset, to: symbol.offset, length });
        }
    }
    let gone =
        old.symbols.iter().filter(|symbol| !news.contains_key(&symbol.name) && shown(symbol));
    rows.extend(gone.filter_map(|symbol| Row::of(&symbol.name, Some(describe(symbol, old)), None)));

    let timer = |timers: &[Timer], tables: &PmiTables, name: &str| {
        timers.iter().find(|timer| name_at(tables, timer.control) == Some(name)).copied()
    };
    for timer_now in &new.timers {
        let name = name_at(new, timer_now.control).unwrap_or("");
        let Some(was) = timer(&old.timers, old, name).filter(|was| was.kind == timer_now.kind)
        else {
            continue;
        };
        plan.copies.push(Copied { from: was.counter, to: timer_now.counter, length: 4 });
        let preset = |timer: &Timer| Some(format!("delay of {} times 20 ms", timer.preset));
        // A new delay counts from the timer's next start; nothing about it is refused.
        rows.extend(
            Row::of(&format!("{name}#COUNT"), preset(&was), preset(timer_now))
                .map(|row| Row { needs_accept: false, ..row }),
        );
    }
    for now in &new.flipflops {
        let same = |was: &&FlipFlop| name_at(old, was.q) == name_at(new, now.q);
        if let Some(was) = old.flipflops.iter().find(same) {
            plan.copies.push(Copied { from: was.last_clock, to: now.last_clock, length: 1 });
        }
    }
    plan.copies.push(Copied { from: old.ports, to: new.ports, length: plcc_abi::pmi::PORTS });
    for (port, bits) in driven(old) {
        let still = driven(new).filter(|(driven, _)| *driven == port);
        let cleared = still.fold(bits, |left, (_, bits)| left & !bits);
        if cleared != 0 {
            plan.cleared_lines.push((new.ports + u32::from(port), cleared));
        }
    }
    let pairs = |was: &[Announcement], now: &[Announcement], first: (usize, usize)| {
        let find = |name: &str| was.iter().position(|old| old.name == name);
        let found = now.iter().enumerate().filter_map(|(i, new)| Some((find(&new.name)?, i)));
        found.map(|(from, to)| (from + first.0, to + first.1)).collect::<Vec<_>>()
    };
    plan.announced = pairs(&old.faults, &new.faults, (0, 0));
    let behind_faults = (old.faults.len(), new.faults.len());
    plan.announced.extend(pairs(&old.messages, &new.messages, behind_faults));
    rows.sort_by(|a, b| natural_cmp(&a.name, &b.name));
    debug_assert!(rows.iter().all(|row| row.needs_accept <= (row.change == Change::Changed)));
    Comparison { kept, rows, plan: Plan::new(plan) }
}

impl PmiExecutive {
    /// Takes the state of another program's executive over.
    pub(super) fn take_over_from(&mut self, old: &Self, plan: &PmiTransfer) {
        for &Copied { from, to, length } in &plan.copies {
            let from = old.image.get(from as usize..).and_then(|tail| tail.get(..length as usize));
            let to = self.image.get_mut(to as usize..);
            if let (Some(from), Some(to)) = (from, to.and_then(|t| t.get_mut(..length as usize))) {
                to.copy_from_slice(from);
            }
        }
        for &(offset, bits) in &plan.cleared_lines {
            let byte = read_u8(&self.image, offset) & !bits;
            write_u8(&mut self.image, offset, byte);
        }
        for &(from, to) in &plan.announced {
            let on = old.state.announced.get(from).copied().unwrap_or(false);
            if let Some(announced) = self.state.announced.get_mut(to) {
                *announced = on;
            }
        }
        self.state.tick = old.state.tick;
        self.state.timer_remainder = old.state.timer_remainder;
        self.state.tick_begun = old.state.tick_begun;
    }
}
