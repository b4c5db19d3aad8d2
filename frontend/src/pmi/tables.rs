//! A checked program as the executive knows it.

use plcc_abi::{
    Program, Tables, Task,
    pmi::{
        Announcement, FlipFlop, PmiTables, Role, Special, Symbol, TextItem, Timer, TimerKind, Type,
    },
};

use crate::common::natural_cmp;
use crate::pmi::{
    ast::{self, Checked, Item, Meaning, SymbolId},
    layout::Layout,
};

/// Executive variables that survive power-off (PMI 3.4).
const RETAINED: [&str; 3] = ["@NVFLG", "@NVINT", "@NVLNG"];

/// The program's tables; `files` are the sources' names and `tasks` where the code starts.
pub(crate) fn program(
    checked: &Checked,
    layout: &Layout,
    files: Vec<String>,
    tasks: Vec<Task>,
) -> Program {
    let tables = PmiTables {
        symbols: symbols(checked, layout),
        timers: timers(checked, layout),
        flipflops: flipflops(checked, layout),
        faults: announcements(checked, layout, &checked.faults),
        messages: announcements(checked, layout, &checked.messages),
        special: special(checked, layout),
        ports: layout.ports,
        initial: initial(checked, layout),
    };
    Program {
        files,
        image_size: layout.size,
        regions: layout.regions.clone(),
        tasks,
        tables: Tables::Pmi(tables),
    }
}

fn symbols(checked: &Checked, layout: &Layout) -> Vec<Symbol> {
    let mut symbols: Vec<Symbol> = checked
        .symbols
        .iter()
        .enumerate()
        .filter_map(|(index, symbol)| {
            let role = match &symbol.meaning {
                Meaning::Variable | Meaning::ReadOnly | Meaning::ResetOnly | Meaning::Derived => {
                    Role::Variable
                }
                Meaning::Input(lines) => Role::Input(*lines),
                Meaning::Output(lines) => Role::Output(*lines),
                Meaning::Constant(_) => Role::Constant,
                Meaning::TimerControl(timer) => Role::TimerControl(*timer),
                Meaning::Clock(flipflop) | Meaning::Pin(flipflop) => Role::FlipFlopPin(*flipflop),
                Meaning::Label(_) | Meaning::Unknown => return None,
            };
            Some(Symbol {
                name: symbol.name.clone(),
                ty: symbol.ty,
                offset: layout.place(SymbolId(index as u32)),
                elements: symbol.elements,
                role,
                dumped: symbol.named,
                retained: symbol.executive && RETAINED.contains(&symbol.name.as_str()),
            })
        })
        .collect();
    symbols.sort_by(|a, b| natural_cmp(&a.name, &b.name));
    symbols
}

fn timers(checked: &Checked, layout: &Layout) -> Vec<Timer> {
    let counters = layout.counters.iter();
    checked
        .timers
        .iter()
        .zip(counters)
        .map(|(timer, &counter)| Timer {
            kind: match timer.kind {
                TimerKind::E => TimerKind::E,
                TimerKind::D => TimerKind::D,
            },
            control: layout.place(timer.control),
            delayed: layout.place(timer.delayed),
            counter,
            preset: timer.preset,
        })
        .collect()
}

fn flipflops(checked: &Checked, layout: &Layout) -> Vec<FlipFlop> {
    let place = |id| Some(layout.place(id));
    checked
        .flipflops
        .iter()
        .zip(&layout.last_clocks)
        .map(|(flipflop, &last_clock)| FlipFlop {
            q: layout.place(flipflop.q),
            d: place(flipflop.d),
            clock: place(flipflop.clock),
            preset: place(flipflop.preset),
            clear: place(flipflop.clear),
            last_clock,
        })
        .collect()
}

fn announcements(
    checked: &Checked,
    layout: &Layout,
    list: &[ast::Announcement],
) -> Vec<Announcement> {
    list.iter()
        .filter_map(|announcement| {
            let symbol = checked.symbol(announcement.symbol)?;
            let text = announcement
                .items
                .iter()
                .filter_map(|item| match item {
                    Item::Text(text) => Some(TextItem::Text(text.clone())),
                    Item::Value(id) => {
                        let ty = checked.symbol(*id)?.ty;
                        Some(TextItem::Value { ty, offset: layout.place(*id) })
                    }
                })
                .collect();
            let offset = layout.place(announcement.symbol);
            Some(Announcement { name: symbol.name.clone(), offset, text })
        })
        .collect()
}

fn special(checked: &Checked, layout: &Layout) -> Special {
    let place = |name: &str| {
        let index = checked.symbols.iter().position(|symbol| symbol.name == name);
        index.map_or(0, |index| layout.place(SymbolId(index as u32)))
    };
    Special { ipl: place("@IPL"), estop: place("@ESTOP"), crset: place("@CRSET") }
}

/// What is not 0 at power-up: constants, and the counters of timers that do not run.
fn initial(checked: &Checked, layout: &Layout) -> Vec<(u32, Type, i32)> {
    let mut initial = vec![];
    for (index, symbol) in checked.symbols.iter().enumerate() {
        if let Meaning::Constant(values) = &symbol.meaning {
            let place = layout.place(SymbolId(index as u32));
            for (i, &value) in values.iter().enumerate().filter(|&(_, &value)| value != 0) {
                initial.push((place + i as u32 * symbol.ty.size(), symbol.ty, value));
            }
        }
    }
    initial.extend(layout.counters.iter().map(|&counter| (counter, Type::Long, -1)));
    initial
}
