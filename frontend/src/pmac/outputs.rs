//! Finds the physical outputs of a download: the places in I/O memory that it writes.
//!
//! A PMAC has no declarations of outputs. Its lines are bits of I/O memory (guide, Memory Map), most of
//! which can be inputs as well as outputs. So a line is taken for an output if the download assigns it:
//!
//! | statement | outputs |
//! | --- | --- |
//! | `M1=1`, `M1..8=0`, `L3=1` | the bits that the variable is defined as, after load or by a COMMAND |
//! | `M(P1)=1` | those of all M-variables, since it may be any of them |
//! | `WY$FFC2,0` | the words |
//!
//! Also, the lines that the guide itself names as outputs are always among them.

use std::collections::{BTreeSet, HashSet};

use plcc_abi::image::read_u64;
use plcc_abi::pmac::motion::MotionKind;
use plcc_abi::pmac::{Controller, Definition, Field, Format, Kind, Output, Space, Variable};

use super::analyse::load::Loaded;
use super::ast::{Action, Download, Stmt, StmtKind, Target, WriteKind};

/// The lines of PMAC (1) that the guide calls outputs (appendix F): SEL0 to SEL7 and the machine outputs
/// 1 to 8. It does not describe the I/O memory of Turbo PMAC.
const NAMED_BY_THE_GUIDE: [Definition; 2] = [
    Definition::Y { address: 0xFFC1, field: Field { offset: 8, width: 8, format: Format::U } },
    Definition::Y { address: 0xFFC2, field: Field { offset: 8, width: 8, format: Format::U } },
];

/// What a download assigns.
#[derive(Default)]
struct Assigned {
    /// M- and L-variables, by kind and number.
    variables: BTreeSet<(Kind, u32)>,
    /// Whether it assigns to M-variables by computed numbers.
    any_m: bool,
    /// Words of memory that are written by their addresses.
    words: Vec<Definition>,
}

impl Assigned {
    /// Notes the target of an assignment.
    fn target(&mut self, target: Target) {
        let named = target.named().filter(|(kind, _)| matches!(kind, Kind::M | Kind::L));
        self.variables.extend(named.map(|(kind, number)| (kind, number.into())));
        self.any_m |= matches!(target, Target::Indirect(Kind::M, _));
    }

    /// Notes a word that is written by its address.
    fn word(&mut self, space: Space, address: u32) {
        self.words.push(Definition::word(space, address, Field::WORD));
    }

    /// Notes what an on-line command writes.
    fn online(&mut self, action: &Action) {
        match action {
            Action::Assign(target, _) => self.target(*target),
            Action::Write(kind, address, values) => {
                for address in (*address..).take(values.len()) {
                    if matches!(kind, WriteKind::X | WriteKind::Long | WriteKind::Double) {
                        self.word(Space::X, address);
                    }
                    if matches!(kind, WriteKind::Y | WriteKind::Long | WriteKind::Double) {
                        self.word(Space::Y, address);
                    }
                }
            }
            Action::Defaults(..)
            | Action::Define(..)
            | Action::Plc(..)
            | Action::System(_)
            | Action::Save
            | Action::DeletePlcc(_)
            | Action::Motion(_) => {}
        }
    }
}

/// The physical outputs of a download, by kind and number of their variables; those without a variable
/// come first. `tasks` are the statements of all tasks.
pub(super) fn outputs<'a>(
    download: &Download,
    loaded: &Loaded,
    tasks: impl IntoIterator<Item = &'a [Stmt]>,
) -> Vec<Output> {
    let mut assigned = Assigned::default();
    for command in &download.online {
        assigned.online(&command.action);
    }
    for stmt in tasks.into_iter().flatten() {
        match stmt.kind {
            StmtKind::Assign(target, _) => assigned.target(target),
            StmtKind::Word(space, address, _) => assigned.word(space, address),
            StmtKind::Motion(index, _) => {
                let motion = download.motion.get(index as usize).map(|motion| &motion.kind);
                if let Some(MotionKind::Sync(_, number)) = motion {
                    assigned.variables.insert((Kind::M, *number));
                }
            }
            StmtKind::If(..)
            | StmtKind::Jump(_)
            | StmtKind::While(..)
            | StmtKind::EndWhile(_)
            | StmtKind::Plc(..)
            | StmtKind::Address(..)
            | StmtKind::AddressBy(..)
            | StmtKind::Text(..)
            | StmtKind::Define(_)
            | StmtKind::Save
            | StmtKind::Loop(..) => {}
        }
    }
    let layout = &loaded.layout;
    if assigned.any_m {
        assigned.variables.extend((0..layout.count).map(|number| (Kind::M, number)));
    }
    let (mut outputs, mut seen) = (vec![], HashSet::new());
    let mut add = |variable: Option<(Kind, u32)>, definition: Definition| {
        let is_line = match definition {
            Definition::X { address, .. } => layout.is_io(Space::X, address),
            Definition::Y { address, .. } => layout.is_io(Space::Y, address),
            Definition::Tw { .. } => variable.is_some(),
            _ => false,
        };
        let variable = variable.map(|(kind, number)| Variable { kind, number, system: 1 });
        let output = Output { variable, definition };
        if is_line && seen.insert(output) {
            outputs.push(output);
        }
    };
    if layout.controller == Controller::Pmac {
        NAMED_BY_THE_GUIDE.into_iter().for_each(|lines| add(None, lines));
    }
    assigned.words.sort_unstable_by_key(|word| word.encode());
    assigned.words.dedup();
    assigned.words.iter().for_each(|&word| add(None, word));
    for &(kind, number) in &assigned.variables {
        if kind == Kind::L {
            let number = u16::try_from(number).ok();
            if let Some(&definition) = number.and_then(|number| download.l_defs.get(&number)) {
                add(Some((kind, number.map_or(0, u32::from))), definition);
            }
            continue;
        }
        let code = read_u64(&loaded.image, layout.definition_offset(number));
        add(Some((kind, number)), Definition::decode(code));
        let moves = download.defines.iter().filter(|d| (d.first..=d.last).contains(&number));
        moves.for_each(|define| add(Some((kind, number)), define.definition));
    }
    outputs
}
