//! Whether the tables of a PMI program fit its image. The executive relies on it.

use plcc_abi::Program;
use plcc_abi::pmi::{
    Announcement, FlipFlop, Lines, PORTS, PmiTables, Role, Special, Symbol, TextItem, Timer, Type,
};

use crate::table_check::{Check, Image, ensure};

/// Checks that every place in the tables is inside the image, and every index inside its table.
pub(super) fn tables(tables: &PmiTables, program: &Program) -> Check {
    let image = Image::new(program.image_size);
    let PmiTables {
        symbols,
        timers,
        flipflops,
        faults,
        messages,
        special,
        ports,
        initial,
        codes: _,
    } = tables;
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
        ensure(fits, || {
            format!("its variable `{name}` has a line, timer or flip-flop that does not exist")
        })?;
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
