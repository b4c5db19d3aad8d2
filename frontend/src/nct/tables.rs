//! The tables of a checked program that the executive needs.

use plcc_abi::{
    Program as AbiProgram, Tables, Task,
    nct::{NctName, NctSettings, NctTables},
};

use crate::nct::{
    ast::{Bit, ConditionPart, Op, Operand, Program, Space, Test, Texts, Variable, Word},
    layout::Layout,
    reachable::reachable,
};

/// The name under which a variable is watched and dumped. For an indirect access this is the name
/// of the word that holds the address. V has no name.
pub(crate) fn name(variable: Variable) -> Option<NctName> {
    let (space, byte, bit) = match variable {
        Variable::Bit(Bit { space, byte, bit }) => (space, byte, Some(bit)),
        Variable::Word(Word::Bytes { space, byte }) => (space, byte, None),
        Variable::Word(Word::Indirect(byte)) => (Space::F, byte, None),
        Variable::Word(Word::Rh(n)) => return Some(NctName::Rh(n.into())),
        Variable::Word(Word::Q(n)) => return Some(NctName::Q(n)),
        Variable::Word(Word::T(n)) => return Some(NctName::T(n)),
        Variable::Word(Word::H(n)) => return Some(NctName::H(n)),
        Variable::Word(Word::M(n)) => return Some(NctName::M(n)),
        Variable::Word(Word::Rp(n)) => return Some(NctName::Rp(n)),
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
/// [`tested_variable`].
pub(crate) fn each_variable(op: &Op, mut f: impl FnMut(Variable)) {
    let word = |byte| Variable::Word(Word::Bytes { space: Space::F, byte });
    match *op {
        Op::Set(bit) | Op::Clear(bit) => f(Variable::Bit(bit)),
        Op::Count { counter, .. } => f(Variable::Word(Word::Q(counter))),
        Op::Load(operand) | Op::Arith { operand, .. } => {
            if let Operand::Load { place: variable, .. } = operand {
                f(variable);
            }
        }
        Op::Store { place: variable, .. } | Op::Update { place: variable, .. } => f(variable),
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
pub(crate) fn tested_variable(cond: &ConditionPart) -> Option<Variable> {
    match *cond {
        ConditionPart::Test(Test::Bit { bit, .. }) => Some(Variable::Bit(bit)),
        ConditionPart::Test(Test::Word { word, .. }) => Some(Variable::Word(word)),
        ConditionPart::Test(Test::Relation {
            operand: Operand::Load { place: variable, .. },
            ..
        }) => Some(variable),
        ConditionPart::Test(Test::Relation { .. }) | ConditionPart::Gate(_) => None,
    }
}

/// The names of all variables that the program names, sorted.
pub(crate) fn named(program: &Program) -> Vec<NctName> {
    let mut all = vec![];
    for stmt in &program.stmts {
        each_variable(&stmt.op, |variable| all.extend(name(variable)));
    }
    all.extend(program.condition_parts.iter().filter_map(tested_variable).filter_map(name));
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
        names: vec![],
    }
}
