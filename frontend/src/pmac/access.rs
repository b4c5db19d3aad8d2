//! What a statement accesses, as observers are told: a variable, or a word of memory. Each kind of variable has an area,
//! Q-variables one for each coordinate system, and each space of memory has one.

use plcc_abi::pmac::{Definition, Field, Kind, PmacName, Variable};

use crate::common::Accessed;

/// The areas from this one on are memory. Before it, `8 * system + kind` are variables.
const MEMORY: u32 = 1 << 16;
/// PLCs and PLCCs.
const PLC: u32 = 1 << 17;
/// Values of simulated motors and coordinate systems, which no statement accesses.
const MOTION: u32 = 1 << 18;
/// How many kinds of variables there may be.
const KINDS: u32 = 8;

/// The place of a variable or word.
pub(super) fn accessed(name: PmacName) -> Accessed {
    match name {
        PmacName::Variable(Variable { kind, number, system }) => {
            Accessed::one(KINDS * system + kind.number(), number)
        }
        PmacName::Memory(definition) => {
            let space = match definition {
                Definition::X { .. } => 0,
                Definition::Y { .. } => 1,
                Definition::D { .. } => 2,
                Definition::Dp { .. } => 3,
                Definition::L { .. } => 4,
                Definition::F { .. } => 5,
                Definition::Tw { .. } => 6,
                Definition::Star => 7,
            };
            Accessed::one(MEMORY + space, definition.address())
        }
        PmacName::Plc { compiled, number } => Accessed::one(PLC + u32::from(compiled), number),
        PmacName::Motion(_) => Accessed::one(MOTION, 0),
    }
}

/// The variable or word at a place; `None` if there is none.
pub(super) fn name(accessed: Accessed) -> Option<PmacName> {
    let Accessed { area, first, .. } = accessed;
    if area == MOTION {
        return None;
    }
    if let Some(compiled) = area.checked_sub(PLC) {
        return Some(PmacName::Plc { compiled: compiled == 1, number: first });
    }
    let Some(space) = area.checked_sub(MEMORY) else {
        let kind = Kind::from_number(area % KINDS)?;
        return Some(PmacName::Variable(Variable { kind, number: first, system: area / KINDS }));
    };
    let (address, field) = (first, Field::WORD);
    Some(PmacName::Memory(match space {
        0 => Definition::X { address, field },
        1 => Definition::Y { address, field },
        2 => Definition::D { address },
        3 => Definition::Dp { address },
        4 => Definition::L { address },
        5 => Definition::F { address },
        6 => Definition::Tw { address },
        7 => Definition::Star,
        _ => return None,
    }))
}

/// Whether a place is memory, of which only the executive knows all words.
pub(super) fn is_memory(accessed: Accessed) -> bool {
    (MEMORY..PLC).contains(&accessed.area)
}

#[cfg(test)]
mod tests {
    use plcc_abi::pmac::{Controller, Layout};

    use super::*;

    #[test]
    fn places_have_the_names_that_they_are_of() {
        let layout = Layout::new(Controller::Turbo);
        for text in ["P5", "&2Q7", "Q7", "I8191", "L3", "X:$700", "Y:$78000", "DP:$60", "PLCC31"] {
            let place = accessed(PmacName::parse(text, &layout).unwrap());
            assert_eq!(name(place).unwrap().to_string(), text);
        }
    }
}
