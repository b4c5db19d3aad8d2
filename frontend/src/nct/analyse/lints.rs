//! The lints of NCT: what the language allows and a programmer seldom means. They look at the checked
//! program, so they are asked only where there is no error.

use std::collections::BTreeSet;

use plcc_diag::{Diagnostic, Span};

use super::cross_reference::{never_written, outputs_of_several_modules, reached};
use super::indentation::left_conditions;
use crate::nct::ast::{
    Bit, ConditionPart, Op, Operand, Program, Relation, Space, Stmt, Test, Variable, Word,
};

/// The strobes of functions: the NC sends a function and waits for FIN (NCT 2.2.1).
const STROBES: std::ops::RangeInclusive<(u16, u8)> = (52, 0)..=(53, 2);
/// FIN, Y547: the PLC has executed the block's functions (NCT 2.2.2).
const FIN: (u16, u8) = (54, 7);
/// The byte of the flags of messages with an index, Y700 to Y707 (NCT 3.5).
const INDEXED_BYTE: u16 = 70;
/// The bytes of the other flags of messages, Y710 to Y897 (NCT 3.6).
const MESSAGE_BYTES: std::ops::Range<u16> = 71..90;
/// The byte of the softkeys that a program defines: I500 to I507, lamps Y500 to Y507 (NCT 3.4).
const SOFTKEY_BYTE: u16 = 50;

/// All findings of the lints, in no particular order.
pub(crate) fn find(program: &Program) -> Vec<Diagnostic> {
    let reached = reached(program);
    let used = Used::of(program);
    let mut found = outputs_of_several_modules(program);
    found.extend(never_written(program));
    constant_conditions(program, &mut found);
    unreachable(program, &reached, &mut found);
    falls_through(program, &reached, &mut found);
    lost_z(program, &mut found);
    strobe_without_fin(&used, &mut found);
    timer_never_started(&used, &mut found);
    messages_without_text(program, &used, &mut found);
    texts_never_used(program, &used, &mut found);
    found
}

/// Which bits and words a program uses. Each is in a list once, with the first statement that uses
/// it so.
#[derive(Default)]
struct Used {
    read: Vec<(Variable, Span)>,
    written: Vec<(Variable, Span)>,
    /// The bits that are set by U, which are among those that are written.
    set: Vec<(Bit, Span)>,
}

impl Used {
    fn of(program: &Program) -> Self {
        let mut used = Self::default();
        for stmt in &program.stmts {
            used.statement(program, stmt);
        }
        for list in [&mut used.read, &mut used.written] {
            list.sort_by_key(|(variable, span)| (*variable, span.start));
            list.dedup_by_key(|(variable, _)| *variable);
        }
        used.set.sort_by_key(|(bit, span)| (*bit, span.start));
        used.set.dedup_by_key(|(bit, _)| *bit);
        used
    }

    fn statement(&mut self, program: &Program, stmt: &Stmt) {
        let span = stmt.span;
        match stmt.op {
            Op::Load(value) | Op::Arith { operand: value, .. } => self.operand(value, span),
            Op::If { first, count, .. } => {
                let parts = first as usize..(first + count) as usize;
                for part in program.condition_parts.get(parts).unwrap_or(&[]) {
                    match *part {
                        ConditionPart::Test(Test::Relation { operand: value, .. }) => {
                            self.operand(value, span)
                        }
                        ConditionPart::Test(Test::Bit { bit, .. }) => {
                            self.read.push((Variable::Bit(bit), span));
                        }
                        ConditionPart::Test(Test::Word { word, .. }) => {
                            self.read.push((Variable::Word(word), span));
                        }
                        ConditionPart::Gate(_) => {}
                    }
                }
            }
            Op::Set(bit) => {
                self.set.push((bit, span));
                self.written.push((Variable::Bit(bit), span));
            }
            Op::Clear(bit) => self.written.push((Variable::Bit(bit), span)),
            Op::Store { place: variable, .. } | Op::Update { place: variable, .. } => {
                self.written.push((variable, span));
            }
            _ => {}
        }
    }

    fn operand(&mut self, operand: Operand, span: Span) {
        if let Operand::Load { place: variable, .. } = operand {
            self.read.push((variable, span));
        }
    }

    /// Whether a bit of the output image is written, alone or in a word.
    fn writes_output(&self, byte: u16, bit: u8) -> bool {
        self.written.iter().any(|(variable, _)| match *variable {
            Variable::Bit(written) => written == Bit { space: Space::Y, byte, bit },
            Variable::Word(word) => has_byte(word, Space::Y, byte),
        })
    }

    /// Whether a byte of inputs or outputs is named at all.
    fn names_byte(&self, space: Space, byte: u16) -> bool {
        self.read.iter().chain(&self.written).any(|(variable, _)| match *variable {
            Variable::Bit(bit) => (bit.space, bit.byte) == (space, byte),
            Variable::Word(word) => has_byte(word, space, byte),
        })
    }
}

/// Whether a word holds a byte of this kind and number.
fn has_byte(word: Word, space: Space, byte: u16) -> bool {
    matches!(word, Word::Bytes { space: of, byte: low } if of == space && (low..=low + 1).contains(&byte))
}

/// Conditions that consist of one comparison whose result does not depend on OP. Comparisons that
/// every value fulfils (`>=0`) are left out, since they are the usual last case of a row.
fn constant_conditions(program: &Program, found: &mut Vec<Diagnostic>) {
    let mut op: Option<u16> = None;
    for stmt in &program.stmts {
        match stmt.op {
            Op::Load(Operand::Const(value)) => op = Some(value),
            Op::If { first, count: 1, .. } => {
                if let Some(ConditionPart::Test(Test::Relation {
                    relation,
                    operand: Operand::Const(value),
                })) = program.condition_parts.get(first as usize)
                    && let Some(truth) = decided(*relation, op, *value)
                {
                    let message = format!("this condition is always {truth}");
                    found.push(
                        Diagnostic::warning("NCT-W7", stmt.span, message)
                            .help("compare OP with a value that it can reach from both sides"),
                    );
                }
                op = None;
            }
            // These do not change OP.
            Op::Set(_) | Op::Clear(_) | Op::Store { .. } => {}
            _ => op = None,
        }
    }
}

/// Whether a comparison of OP with `value` holds, where that is known before the program runs: if OP's
/// value is known, or if no number of 16 bits without a sign fulfils the comparison. `None` where it
/// depends on OP, and for a comparison that every number fulfils.
fn decided(relation: Relation, op: Option<u16>, value: u16) -> Option<bool> {
    let holds = |op: u16| match relation {
        Relation::Lt => op < value,
        Relation::Gt => op > value,
        Relation::Eq => op == value,
        Relation::Le => op <= value,
        Relation::Ge => op >= value,
    };
    match (relation, op, value) {
        (_, Some(op), _) => Some(holds(op)),
        (Relation::Lt, None, 0) | (Relation::Gt, None, u16::MAX) => Some(false),
        _ => None,
    }
}

/// The first statement of each run of statements that no module reaches.
fn unreachable(program: &Program, reached: &[u8], found: &mut Vec<Diagnostic>) {
    let mut was_reached = true;
    for (stmt, modules) in program.stmts.iter().zip(reached) {
        // A module must have its J, a condition its Z, so these are not statements that one could
        // leave out.
        let is_needed = matches!(stmt.op, Op::End(_) | Op::EndIf | Op::Else { .. } | Op::Text);
        let is_text = matches!(stmt.op, Op::Label(197..));
        if is_needed || is_text {
            continue;
        }
        let is_reached = *modules != 0;
        if was_reached && !is_reached {
            let (message, help) = match stmt.op {
                Op::Label(label) => (
                    format!("nothing calls :{label:03} or jumps there"),
                    format!("write C{label:03} where it is to run, or take it out"),
                ),
                _ => (
                    "no module reaches this statement".to_owned(),
                    "put a label in front of it, or take it out".to_owned(),
                ),
            };
            found.push(Diagnostic::warning("NCT-W8", stmt.span, message).help(help));
        }
        was_reached = is_reached;
    }
}

/// Conditions that end elsewhere than their indentation says, since a `Z` is lost and another one is too many.
fn lost_z(program: &Program, found: &mut Vec<Diagnostic>) {
    for left in left_conditions(&program.text, &program.stmts) {
        let span = |at: usize| program.stmts.get(at).map(|stmt| stmt.span);
        let (Some(condition), Some(statement)) = (span(left.condition), span(left.statement))
        else {
            continue;
        };
        let line = program.lines.get(left.condition).copied().unwrap_or(0);
        let message = format!(
            "this depends on the condition of line {line}, though it stands no further in: a Z may be lost before it"
        );
        found.push(
            Diagnostic::warning("NCT-W14", statement, message)
                .label(condition, "this condition")
                .help("write Z where the inner part ends, or indent what depends on the condition"),
        );
    }
}

/// Whether execution never goes on with the statement after one.
const fn ends_routine(op: Op) -> bool {
    matches!(op, Op::Goto(_) | Op::Return | Op::End(_) | Op::Text)
}

/// Subroutines whose end is missing, so that the next subroutine or module runs too. A label that is
/// only jumped to belongs to the routine before it.
fn falls_through(program: &Program, reached: &[u8], found: &mut Vec<Diagnostic>) {
    let called: BTreeSet<u16> = program
        .stmts
        .iter()
        .filter_map(|stmt| match stmt.op {
            Op::Call(label) => Some(label),
            _ => None,
        })
        .collect();
    // The subroutine in which the statement before this one is.
    let mut routine: Option<(u16, Span)> = None;
    let mut before: Option<Op> = None;
    for (at, stmt) in program.stmts.iter().enumerate() {
        if let Op::Label(label) = stmt.op {
            let begins = label <= 2 || called.contains(&label);
            let runs_on = at.checked_sub(1).and_then(|at| reached.get(at)).is_some_and(|m| *m != 0)
                && before.is_some_and(|op| !ends_routine(op) && !matches!(op, Op::Label(_)));
            if let Some((from, variable)) = routine
                && begins
                && runs_on
            {
                let message = format!(
                    "the subroutine :{from:03} runs on into :{label:03}, since no R ends it"
                );
                found.push(
                    Diagnostic::warning("NCT-W9", stmt.span, message)
                        .label(variable, "this subroutine")
                        .help(format!("write R before :{label:03}"))
                        .replace_at(Span { end: stmt.span.start, ..stmt.span }, "R\n"),
                );
            }
            if begins {
                routine = (label > 2).then_some((label, stmt.span));
            }
        }
        before = Some(stmt.op);
    }
    // After the last statement no R can come any more. (After a module J0 to J2 must follow, and a
    // program that could run into texts has error 74.)
    if let Some((from, variable)) = routine
        && let Some(last) = program.stmts.last()
        && reached.get(program.stmts.len() - 1).is_some_and(|modules| *modules != 0)
        && !ends_routine(last.op)
    {
        let message = format!(
            "the program ends in the subroutine :{from:03}, since no R ends it; what called it does \
             not go on"
        );
        found.push(
            Diagnostic::warning("NCT-W9", last.span, message)
                .label(variable, "this subroutine")
                .help("write R after this")
                .replace_at(Span { start: last.span.end, ..last.span }, " R"),
        );
    }
}

/// A function's strobe that is read in a program that never writes FIN: the NC waits for ever.
fn strobe_without_fin(used: &Used, found: &mut Vec<Diagnostic>) {
    let strobe = used.read.iter().find(|(variable, _)| match variable {
        Variable::Bit(bit) => {
            matches!(bit.space, Space::I | Space::V) && STROBES.contains(&(bit.byte, bit.bit))
        }
        Variable::Word(_) => false,
    });
    if let Some((variable, span)) = strobe
        && !used.writes_output(FIN.0, FIN.1)
    {
        let message =
            format!("{variable} is the strobe of a function, and nothing writes FIN, Y547");
        found.push(
            Diagnostic::warning("NCT-W10", *span, message)
                .note("the NC waits for FIN before it goes on with the part program")
                .help("D547 when a function has come, U547 when it is done"),
        );
    }
}

/// Timers that are read and to which nothing is stored, so that they never run.
fn timer_never_started(used: &Used, found: &mut Vec<Diagnostic>) {
    let started: BTreeSet<Variable> = used.written.iter().map(|(variable, _)| *variable).collect();
    for (variable, span) in &used.read {
        if let Variable::Word(Word::T(_) | Word::H(_) | Word::M(_)) = variable
            && !started.contains(variable)
        {
            let message = format!("nothing starts the timer {variable}, so it stays 0");
            found.push(
                Diagnostic::warning("NCT-W11", *span, message)
                    .help(format!("store its time, as in ,50 S{variable}")),
            );
        }
    }
}

/// The text of a message's flag, `None` if the program has none or an empty one.
fn text_of(program: &Program, bit: Bit) -> Option<&str> {
    let text = if bit.byte == INDEXED_BYTE {
        program.texts.indexed.first()
    } else {
        let row = usize::from(bit.byte - MESSAGE_BYTES.start);
        program.texts.messages.get(row * 8 + usize::from(bit.bit))
    };
    text.map(|text| text.trim()).filter(|text| !text.is_empty())
}

/// Flags of messages that are set and have no text.
fn messages_without_text(program: &Program, used: &Used, found: &mut Vec<Diagnostic>) {
    for (bit, span) in &used.set {
        let is_message = bit.space == Space::Y
            && (bit.byte == INDEXED_BYTE || MESSAGE_BYTES.contains(&bit.byte));
        if is_message && text_of(program, *bit).is_none() {
            let module = if bit.byte == INDEXED_BYTE { 198 } else { 199 };
            let message = format!("{bit} shows a message, and :{module} has no text for it");
            found.push(
                Diagnostic::warning("NCT-W12", *span, message)
                    .help(format!("write the text in module :{module}, in the place of {bit}")),
            );
        }
    }
}

/// Texts whose flag or softkey the program never names.
fn texts_never_used(program: &Program, used: &Used, found: &mut Vec<Diagnostic>) {
    let texts = &program.texts;
    let messages = texts.messages.iter().zip(0u16..).filter_map(|(text, index)| {
        let (byte, bit) = (MESSAGE_BYTES.start + index / 8, (index % 8) as u8);
        let unused = !used.writes_output(byte, bit);
        unused.then(|| (199, text, format!("nothing sets Y{byte:02}{bit}, which shows this text")))
    });
    let softkeys_are_used = used.names_byte(Space::I, SOFTKEY_BYTE)
        || used.names_byte(Space::V, SOFTKEY_BYTE)
        || used.names_byte(Space::Y, SOFTKEY_BYTE);
    let captions = texts.softkeys.iter().filter(|_| !softkeys_are_used).map(|text| {
        (197, text, "the program looks at none of the softkeys I500 to I507".to_owned())
    });
    let any_indexed = (0..8).any(|bit| used.writes_output(INDEXED_BYTE, bit));
    let indexed = texts.indexed.iter().filter(|_| !any_indexed).map(|text| {
        (198, text, "nothing sets one of Y700 to Y707, which show these texts".to_owned())
    });
    let mut told = BTreeSet::new();
    for (module, text, message) in messages.chain(captions.take(1)).chain(indexed.take(1)) {
        if text.trim().is_empty() || !told.insert(message.clone()) {
            continue;
        }
        if let Some(span) = place_of_text(program, module, text) {
            found.push(
                Diagnostic::warning("NCT-W13", span, message)
                    .help("set the flag where the message is to come, or take the text out"),
            );
        }
    }
}

/// Where a text lies in its module; the module's label if the text can't be found.
fn place_of_text(program: &Program, module: u16, text: &str) -> Option<Span> {
    let at = program.target(module)?;
    let label = program.stmts.get(at)?.span;
    let body = program.stmts.get(at + 1)?.span;
    let start = program.text.get(body.range()).and_then(|body| body.find(text));
    Some(match start {
        Some(offset) => {
            let start = body.start as usize + offset;
            Span::new(body.file, start, start + text.len())
        }
        None => label,
    })
}
