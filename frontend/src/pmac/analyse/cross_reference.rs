//! The cross-reference: where each variable is read, written and tested.

use std::collections::HashMap;

use plcc_abi::Tables;
use plcc_abi::pmac::Kind;
use plcc_abi::pmac::motion::{Axis, Destination, MotionKind, MoveWord, SyncOp};
use plcc_diag::SourceMap;

use crate::common::{CrossReference, CrossReferenceBuilder, Use};
use crate::language::Language;
use crate::pmac::Pmac;
use crate::pmac::ast::{Action, Buffer, Download, Expr, Op, StmtKind, Target, WriteKind};
use crate::pmac::origin::TextRange;

/// Makes the cross-reference of a download: of PLCs, PLCCs, on-line commands and what COMMANDs do.
///
/// A Q-variable has no coordinate system here, since ADDRESS may change which one is meant.
/// `P(…)` stands for the P-variables whose number is computed, `X:$0700` for a word of memory. The
/// meanings of variables are those of listing comments. Of motion programs there are the programs themselves (`PROG 20`,
/// written where they are opened, read where they are called), their labels (`PROG 20 N100`), and the words of axes (`axis X`).
pub(crate) fn cross_reference(
    download: &Download,
    sources: &SourceMap,
    tables: &Tables,
) -> CrossReference {
    let mut finder = Finder { download, sources, found: CrossReferenceBuilder::default() };
    for online in &download.online {
        finder.action(&online.action, online.at);
    }
    for statement in download.statements() {
        finder.statement(&statement.kind, statement.at);
    }
    for (&number, buffer) in &download.progs {
        finder.motion_program(number, buffer);
    }
    let comments = Pmac.listing_comments(tables);
    let meanings: HashMap<&str, &str> = comments.iter().filter_map(|text| named(text)).collect();
    finder.found.finish(|name| meanings.get(name).map(|meaning| (*meaning).to_owned()))
}

/// The variable that a listing comment is about, and its meaning: `I5: …` or `M1->…: …`.
fn named(comment: &str) -> Option<(&str, &str)> {
    let end = comment.find(|c: char| !c.is_ascii_alphanumeric())?;
    let (name, rest) = comment.split_at_checked(end)?;
    Some((name, rest.strip_prefix(": ").unwrap_or(rest)))
}

struct Finder<'a> {
    download: &'a Download,
    sources: &'a SourceMap,
    found: CrossReferenceBuilder,
}

impl Finder<'_> {
    fn add(&mut self, name: &str, at: TextRange, used: Use) {
        let (span, _) = self.download.origins.place(at);
        let line = self.sources.line(span.file, span.start);
        self.found.add(name, self.sources, span.file, line, used);
    }

    /// Adds the variables of an expression.
    fn operands(&mut self, expr: Expr, at: TextRange, used: Use) {
        let download = self.download;
        for op in download.ops(expr) {
            match *op {
                Op::Var(kind, number) => self.add(&variable(kind, number), at, used),
                Op::Indirect(kind) => self.add(&computed(kind), at, used),
                _ => {}
            }
        }
    }

    fn assignment(&mut self, target: Target, value: Expr, at: TextRange) {
        self.operands(value, at, Use::Read);
        if let Target::Indirect(kind, number) = target {
            self.operands(number, at, Use::Read);
            self.add(&computed(kind), at, Use::Written);
        }
        for (kind, number) in target.named() {
            self.add(&variable(kind, number), at, Use::Written);
        }
    }

    fn statement(&mut self, what: &StmtKind, at: TextRange) {
        if let StmtKind::Assign(target, value) = *what {
            return self.assignment(target, value, at);
        }
        let is_branch = matches!(what, StmtKind::If(..) | StmtKind::While(..));
        let used = if is_branch { Use::Tested } else { Use::Read };
        for expr in what.expressions() {
            self.operands(expr, at, used);
        }
        if let StmtKind::Word(space, address, _) = what {
            self.add(&format!("{space:?}:${address:04X}"), at, Use::Written);
        }
    }

    /// The labels, calls and axis words of a motion program.
    fn motion_program(&mut self, number: u32, buffer: &Buffer) {
        if let Some(at) = buffer.opened {
            self.add(&program(number), at, Use::Written);
        }
        for &(label, _, at) in &buffer.labels {
            self.add(&label_of(number, Some(f64::from(label))), at, Use::Written);
        }
        let download = self.download;
        for stmt in &buffer.code {
            let StmtKind::Motion(index, _) = stmt.kind else { continue };
            let Some(motion) = download.motion.get(index as usize) else { continue };
            let value = motion.values.first().and_then(|value| download.constant(*value));
            match &motion.kind {
                MotionKind::Move(words) => {
                    for word in words {
                        if let MoveWord::Axis(axis) = word {
                            self.add(&axis_name(*axis), stmt.at, Use::Written);
                        }
                    }
                }
                MotionKind::Set(axes) => {
                    for axis in axes {
                        self.add(&axis_name(*axis), stmt.at, Use::Written);
                    }
                }
                MotionKind::Sync(op, number) => {
                    let name = variable(Kind::M, u16::try_from(*number).unwrap_or(u16::MAX));
                    if *op != SyncOp::Set {
                        self.add(&name, stmt.at, Use::Read);
                    }
                    self.add(&name, stmt.at, Use::Written);
                }
                MotionKind::Goto | MotionKind::Gosub => {
                    let label = value.map(f64::round);
                    if label != Some(0.0) {
                        self.add(&label_of(number, label), stmt.at, Use::Read);
                    }
                }
                MotionKind::Call | MotionKind::Prelude(None) => {
                    self.call(value.map(Destination::of_number), stmt.at);
                }
                MotionKind::Code(code) | MotionKind::Prelude(Some(code)) => {
                    self.call(value.map(|value| Destination::of_code(*code, value)), stmt.at);
                }
                _ => {}
            }
        }
    }

    /// A call of a program, at a label or at its top (0); `None` where it is computed.
    fn call(&mut self, called: Option<Destination>, at: TextRange) {
        match called {
            Some(Destination { program: number, label }) if (0.0..=4e9).contains(&number) => {
                self.add(&program(number as u32), at, Use::Read);
                if label != 0.0 {
                    self.add(&label_of(number as u32, Some(label)), at, Use::Read);
                }
            }
            Some(_) => {}
            None => self.add("PROG (…)", at, Use::Read),
        }
    }

    fn action(&mut self, action: &Action, at: TextRange) {
        match action {
            Action::Assign(target, value) => self.assignment(*target, *value, at),
            Action::Defaults(first, count, step) => {
                let (first, count, step) = (*first, *count, *step);
                let target = Target::Range { kind: Kind::I, first, count, step };
                self.assignment(target, Expr::default(), at);
            }
            Action::Write(kind, address, values) => {
                let letter = match kind {
                    WriteKind::X => "X",
                    WriteKind::Y => "Y",
                    WriteKind::Long => "L",
                    WriteKind::Double => "D",
                    WriteKind::Program => return,
                };
                for (offset, value) in (0..).zip(values) {
                    self.operands(*value, at, Use::Read);
                    let address = address.saturating_add(offset);
                    self.add(&format!("{letter}:${address:04X}"), at, Use::Written);
                }
            }
            Action::Define(..)
            | Action::Plc(..)
            | Action::System(_)
            | Action::Save
            | Action::DeletePlcc(_)
            | Action::Motion(_) => {}
        }
    }
}

pub(super) fn variable(kind: Kind, number: u16) -> String {
    format!("{kind:?}{number}")
}

/// A motion program.
fn program(number: u32) -> String {
    format!("PROG {number}")
}

/// A label of a motion program; `None` where its number is computed.
fn label_of(number: u32, label: Option<f64>) -> String {
    match label {
        Some(label) => format!("PROG {number} N{label}"),
        None => format!("PROG {number} N(…)"),
    }
}

/// The words of an axis.
fn axis_name(axis: Axis) -> String {
    format!("axis {}", char::from(axis.letter()))
}

/// The variables of a kind whose number is computed.
fn computed(kind: Kind) -> String {
    format!("{kind:?}(…)")
}
