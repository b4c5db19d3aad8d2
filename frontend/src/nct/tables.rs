//! The tables of a checked program that the executive needs.

use plcc_abi::{
    Program as AbiProgram, Tables, Task,
    nct::{NctName, NctSettings, NctTables},
};

use crate::nct::{
    ast::{Bit, ConditionPart, Op, Operand, Place, Program, Space, Test, Texts, Word},
    layout::Layout,
    reachable::reachable,
};

/// The name under which a variable is watched and dumped. For an indirect access this is the name
/// of the word that holds the address. V has no name.
pub(crate) fn name(place: Place) -> Option<NctName> {
    let (space, byte, bit) = match place {
        Place::Bit(Bit { space, byte, bit }) => (space, byte, Some(bit)),
        Place::Word(Word::Bytes { space, byte }) => (space, byte, None),
        Place::Word(Word::Indirect(byte)) => (Space::F, byte, None),
        Place::Word(Word::Rh(n)) => return Some(NctName::Rh(n.into())),
        Place::Word(Word::Q(n)) => return Some(NctName::Q(n)),
        Place::Word(Word::T(n)) => return Some(NctName::T(n)),
        Place::Word(Word::H(n)) => return Some(NctName::H(n)),
        Place::Word(Word::M(n)) => return Some(NctName::M(n)),
        Place::Word(Word::Rp(n)) => return Some(NctName::Rp(n)),
    };
    let low = u8::try_from(byte).unwrap_or(u8::MAX);
    Some(match space {
        Space::I => NctName::I { byte: low, bit },
        Space::Y => NctName::Y { byte: low, bit },
        Space::P => NctName::P { byte: low, bit },
        Space::O => NctName::O { byte: low, bit },
        Space::F => NctName::F { byte, bit },
        Space::V => return None,
    })
}

/// Calls `f` for each variable that a statement names. For those of conditions see
/// [`tested_place`].
pub(crate) fn places(op: &Op, mut f: impl FnMut(Place)) {
    let word = |byte| Place::Word(Word::Bytes { space: Space::F, byte });
    match *op {
        Op::Set(bit) | Op::Clear(bit) => f(Place::Bit(bit)),
        Op::Count { counter, .. } => f(Place::Word(Word::Q(counter))),
        Op::Load(operand) | Op::Arith { operand, .. } => {
            if let Operand::Load { place, .. } = operand {
                f(place);
            }
        }
        Op::Store { place, .. } | Op::Update { place, .. } => f(place),
        Op::GotoIndirect(byte) | Op::CallIndirect(byte) => f(word(byte)),
        Op::Area { area, .. } => f(word(area)),
        Op::Shift { .. }
        | Op::Bin
        | Op::Bcd
        | Op::Push(_)
        | Op::Apply { .. }
        | Op::If { .. }
        | Op::Else { .. }
        | Op::EndIf
        | Op::Label(_)
        | Op::Goto(_)
        | Op::Call(_)
        | Op::Return
        | Op::End(_)
        | Op::Text
        | Op::Bad { .. } => {}
    }
}

/// The variable that a part of a condition names.
pub(crate) fn tested_place(cond: &ConditionPart) -> Option<Place> {
    match *cond {
        ConditionPart::Test(Test::Bit { bit, .. }) => Some(Place::Bit(bit)),
        ConditionPart::Test(Test::Word { word, .. }) => Some(Place::Word(word)),
        ConditionPart::Test(Test::Relation { operand: Operand::Load { place, .. }, .. }) => {
            Some(place)
        }
        ConditionPart::Test(Test::Relation { .. }) | ConditionPart::Gate(_) => None,
    }
}

/// The names of all variables that the program names, sorted.
fn named(program: &Program) -> Vec<NctName> {
    let mut all = vec![];
    for stmt in &program.stmts {
        places(&stmt.op, |place| all.extend(name(place)));
    }
    all.extend(program.condition_parts.iter().filter_map(tested_place).filter_map(name));
    all.sort_unstable();
    all.dedup();
    all
}

/// The program without its code.
pub(crate) fn program(
    program: &Program,
    layout: &Layout,
    settings: NctSettings,
    tasks: Vec<Task>,
) -> AbiProgram {
    let Texts { softkeys, indexed, messages, info } = program.texts.clone();
    let tables = NctTables {
        inputs: layout.inputs.clone(),
        previous: layout.previous.clone(),
        outputs: layout.outputs.clone(),
        flags: layout.flags.clone(),
        texts197: softkeys,
        texts198: indexed,
        texts199: messages,
        info,
        named: named(program),
        reachable: reachable(program),
        settings,
    };
    AbiProgram {
        files: vec![program.name.clone()],
        image_size: layout.size,
        regions: layout.regions.clone(),
        tasks,
        tables: Tables::Nct(tables),
    }
}
