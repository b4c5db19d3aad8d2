//! The dialects' tables against the image.

use plcc_abi::Tables;
use plcc_abi::nct::{FLAG_BYTES, IMAGE_BYTES, NctHome, NctTables};
use plcc_abi::pmac::{Definition, Field, Kind, Layout, PmacTables, Run, Text};
use plcc_abi::pmi::{
    Announcement, FlipFlop, Lines, PmiTables, Role, Special, Symbol, TextItem, Timer, Type,
};

use super::{Check, ensure};

/// Ports of PMI (rulings, PMI: 16 boards of 128), a byte each.
const PORTS: u32 = 2048;

pub(super) fn tables(tables: &Tables, image_size: u32) -> Check {
    let image = Image { size: u64::from(image_size) };
    match tables {
        Tables::Pmi(tables) => pmi(tables, image),
        Tables::Nct(tables) => nct(tables, image),
        Tables::Pmac(tables) => pmac(tables, image),
    }
}

#[derive(Clone, Copy)]
struct Image {
    size: u64,
}

impl Image {
    /// Whether `length` bytes from `offset` are inside.
    fn holds(self, offset: u32, length: u32) -> bool {
        u64::from(offset) + u64::from(length) <= self.size
    }

    fn check(self, offset: u32, length: u32, what: &str) -> Check {
        ensure(self.holds(offset, length), || format!("{what} is outside the image"))
    }
}

fn pmi(tables: &PmiTables, image: Image) -> Check {
    let PmiTables { symbols, timers, flipflops, faults, messages, special, ports, initial } =
        tables;
    for Symbol { name, ty, offset, elements, role, dumped: _, retained: _ } in symbols {
        let length = u64::from(elements.unwrap_or(1)) * u64::from(ty.size());
        ensure(u64::from(*offset) + length <= image.size, || {
            format!("its variable `{name}` is outside the image")
        })?;
        let fits = match *role {
            Role::Variable | Role::Constant => true,
            Role::Input(lines) | Role::Output(lines) => lines_fit(lines),
            Role::TimerControl(index) => (index as usize) < timers.len(),
            Role::FlipFlopPin(index) => (index as usize) < flipflops.len(),
        };
        ensure(fits, || format!("its variable `{name}` belongs to nothing"))?;
    }
    for Timer { kind: _, control, delayed, counter, preset: _ } in timers {
        image.check(*control, 1, "a timer")?;
        image.check(*delayed, 1, "a timer")?;
        image.check(*counter, 4, "a timer")?;
    }
    for FlipFlop { q, d, clock, preset, clear, last_clock } in flipflops {
        for pin in [Some(*q), *d, *clock, *preset, *clear, Some(*last_clock)].into_iter().flatten()
        {
            image.check(pin, 1, "a flip-flop")?;
        }
    }
    for Announcement { name: _, offset, text } in faults.iter().chain(messages) {
        image.check(*offset, 1, "a fault or message")?;
        for item in text {
            if let TextItem::Value { ty, offset } = item {
                image.check(*offset, ty.size(), "a value in a text")?;
            }
        }
    }
    let Special { ipl, estop, crset } = *special;
    for offset in [ipl, estop, crset] {
        image.check(offset, Type::Logical.size(), "a variable of the executive")?;
    }
    image.check(*ports, PORTS, "a port")?;
    for &(offset, ty, _) in initial {
        image.check(offset, ty.size(), "a constant")?;
    }
    Ok(())
}

fn lines_fit(Lines { port, low, count, format: _ }: Lines) -> bool {
    u32::from(port) < PORTS && count >= 1 && low < 8 && count <= 8 - low
}

fn nct(tables: &NctTables, image: Image) -> Check {
    // Texts and settings are looked up with care by whoever uses them.
    let NctTables { inputs, previous, outputs, flags, named, .. } = tables;
    let groups = [
        (inputs, IMAGE_BYTES),
        (previous, IMAGE_BYTES),
        (outputs, IMAGE_BYTES),
        (flags, FLAG_BYTES),
    ];
    for (homes, count) in groups {
        ensure(homes.len() == count, || "a table of bytes has the wrong length".into())?;
        for &NctHome { offset, unpacked } in homes {
            image.check(offset, if unpacked { 8 } else { 1 }, "a byte of flags")?;
        }
    }
    for name in named {
        let known = name.to_string().parse().is_ok_and(|read| *name == read);
        ensure(known, || "it names a variable that does not exist".into())?;
    }
    Ok(())
}

fn pmac(tables: &PmacTables, image: Image) -> Check {
    let PmacTables { turbo, programs, texts, defines, ranges, l, named, initial, far: _, save: _ } =
        tables;
    let layout = Layout::new(*turbo);
    ensure(u64::from(layout.size) <= image.size, || "its image is too short".into())?;
    for program in programs {
        ensure(program.number < 32, || "it has a PLC beyond 31".into())?;
    }
    for text in texts {
        if let Text::Value { position: _, width, decimals } = *text {
            ensure(width <= 255 && decimals <= 255, || "a DISPLAY is too wide".into())?;
        }
    }
    for define in defines {
        let fits = define.first <= define.last && define.last < layout.count;
        ensure(fits && sound(define.definition), || "a definition makes no sense".into())?;
    }
    let rising = ranges.is_sorted_by_key(|&(number, _)| number)
        && l.is_sorted_by_key(|&(number, _)| number)
        && l.iter().all(|&(_, definition)| sound(definition));
    ensure(rising, || "its tables of variables are out of order".into())?;
    for variable in named {
        let fits = match variable.kind {
            Kind::Q => (1..=layout.systems()).contains(&variable.system),
            _ => variable.system == 1,
        };
        ensure(fits && variable.number < layout.count, || {
            "it names a variable that does not exist".into()
        })?;
    }
    for Run { offset, bytes } in initial {
        let length = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        image.check(*offset, length, "its initial state")?;
    }
    Ok(())
}

/// Whether a definition's bits are those of a word.
fn sound(definition: Definition) -> bool {
    match definition {
        Definition::X { field, .. } | Definition::Y { field, .. } => {
            let Field { offset, width, format: _ } = field;
            offset < 24 && (1..=24 - offset).contains(&width)
        }
        _ => true,
    }
}
