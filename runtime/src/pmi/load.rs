//! What is checked of a program before it runs.

use plcc_abi::pmi::{PORTS, PmiTables, Role, Type};
use plcc_abi::{Program, Tables};
use thiserror::Error;

/// Why a program can't be run.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PmiLoadError {
    /// It is in another language.
    #[error("this is no PMI program")]
    OtherDialect,
    /// Its tables don't fit its image.
    #[error("the program is damaged: {0}")]
    Damaged(String),
}

/// The tables of a PMI program, all of whose places lie in its image.
pub(super) fn tables(program: &Program) -> Result<&PmiTables, PmiLoadError> {
    let Tables::Pmi(tables) = &program.tables else { return Err(PmiLoadError::OtherDialect) };
    let size = u64::from(program.image_size);
    let inside = |offset: u32, length: u64| u64::from(offset) + length <= size;
    let check = |fits: bool, what: &str| {
        let outside = || PmiLoadError::Damaged(format!("{what} lies outside the image"));
        if fits { Ok(()) } else { Err(outside()) }
    };
    check(inside(tables.ports, PORTS.into()), "a port")?;
    for symbol in &tables.symbols {
        let length = u64::from(symbol.elements.unwrap_or(1)) * u64::from(symbol.ty.size());
        let part = match symbol.role {
            Role::Input(lines) | Role::Output(lines) => {
                let bits = u32::from(lines.low) + u32::from(lines.count);
                u32::from(lines.port) < PORTS && lines.count > 0 && bits <= 8
            }
            Role::TimerControl(timer) => (timer as usize) < tables.timers.len(),
            Role::FlipFlopPin(flipflop) => (flipflop as usize) < tables.flipflops.len(),
            Role::Variable | Role::Constant => true,
        };
        check(part && inside(symbol.offset, length), &symbol.name)?;
    }
    for timer in &tables.timers {
        let contacts = inside(timer.control, 1) && inside(timer.delayed, 1);
        check(contacts && inside(timer.counter, 4), "a timer")?;
    }
    for flipflop in &tables.flipflops {
        let pins = [flipflop.d, flipflop.clock, flipflop.preset, flipflop.clear];
        let mut pins = pins.into_iter().flatten().chain([flipflop.q, flipflop.last_clock]);
        check(pins.all(|pin| inside(pin, 1)), "a flip-flop")?;
    }
    let mut initial = tables.initial.iter();
    check(
        initial.all(|&(at, ty, _): &(u32, Type, i32)| inside(at, ty.size().into())),
        "a constant",
    )?;
    Ok(tables)
}
