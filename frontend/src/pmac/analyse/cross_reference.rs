//! The cross-reference: where each variable is read, written and tested.

use std::collections::HashMap;

use plcc_abi::Tables;
use plcc_abi::pmac::Kind;
use plcc_diag::SourceMap;

use crate::common::{CrossReference, CrossReferenceBuilder, Use};
use crate::language::Language;
use crate::pmac::Pmac;
use crate::pmac::ast::{Action, Download, Expr, Op, StmtKind, Target, WriteKind};
use crate::pmac::origin::TextRange;

/// Makes the cross-reference of a download: of PLCs, PLCCs, on-line commands and what COMMANDs do.
///
/// A Q-variable has no coordinate system here, since ADDRESS may change which one is meant.
/// `P(…)` stands for the P-variables whose number is computed, `X:$0700` for a word of memory. The
/// meanings of variables are those of listing comments.
pub(crate) fn cross_reference(
    download: &Download,
    sources: &SourceMap,
    tables: &Tables,
) -> CrossReference {
    let mut finder = Finder { download, sources, found: CrossReferenceBuilder::default() };
    for online in &download.online {
        finder.action(&online.action, online.at);
    }
    let buffers = download.plcs.iter().chain(&download.plccs).map(|buffer| &buffer.code);
    for statement in buffers.chain(&download.commands).flatten() {
        finder.statement(&statement.kind, statement.at);
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

    fn target(&mut self, target: &Target, at: TextRange) {
        match *target {
            Target::Var(kind, number) => self.add(&variable(kind, number), at, Use::Written),
            Target::Indirect(kind, number) => {
                self.operands(number, at, Use::Read);
                self.add(&computed(kind), at, Use::Written);
            }
            Target::Range { kind, first, count, step } => {
                for index in 0..count {
                    let number = first.saturating_add(index.saturating_mul(step));
                    self.add(&variable(kind, number), at, Use::Written);
                }
            }
        }
    }

    fn statement(&mut self, what: &StmtKind, at: TextRange) {
        match *what {
            StmtKind::Assign(ref target, value) => {
                self.operands(value, at, Use::Read);
                self.target(target, at);
            }
            StmtKind::If(condition, _) | StmtKind::While(condition, _) => {
                self.operands(condition, at, Use::Tested);
            }
            StmtKind::AddressBy(motor, system) => {
                self.operands(motor, at, Use::Read);
                self.operands(system, at, Use::Read);
            }
            StmtKind::Text(_, Some(value)) => self.operands(value, at, Use::Read),
            StmtKind::Word(space, address, value) => {
                self.operands(value, at, Use::Read);
                self.add(&format!("{space:?}:${address:04X}"), at, Use::Written);
            }
            StmtKind::Text(_, None)
            | StmtKind::Jump(_)
            | StmtKind::EndWhile(_)
            | StmtKind::Plc(..)
            | StmtKind::Address(..)
            | StmtKind::Define(_)
            | StmtKind::Save => {}
        }
    }

    fn action(&mut self, action: &Action, at: TextRange) {
        match action {
            Action::Assign(target, value) => {
                self.operands(*value, at, Use::Read);
                self.target(target, at);
            }
            Action::Defaults(first, count, step) => {
                let (first, count, step) = (*first, *count, *step);
                self.target(&Target::Range { kind: Kind::I, first, count, step }, at);
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
            | Action::Reset
            | Action::DeletePlcc(_)
            | Action::Motion => {}
        }
    }
}

fn letter(kind: Kind) -> char {
    match kind {
        Kind::I => 'I',
        Kind::P => 'P',
        Kind::Q => 'Q',
        Kind::M => 'M',
        Kind::L => 'L',
    }
}

pub(super) fn variable(kind: Kind, number: u16) -> String {
    format!("{}{number}", letter(kind))
}

/// The variables of a kind whose number is computed.
fn computed(kind: Kind) -> String {
    format!("{}(…)", letter(kind))
}
