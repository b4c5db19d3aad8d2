//! The tables of a checked program that the executive needs.

use plcc_abi::{
    Program, Tables, Task,
    pmi::{Announcement, FlipFlop, PmiTables, Role, Special, Symbol, TextItem, Timer, Type},
};

use crate::common::{BrokenInvariant, OrMissing, natural_cmp};
use crate::pmi::{
    ast::{self, Checked, FlipFlopDef, Item, Meaning, SymbolId, TimerDef},
    layout::Layout,
};

/// Executive variables that survive power-off (PMI 3.4).
const RETAINED: [&str; 3] = ["@NVFLG", "@NVINT", "@NVLNG"];

type Result<T> = std::result::Result<T, BrokenInvariant>;

/// The program without its code. `files` are the names of its sources, `tasks` says where the code
/// of each task starts.
pub(crate) fn program(
    checked: &Checked,
    layout: &Layout,
    files: Vec<String>,
    tasks: Vec<Task>,
) -> Result<Program> {
    let tables = PmiTables {
        symbols: symbols(checked, layout)?,
        timers: timers(checked, layout)?,
        flipflops: flipflops(checked, layout)?,
        faults: announcements(checked, layout, &checked.faults)?,
        messages: announcements(checked, layout, &checked.messages)?,
        special: special(checked, layout)?,
        ports: layout.ports,
        initial: initial(checked, layout)?,
        codes: checked.codes.clone(),
    };
    Ok(Program {
        files,
        image_size: layout.size,
        regions: layout.regions.clone(),
        tasks,
        tables: Tables::Pmi(tables),
        names: vec![],
    })
}

/// A symbol's offset in the image.
fn offset(layout: &Layout, id: SymbolId) -> Result<u32> {
    layout.offset(id).or_missing(|| format!("the place of symbol {}", id.0))
}

fn symbols(checked: &Checked, layout: &Layout) -> Result<Vec<Symbol>> {
    let symbols = checked.symbols.iter().enumerate().filter_map(|(index, symbol)| {
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
        let offset = offset(layout, SymbolId(index as u32));
        Some(offset.map(|offset| Symbol {
            name: symbol.name.clone(),
            ty: symbol.ty,
            offset,
            elements: symbol.elements,
            role,
            dumped: symbol.named,
            retained: symbol.executive && RETAINED.contains(&symbol.name.as_str()),
        }))
    });
    let mut symbols = symbols.collect::<Result<Vec<Symbol>>>()?;
    symbols.sort_by(|a, b| natural_cmp(&a.name, &b.name));
    Ok(symbols)
}

fn timers(checked: &Checked, layout: &Layout) -> Result<Vec<Timer>> {
    let timer = |(index, timer): (usize, &TimerDef)| {
        let counter = layout.counters.get(index).copied();
        Ok(Timer {
            kind: timer.kind,
            control: offset(layout, timer.control)?,
            delayed: offset(layout, timer.delayed)?,
            counter: counter.or_missing(|| format!("the counter of timer {index}"))?,
            preset: timer.preset,
        })
    };
    checked.timers.iter().enumerate().map(timer).collect()
}

fn flipflops(checked: &Checked, layout: &Layout) -> Result<Vec<FlipFlop>> {
    let flipflop = |(index, flipflop): (usize, &FlipFlopDef)| {
        let last_clock = layout.last_clocks.get(index).copied();
        Ok(FlipFlop {
            q: offset(layout, flipflop.q)?,
            d: Some(offset(layout, flipflop.d)?),
            clock: Some(offset(layout, flipflop.clock)?),
            preset: Some(offset(layout, flipflop.preset)?),
            clear: Some(offset(layout, flipflop.clear)?),
            last_clock: last_clock.or_missing(|| format!("the last clock of flip-flop {index}"))?,
        })
    };
    checked.flipflops.iter().enumerate().map(flipflop).collect()
}

fn announcements(
    checked: &Checked,
    layout: &Layout,
    list: &[ast::Announcement],
) -> Result<Vec<Announcement>> {
    let symbol = |id: SymbolId| checked.symbol(id).or_missing(|| format!("symbol {}", id.0));
    let item = |item: &Item| match item {
        Item::Text(text) => Ok(TextItem::Text(text.clone())),
        Item::Value(id) => {
            Ok(TextItem::Value { ty: symbol(*id)?.ty, offset: offset(layout, *id)? })
        }
    };
    let announcement = |announcement: &ast::Announcement| {
        Ok(Announcement {
            name: symbol(announcement.symbol)?.name.clone(),
            offset: offset(layout, announcement.symbol)?,
            text: announcement.items.iter().map(item).collect::<Result<_>>()?,
        })
    };
    list.iter().map(announcement).collect()
}

/// The variables that the executive itself reads and writes.
fn special(checked: &Checked, layout: &Layout) -> Result<Special> {
    let offset = |name: &str| {
        let index = checked.symbols.iter().position(|symbol| symbol.name == name);
        offset(layout, SymbolId(index.or_missing(|| name)? as u32))
    };
    Ok(Special { ipl: offset("@IPL")?, estop: offset("@ESTOP")?, crset: offset("@CRSET")? })
}

/// The values that are not 0 at power-up, with offset and type: constants, and the timers'
/// counters, which are -1 while a timer does not run.
fn initial(checked: &Checked, layout: &Layout) -> Result<Vec<(u32, Type, i32)>> {
    let mut initial = vec![];
    for (index, symbol) in checked.symbols.iter().enumerate() {
        if let Meaning::Constant(values) = &symbol.meaning {
            let first = offset(layout, SymbolId(index as u32))?;
            for (i, &value) in values.iter().enumerate().filter(|&(_, &value)| value != 0) {
                initial.push((first + i as u32 * symbol.ty.size(), symbol.ty, value));
            }
        }
    }
    initial.extend(layout.counters.iter().map(|&counter| (counter, Type::Long, -1)));
    Ok(initial)
}
