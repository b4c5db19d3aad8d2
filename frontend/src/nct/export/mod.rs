//! A program of NCT in IEC 61131-3, with what the control does around it (rulings, Time): inputs, timers, the three modules, outputs.
//!
//! The modules share their subroutines, and a slice may suspend :000 at any jump back. So all statements are blocks of one CASE
//! in a loop, and the control's own steps are the first ones among them (`control.rs`).

mod arithmetic;
mod condition;
mod control;
mod own;
mod statement;
mod storage;

use std::collections::{BTreeMap, BTreeSet};

use plcc_abi::GivenName;
use plcc_abi::nct::{LINE_BYTES, NctSettings};
use plcc_diag::Diagnostic;
use plcc_iec::{Flow, Item, Kind, Names, Project, Step, Type, Variable};

use super::ast::{Bit, Op, Program, Space, Stmt, Variable as Named, Word};
use super::status_flags::{BCD_SIGN, HIGH_WORD};
use super::tables::{each_variable, named, tested_variable};
use crate::common::{Exported, Held};
use own::Own;
use storage::{Storage, Unit};

/// The time between two slices.
const SLICE_US: u64 = 20_000;

/// The program under a name, or the statements that can't be written. `given` says what people say of its variables.
pub(super) fn export(
    program: &Program,
    settings: &NctSettings,
    name: &str,
    given: &[GivenName],
) -> Result<Exported, Vec<Diagnostic>> {
    let refused: Vec<Diagnostic> = program.stmts.iter().filter_map(refused).collect();
    if !refused.is_empty() {
        return Err(refused);
    }
    let mut names = Names::new();
    let writer = Writer::new(program, settings, &mut names);
    let items = writer.items();
    let entries = writer.entries();
    let flow = Flow::new(&items, entries, &writer.own.next);
    let body = writer.body(&flow);
    let variables = writer.declarations(given);
    let project = Project {
        name: names.make(name),
        comments: vec![
            format!("{}, a program of an NCT, written in IEC 61131-3 by plcc", program.name),
            "Each call of the program is a slice of 20 ms".into(),
        ],
        variables,
        body,
        interval_us: SLICE_US,
    }
    .complete();
    Ok(Exported { project, names: writer.pairs(), notes: notes(program, settings) })
}

/// What is wrong with a statement that can't be written.
fn refused(stmt: &Stmt) -> Option<Diagnostic> {
    let Op::Area { op, .. } = stmt.op else { return None };
    let text = format!(
        "{} works on registers of the control, and is not written in IEC 61131-3",
        op.name()
    );
    let help =
        "write it in simpler statements, or write the machine's new program for this place by hand";
    Some(Diagnostic::error("NCT-X4", stmt.span, text).help(help))
}

/// Texts that the control shows, and what the machine file puts into the tool pots.
fn notes(program: &Program, settings: &NctSettings) -> Vec<Diagnostic> {
    let texts = program.stmts.iter().filter(|stmt| matches!(stmt.op, Op::Text));
    let note = |stmt: &Stmt| {
        let text = "the control shows these texts; IEC 61131-3 has nothing for that, and something else has to show them";
        Diagnostic::standalone_note("NCT-X5", stmt.span, text)
    };
    let pots = program.stmts.first().filter(|_| !settings.tool_pots.is_empty()).map(|stmt| {
        let text = "what [tool_pots] of the machine file puts into the pots at first is not written: the exported program begins with pots of 0";
        Diagnostic::standalone_note("NCT-X5", stmt.span, text)
    });
    texts.map(note).chain(pots).collect()
}

/// Writes a program.
struct Writer<'a> {
    program: &'a Program,
    settings: &'a NctSettings,
    inputs: Storage,
    outputs: Storage,
    flags: Storage,
    /// Lines of inputs and outputs that are used.
    lines_in: BTreeMap<(u16, u8), String>,
    lines_out: BTreeMap<(u16, u8), String>,
    /// What the NC gives, for each unit of inputs that is not a line.
    from_nc: BTreeMap<Unit, String>,
    /// Registers, counters, timers and constants.
    registers: BTreeMap<Word, String>,
    /// The images of a unit of inputs: the one before, and those of :001 and :000 with the ones before them.
    images: BTreeMap<Unit, [String; 5]>,
    own: Own,
}

fn bit(space: Space, digits: u16) -> Bit {
    Bit { space, byte: digits / 10, bit: (digits % 10) as u8 }
}

/// I510 and I543, which the control itself sets.
pub(super) const FIRST_SLICE: u16 = 510;
pub(super) const LEVEL0_BEGINS: u16 = 543;
/// Y541 and Y546, which the control asks.
pub(super) const NO_SYNCHRONISATION: u16 = 541;
pub(super) const LEVEL2_ENABLE: u16 = 546;

impl<'a> Writer<'a> {
    fn new(program: &'a Program, settings: &'a NctSettings, names: &mut Names) -> Self {
        let is_indirect = |variable: Named| matches!(variable, Named::Word(Word::Indirect(_)));
        let mut all_flags = false;
        let mut used: Vec<Named> = vec![];
        let mut note = |variable: Named| {
            all_flags |= is_indirect(variable);
            used.push(variable);
        };
        program.stmts.iter().for_each(|stmt| each_variable(&stmt.op, &mut note));
        program.condition_parts.iter().filter_map(tested_variable).for_each(&mut note);
        let products = program.stmts.iter().any(|stmt| {
            use super::ast::Arith::{Div, Mul};
            matches!(stmt.op, Op::Arith { op: Mul | Div, .. } | Op::Apply { op: Mul | Div, .. })
        });
        let mut extra_flags = vec![];
        if products {
            extra_flags.push(Named::Word(HIGH_WORD));
        }
        if program.stmts.iter().any(|stmt| stmt.op == Op::Bin) {
            extra_flags.push(Named::Bit(BCD_SIGN));
        }
        let asked = [NO_SYNCHRONISATION, LEVEL2_ENABLE].map(|it| Named::Bit(bit(Space::Y, it)));
        let has_level2 = program.modules().any(|(module, _)| module == 2);
        let asked = if has_level2 { &asked[..] } else { &asked[..1] };
        let inputs = Storage::new(program, Space::I, &[], false, names);
        let outputs = Storage::new(program, Space::Y, asked, false, names);
        let flags = Storage::new(program, Space::F, &extra_flags, all_flags, names);
        let registers = used.iter().filter_map(|variable| match variable {
            Named::Word(Word::Bytes { .. } | Word::Indirect(_)) | Named::Bit(_) => None,
            Named::Word(word) => Some(*word),
        });
        let registers: BTreeSet<Word> = registers.chain(counted(program)).collect();
        let registers =
            registers.into_iter().map(|word| (word, names.make(&word.to_string()))).collect();
        let own = Own::new(program, names);
        let mut this = Self {
            program,
            settings,
            inputs,
            outputs,
            flags,
            lines_in: BTreeMap::new(),
            lines_out: BTreeMap::new(),
            from_nc: BTreeMap::new(),
            registers,
            images: BTreeMap::new(),
            own,
        };
        this.find_lines(&used, names);
        this.find_images(names);
        this
    }

    /// The lines that the program names, and those after its images.
    fn find_lines(&mut self, used: &[Named], names: &mut Names) {
        let (mut lines_in, mut lines_out) = (BTreeSet::new(), BTreeSet::new());
        for variable in used {
            let (space, bits) = match *variable {
                Named::Bit(bit) => (bit.space, vec![(bit.byte, bit.bit)]),
                Named::Word(Word::Bytes { space, byte }) => (space, bits_of(Unit::Word(byte))),
                Named::Word(_) => continue,
            };
            let bits = bits.into_iter().filter(|(byte, _)| usize::from(*byte) < LINE_BYTES);
            match space {
                Space::P => lines_in.extend(bits),
                Space::O => lines_out.extend(bits),
                Space::I | Space::V | Space::Y | Space::F => {}
            }
        }
        for &unit in self.inputs.units.keys() {
            let (lines, others): (Vec<_>, Vec<_>) =
                bits_of(unit).into_iter().partition(|(byte, _)| usize::from(*byte) < LINE_BYTES);
            lines_in.extend(lines);
            if !others.is_empty() {
                let title = storage::title('I', 2, unit).replacen('I', "NC", 1);
                self.from_nc.insert(unit, names.make(&title));
            }
        }
        for &unit in self.outputs.units.keys() {
            lines_out.extend(
                bits_of(unit).into_iter().filter(|(byte, _)| usize::from(*byte) < LINE_BYTES),
            );
        }
        let name = |letter: char, names: &mut Names, (byte, bit): (u16, u8)| {
            ((byte, bit), names.make(&format!("{letter}{byte:02}{bit}")))
        };
        self.lines_in = lines_in.into_iter().map(|line| name('P', names, line)).collect();
        self.lines_out = lines_out.into_iter().map(|line| name('O', names, line)).collect();
    }

    /// The images of the inputs: :000 has its own, and V compares each with the one before.
    fn find_images(&mut self, names: &mut Names) {
        for (&unit, name) in &self.inputs.units {
            let images = ["BEFORE", "OF_1", "BEFORE_1", "OF_0", "BEFORE_0"]
                .map(|text| names.make(&format!("{name}_{text}")));
            self.images.insert(unit, images);
        }
    }

    /// The storage of a kind; lines have none.
    fn storage(&self, space: Space) -> Option<&Storage> {
        match space {
            Space::I | Space::V => Some(&self.inputs),
            Space::Y => Some(&self.outputs),
            Space::F => Some(&self.flags),
            Space::P | Space::O => None,
        }
    }

    fn line(&self, space: Space, byte: u16, bit: u8) -> &str {
        let lines = if space == Space::P { &self.lines_in } else { &self.lines_out };
        lines.get(&(byte, bit)).map_or("FALSE", String::as_str)
    }

    /// All statements, the control's steps first.
    fn items(&self) -> Vec<Item> {
        let mut items = self.steps_of_control();
        let mut line_before = 0;
        for (at, stmt) in self.program.stmts.iter().enumerate() {
            let step = self.step(at, &stmt.op);
            let mut item = Item::from(step);
            let line = self.program.lines.get(at).copied().unwrap_or(0);
            if line != line_before {
                item.comments.extend(self.source_between(line_before, line));
                line_before = line;
            }
            items.push(item);
        }
        // The end of the text ends the module that comes there.
        items.push(Step::Leave(vec![format!("{} := {};", self.own.next, self.own.after)]).into());
        items
    }

    /// The text of the lines after one up to another.
    fn source_between(&self, before: u32, line: u32) -> Vec<String> {
        let from = before.min(line) as usize;
        let lines = self.program.text.lines().skip(from).take((line as usize).saturating_sub(from));
        lines.map(str::trim).filter(|text| !text.is_empty()).map(str::to_owned).collect()
    }

    /// The items at which control arrives by the number of a block.
    fn entries(&self) -> BTreeSet<usize> {
        let mut entries: BTreeSet<usize> = (0..control::STEPS).collect();
        entries.extend(self.program.modules().map(|(_, at)| control::item(at)));
        let mut indirect = false;
        for (at, stmt) in self.program.stmts.iter().enumerate() {
            match stmt.op {
                Op::Goto(label) => {
                    entries.extend(
                        self.program.target(label).filter(|to| *to <= at).map(control::item),
                    );
                }
                Op::Call(label) => {
                    entries.extend(self.program.target(label).map(control::item));
                    entries.insert(control::item(at + 1));
                }
                Op::CallIndirect(_) | Op::GotoIndirect(_) => {
                    indirect = true;
                    entries.insert(control::item(at + 1));
                }
                _ => {}
            }
        }
        if indirect {
            entries.extend(self.program.indirect_targets().map(control::item));
        }
        entries
    }

    fn declarations(&self, given: &[GivenName]) -> Vec<Variable> {
        let said: BTreeMap<&str, &str> =
            given.iter().rev().map(|given| (given.name.as_str(), given.text.as_str())).collect();
        let about = |name: &str| said.get(name).copied().unwrap_or("").to_owned();
        let mut list = vec![];
        for (lines, letter, direction) in [(&self.lines_in, 'P', 'I'), (&self.lines_out, 'O', 'Q')]
        {
            let image = if letter == 'P' { 'I' } else { 'Y' };
            list.extend(lines.iter().map(|((byte, bit), name)| Variable {
                address: Some(format!("%{direction}X{byte}.{bit}")),
                ..Variable::local(name, Type::Bool, about(&format!("{image}{byte:02}{bit}")))
            }));
        }
        for (unit, name) in &self.from_nc {
            let title = storage::title('I', 2, *unit);
            let about = match about(&title) {
                text if text.is_empty() => format!("{title} as the NC gives it"),
                text => format!("{title} as the NC gives it: {text}"),
            };
            list.push(Variable {
                kind: Kind::Input,
                ..Variable::local(name, type_of(*unit), about)
            });
        }
        let said = &said;
        let of = |letter: char, width| move |unit| about_unit(said, letter, width, unit);
        self.inputs.declare(&mut list, of('I', 2));
        self.outputs.declare(&mut list, of('Y', 2));
        self.flags.declare(&mut list, of('F', 3));
        for (word, name) in &self.registers {
            let initial = match *word {
                Word::Rp(number) => self
                    .settings
                    .constants
                    .iter()
                    .filter(|(constant, _)| *constant == u16::from(number))
                    .map(|(_, value)| value.to_string())
                    .next_back()
                    .into_iter()
                    .collect(),
                _ => vec![],
            };
            let about = about(&word.to_string());
            list.push(Variable { initial, ..Variable::local(name, Type::Uint, about) });
        }
        for (unit, images) in &self.images {
            let title = storage::title('I', 2, *unit);
            let what = ["before", "of :001", "of :001 before", "of :000", "of :000 before"];
            for (name, what) in images.iter().zip(what) {
                list.push(Variable::local(name, type_of(*unit), format!("{title} {what}")));
            }
        }
        self.own.declare(&mut list);
        list
    }

    /// What each variable that the program names is called.
    fn pairs(&self) -> Vec<(String, Held)> {
        let mut pairs: Vec<(String, Held)> = vec![];
        for name in named(self.program) {
            use plcc_abi::nct::NctName;
            let held = match name {
                NctName::I { byte, bit } => self.inputs.held(byte.into(), bit),
                NctName::Y { byte, bit } => self.outputs.held(byte.into(), bit),
                NctName::F { byte, bit } => self.flags.held(byte, bit),
                NctName::O { byte, bit: Some(bit) } => {
                    self.lines_out.get(&(byte.into(), bit)).cloned().map(Held::Variable)
                }
                NctName::P { .. } | NctName::O { .. } => None,
                other => {
                    let text = other.to_string();
                    let found = self.registers.iter().find(|(word, _)| word.to_string() == text);
                    found.map(|(_, name)| Held::Variable(name.clone()))
                }
            };
            pairs.extend(held.map(|held| (name.to_string(), held)));
        }
        for (number, (module, _)) in self.program.modules().enumerate() {
            if let Some(name) = self.own.op_of.get(number) {
                pairs.push((format!("OP{module}"), Held::Variable(name.clone())));
            }
        }
        pairs
    }
}

fn about_unit(said: &BTreeMap<&str, &str>, letter: char, width: usize, unit: Unit) -> String {
    said.get(storage::title(letter, width, unit).as_str()).copied().unwrap_or("").to_owned()
}

fn type_of(unit: Unit) -> Type {
    match unit {
        Unit::Bit(..) => Type::Bool,
        Unit::Word(_) => Type::Uint,
        Unit::Byte(_) => Type::Usint,
    }
}

/// The bits of a unit, the lowest first.
fn bits_of(unit: Unit) -> Vec<(u16, u8)> {
    let byte = |byte: u16| (0..8).map(move |bit| (byte, bit));
    match unit {
        Unit::Bit(byte, bit) => vec![(byte, bit)],
        Unit::Byte(at) => byte(at).collect(),
        Unit::Word(at) => byte(at).chain(byte(at + 1)).collect(),
    }
}

/// The counters that statements count.
fn counted(program: &Program) -> impl Iterator<Item = Word> {
    program.stmts.iter().filter_map(|stmt| match stmt.op {
        Op::Count { counter, .. } => Some(Word::Q(counter)),
        _ => None,
    })
}
