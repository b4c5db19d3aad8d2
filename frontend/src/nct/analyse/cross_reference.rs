//! The cross-reference (NCT 5, STAT): where each variable is read, written and tested, and what
//! looks forgotten.

use std::collections::{BTreeMap, HashMap};

use plcc_abi::nct::NctName;
use plcc_diag::{Diagnostic, Span};

use crate::common::{CrossReference, CrossReferenceRow, Use};
use crate::nct::{
    ast::{AreaOp, Bit, Op, Program, Space, Variable, Word},
    reference::names::meaning,
    tables::{each_variable, name, tested_variable},
};

/// By what rows are sorted: the letters, the number of digits (so that words come before bits), the
/// digits.
type Key = (String, usize, String);

/// Makes the cross-reference of a program.
pub(crate) fn cross_reference(program: &Program) -> CrossReference {
    let mut warnings = BitUses::of(program).never_read();
    warnings.extend(outputs_of_several_modules(program));
    warnings.sort_by_key(|w| w.span.start);
    CrossReference { rows: rows(program, meaning, |_| true), warnings }
}

/// The rows of the cross-reference, with what `meaning` says of their names, made of the uses in lines of which
/// `is_asked` holds.
pub(crate) fn rows(
    program: &Program,
    meaning: fn(NctName) -> Option<&'static str>,
    is_asked: impl Fn(u32) -> bool,
) -> Vec<CrossReferenceRow> {
    let mut rows =
        Rows { rows: Vec::new(), of_variable: HashMap::new(), order: BTreeMap::new(), meaning };
    each_use(program, |at, variable, uses| {
        let line = program.lines.get(at).copied().unwrap_or(1);
        if is_asked(line) {
            rows.of(program, variable).into_iter().for_each(|row| add(row, line, uses));
        }
    });
    rows.sorted()
}

/// `read-never-written`: bits of flags and outputs that are read and never written.
pub(super) fn never_written(program: &Program) -> Vec<Diagnostic> {
    BitUses::of(program).never_written()
}

/// Tells `note` of each variable that a statement names: the statement's index, the variable, and how it is used.
fn each_use(program: &Program, mut note: impl FnMut(usize, Variable, &[Use])) {
    for (at, stmt) in program.stmts.iter().enumerate() {
        let mut each = |uses: &[Use]| each_variable(&stmt.op, |variable| note(at, variable, uses));
        match stmt.op {
            Op::If { first, count, .. } => {
                let range = first as usize..(first + count) as usize;
                for cond in program.condition_parts.get(range).unwrap_or_default() {
                    if let Some(variable) = tested_variable(cond) {
                        note(at, variable, &[Use::Tested]);
                    }
                }
            }
            // Of a word whose address is in another one, it is the other one that is named.
            Op::Store { place: place @ Variable::Word(Word::Indirect(_)), .. } => {
                note(at, place, &[Use::Read]);
            }
            Op::Update { place: Variable::Word(Word::Indirect(_)), .. } => each(&[Use::Read]),
            Op::Store { place, .. } => note(at, place, &[Use::Written]),
            Op::Set(_) | Op::Clear(_) => each(&[Use::Written]),
            Op::Count { .. } | Op::Update { .. } => each(&[Use::Read, Use::Written]),
            Op::Area { op, area } => {
                area_uses(op, area, |variable, used| note(at, variable, &[used]))
            }
            _ => each(&[Use::Read]),
        }
    }
}

/// A statement with a register area: the words of it that the statement reads, and the one
/// that a search writes what it has found into (NCT 4.14 to 4.16).
fn area_uses(op: AreaOp, area: u16, mut note: impl FnMut(Variable, Use)) {
    let (read, written) = match op {
        AreaOp::Hf => (4, Some(4)),
        AreaOp::Pf => (2, Some(2)),
        AreaOp::Cmp => (3, None),
        AreaOp::Mr | AreaOp::Mw | AreaOp::Add | AreaOp::Sub | AreaOp::Mul | AreaOp::Div => {
            (4, None)
        }
    };
    let uses = (0..read).map(|index| (index, Use::Read));
    for (index, used) in uses.chain(written.map(|index| (index, Use::Written))) {
        let byte = area.saturating_add(index * 2);
        if byte < Space::F.bytes() {
            note(Variable::Word(Word::Bytes { space: Space::F, byte }), used);
        }
    }
}

/// The rows that are being made.
struct Rows {
    rows: Vec<CrossReferenceRow>,
    /// The row of each variable; a word by its own name and one by the name of its address share one.
    of_variable: HashMap<Variable, usize>,
    order: BTreeMap<Key, usize>,
    meaning: fn(NctName) -> Option<&'static str>,
}

impl Rows {
    /// The row of a variable.
    fn of(&mut self, program: &Program, variable: Variable) -> Option<&mut CrossReferenceRow> {
        let at = match self.of_variable.get(&variable) {
            Some(&at) => at,
            None => {
                let at = self.enter(program, variable);
                self.of_variable.insert(variable, at);
                at
            }
        };
        self.rows.get_mut(at)
    }

    fn enter(&mut self, program: &Program, variable: Variable) -> usize {
        let text = match variable {
            Variable::Word(Word::Indirect(byte)) => format!("F{byte:03}"),
            variable => variable.to_string(),
        };
        // A bit without a name is one of V; it means what the input means whose changes it shows.
        let known = name(variable).or(match variable {
            Variable::Bit(Bit { byte, bit, .. }) => {
                Some(NctName::I { byte: byte as u8, bit: Some(bit) })
            }
            Variable::Word(_) => None,
        });
        let digits = text.find(|c: char| c.is_ascii_digit()).unwrap_or(text.len());
        let (letters, number) = text.split_at(digits);
        let key = (letters.to_owned(), number.len(), number.to_owned());
        *self.order.entry(key).or_insert_with(|| {
            self.rows.push(CrossReferenceRow {
                name: text.clone(),
                file: program.name.clone(),
                meaning: known.and_then(self.meaning).map(str::to_owned),
                ..CrossReferenceRow::default()
            });
            self.rows.len() - 1
        })
    }

    /// The rows in their order.
    fn sorted(mut self) -> Vec<CrossReferenceRow> {
        let rows = self.order.into_values();
        rows.filter_map(|at| self.rows.get_mut(at).map(std::mem::take)).collect()
    }
}

/// Adds uses in a line to a row.
fn add(row: &mut CrossReferenceRow, line: u32, uses: &[Use]) {
    for used in uses {
        let lines = match used {
            Use::Read => &mut row.read,
            Use::Written => &mut row.written,
            Use::Tested => &mut row.tested,
        };
        if lines.last() != Some(&line) {
            lines.push(line);
        }
    }
}

/// Which bits of flags and outputs a program writes, and which it reads or tests.
#[derive(Default)]
struct BitUses {
    /// For each bit of F and Y that is named: where it is first written, and first read or tested.
    bits: BTreeMap<Bit, [Option<Span>; 2]>,
    /// For each byte of F and Y in a word that is named: whether it is written, and read or tested.
    words: BTreeMap<(Space, u16), [bool; 2]>,
    /// Whether some flags are written at addresses that are computed while the program runs.
    writes_any_flag: bool,
}

impl BitUses {
    fn of(program: &Program) -> Self {
        let mut this = Self {
            writes_any_flag: program.stmts.iter().any(|stmt| writes_any_flag(&stmt.op)),
            ..Self::default()
        };
        each_use(program, |at, variable, uses| {
            let span = program.stmts.get(at).map(|stmt| stmt.span);
            for slot in uses.iter().map(|used| usize::from(*used != Use::Written)) {
                this.note(variable, slot, span);
            }
        });
        this
    }

    /// Notes a use of a variable: in slot 0 that it is written, in slot 1 that it is read or tested.
    fn note(&mut self, variable: Variable, slot: usize, span: Option<Span>) {
        match variable {
            Variable::Bit(bit) if matches!(bit.space, Space::F | Space::Y) => {
                let first = self.bits.entry(bit).or_default().get_mut(slot);
                first.into_iter().for_each(|first| *first = first.or(span));
            }
            Variable::Word(Word::Bytes { space: space @ (Space::F | Space::Y), byte }) => {
                for byte in [byte, byte + 1] {
                    let used = self.words.entry((space, byte)).or_default().get_mut(slot);
                    used.into_iter().for_each(|used| *used = true);
                }
            }
            Variable::Bit(_) | Variable::Word(_) => {}
        }
    }

    /// Bits of flags that are written and never read. Outputs are read by the machine and the NC.
    fn never_read(&self) -> Vec<Diagnostic> {
        self.one_sided(|bit, uses, [_, by_word_read]| match uses {
            [Some(span), None] if bit.space == Space::F && !by_word_read => Some(
                Diagnostic::warning("NCT-W4", span, format!("{bit} is written and never read"))
                    .help("remove what writes it, or look for the test that is missing"),
            ),
            _ => None,
        })
    }

    /// Bits of flags and outputs that are read and never written.
    fn never_written(&self) -> Vec<Diagnostic> {
        self.one_sided(|bit, uses, [by_word_written, _]| {
            let may_be_written = by_word_written || self.writes_any_flag && bit.space == Space::F;
            match uses {
                [None, Some(span)] if !may_be_written => Some(
                    Diagnostic::warning("NCT-W5", span, format!("{bit} is read and never written"))
                        .help("it stays 0 unless another device sets it"),
                ),
                _ => None,
            }
        })
    }

    /// What `finding` finds of the bits, from where each is first written and first read, and whether a word that holds it
    /// is written or read. F000 to F009 are left out, which the control writes.
    fn one_sided(
        &self,
        finding: impl Fn(&Bit, [Option<Span>; 2], [bool; 2]) -> Option<Diagnostic>,
    ) -> Vec<Diagnostic> {
        let bits = self.bits.iter().filter(|(bit, _)| bit.space != Space::F || bit.byte >= 10);
        let words = |bit: &Bit| self.words.get(&(bit.space, bit.byte)).copied().unwrap_or_default();
        bits.filter_map(|(bit, uses)| finding(bit, *uses, words(bit))).collect()
    }
}

/// Whether a statement writes flags whose address is in a register or a flag word (NCT 4.14, 4.15, indirect words).
fn writes_any_flag(op: &Op) -> bool {
    match op {
        Op::Store { place: Variable::Word(Word::Indirect(_)), .. }
        | Op::Update { place: Variable::Word(Word::Indirect(_)), .. } => true,
        Op::Area { op, .. } => match op {
            AreaOp::Mr | AreaOp::Add | AreaOp::Sub | AreaOp::Mul | AreaOp::Div => true,
            AreaOp::Hf | AreaOp::Pf | AreaOp::Mw | AreaOp::Cmp => false,
        },
        _ => false,
    }
}

/// For each statement a mask of the modules that can reach it: bit 0 for :000, bit 1 for :001, bit
/// 2 for :002.
pub(super) fn reached(program: &Program) -> Vec<u8> {
    let mut reached = vec![0_u8; program.stmts.len()];
    for (module, entry) in program.modules() {
        let mark = 1 << module;
        let mut open = vec![entry];
        let mut any_label = false;
        while let Some(at) = open.pop() {
            let Some(seen) = reached.get_mut(at).filter(|seen| **seen & mark == 0) else {
                continue;
            };
            *seen |= mark;
            let Some(stmt) = program.stmts.get(at) else { continue };
            match stmt.op {
                Op::If { otherwise, .. } => open.extend([at + 1, otherwise as usize + 1]),
                Op::Else { end } => open.push(end as usize + 1),
                Op::Goto(to) => open.extend(program.target(to)),
                Op::Call(to) => {
                    open.extend(program.target(to));
                    open.push(at + 1);
                }
                Op::GotoIndirect(_) | Op::CallIndirect(_) => {
                    if !any_label {
                        any_label = true;
                        open.extend(program.indirect_targets());
                    }
                    open.push(at + 1);
                }
                Op::Return | Op::End(_) => {}
                _ => open.push(at + 1),
            }
        }
    }
    reached
}

/// Warnings of outputs that more than one module switches.
pub(super) fn outputs_of_several_modules(program: &Program) -> Vec<Diagnostic> {
    let reached = reached(program);
    let mut first: BTreeMap<Bit, (u8, Span)> = BTreeMap::new();
    let mut reported = std::collections::BTreeSet::new();
    let mut warnings = vec![];
    for (stmt, &modules) in program.stmts.iter().zip(&reached) {
        let bit = match stmt.op {
            Op::Set(bit) | Op::Clear(bit) => bit,
            Op::Store { place: Variable::Bit(bit), .. }
            | Op::Update { place: Variable::Bit(bit), .. } => bit,
            _ => continue,
        };
        if modules == 0 || !matches!(bit.space, Space::Y | Space::O) {
            continue;
        }
        let (before, at) = *first.entry(bit).or_insert((modules, stmt.span));
        let both = before | modules;
        if both.count_ones() < 2 || !reported.insert(bit) {
            continue;
        }
        let names: Vec<String> =
            (0..3).filter(|m| both & (1 << m) != 0).map(|m| format!(":{m:03}")).collect();
        let message = format!("{bit} is set by the modules {}", names.join(" and "));
        let warning = Diagnostic::warning("NCT-W6", stmt.span, message)
            .help("let one module set it, and the others a flag that this one looks at");
        let elsewhere = at != stmt.span;
        warnings.push(if elsewhere { warning.label(at, "here too") } else { warning });
    }
    warnings
}
