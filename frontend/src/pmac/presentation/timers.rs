//! The variables and words that count servo cycles (guide, Timers).

use plcc_abi::pmac::{Controller, Definition, Kind, Layout, PmacName};

use super::io::definition;

/// The servo cycle counter.
const CYCLES: u32 = 0;
/// The words of the timers, X and Y.
const TIMERS: [u32; 2] = [0x700, 0x701];

/// Whether a variable or word is a timer, or the servo cycle counter.
pub(super) fn counts_time(layout: &Layout, name: &str, image: &[u8]) -> bool {
    let definition = match PmacName::parse(name, layout) {
        Ok(PmacName::Memory(definition)) => definition,
        Ok(PmacName::Variable(variable)) => match variable.kind {
            Kind::M => definition(image, layout, variable.number),
            Kind::I => return is_timer(layout.controller, variable.number),
            Kind::P | Kind::Q | Kind::L => return false,
        },
        Ok(PmacName::Plc { .. } | PmacName::Motion(_)) | Err(_) => return false,
    };
    match definition {
        Definition::X { address, .. } => address == CYCLES || TIMERS.contains(&address),
        Definition::Y { address, .. } => TIMERS.contains(&address),
        _ => false,
    }
}

/// Whether an I-variable of a Turbo PMAC is a timer of a coordinate system: Isx11 and Isx12, I5111 for the first one.
fn is_timer(controller: Controller, number: u32) -> bool {
    let system = (number / 100).wrapping_sub(50);
    controller == Controller::Turbo && (1..=16).contains(&system) && matches!(number % 100, 11 | 12)
}
