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
    for statement in download.statements() {
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

/// The variables of a kind whose number is computed.
fn computed(kind: Kind) -> String {
    format!("{kind:?}(…)")
}
