//! What timers' delayed contacts and flip-flops' outputs come of (PMI 3.1.9, 3.1.10).

use plcc_abi::image::{read_i32, read_u8};

use crate::pmi::ast::{Checked, FlipFlopDef, SymbolId, TimerDef};
use crate::pmi::layout::Layout;
use crate::presentation::Part;

/// Whether a variable is the delayed contact of a timer.
pub(super) fn is_delayed_contact(checked: &Checked, name: &str) -> bool {
    checked.timers.iter().any(|timer| is_named(checked, timer.delayed, name))
}

/// The parts of the timer or flip-flop whose contact or output a variable is.
pub(super) fn parts(checked: &Checked, layout: &Layout, name: &str, image: &[u8]) -> Vec<Part> {
    let mut timers = checked.timers.iter().zip(&layout.counters);
    if let Some((timer, &counter)) = timers.find(|(it, _)| is_named(checked, it.delayed, name)) {
        return of_timer(checked, timer, counter, image);
    }
    match checked.flipflops.iter().find(|it| is_named(checked, it.q, name)) {
        Some(flipflop) => of_flipflop(checked, layout, flipflop, image),
        None => vec![],
    }
}

fn is_named(checked: &Checked, id: SymbolId, name: &str) -> bool {
    checked.symbol(id).is_some_and(|symbol| symbol.name == name)
}

fn part(checked: &Checked, id: SymbolId, holds: bool) -> Option<Part> {
    Some(Part { name: checked.symbol(id)?.name.clone(), holds })
}

/// The control contact, and the counter while it runs: -1 means that it is off, 0 that it has timed out (PMI 5.2).
fn of_timer(checked: &Checked, timer: &TimerDef, counter: u32, image: &[u8]) -> Vec<Part> {
    let Some(control) = part(checked, timer.control, true) else { return vec![] };
    let count =
        Part { name: format!("{}#COUNT", control.name), holds: read_i32(image, counter) > 0 };
    vec![control, count]
}

/// CL rules over PR, and both rule over the clock (PMI 3.1.10.1).
fn of_flipflop(
    checked: &Checked,
    layout: &Layout,
    flipflop: &FlipFlopDef,
    image: &[u8],
) -> Vec<Part> {
    let on = |id| layout.offset(id).is_some_and(|offset| read_u8(image, offset) != 0);
    let (cleared, preset) = (on(flipflop.clear), on(flipflop.preset));
    let clocked = !cleared && !preset;
    let is_set = on(flipflop.q);
    let parts = [
        (flipflop.clear, cleared || is_set),
        (flipflop.preset, !cleared && (preset || !is_set)),
        (flipflop.d, clocked),
        (flipflop.clock, clocked),
    ];
    parts.into_iter().filter_map(|(id, holds)| part(checked, id, holds)).collect()
}
