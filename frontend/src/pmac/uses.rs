//! What the statements of a download do with the variables and programs that they name, by their places.

use std::cell::Cell;

use plcc_abi::pmac::{CommandStep, Text};
use plcc_diag::{FileId, Span};

use super::ast::{Action, Download, StmtKind};
use super::plc_lists::Switched;

/// What a statement does with the variables that it names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Does {
    /// The first one gets a value.
    Assigns,
    /// The first one is defined.
    Defines,
    /// A condition looks at them.
    Tests,
    /// Programs are started or stopped.
    Switches(Switched),
    /// A COMMAND starts or stops programs.
    Commands(Switched),
    /// They are read.
    Reads,
}

/// The statements and on-line commands, by their places in the sources.
pub(super) struct Statements {
    list: Vec<(Span, Does)>,
    /// How many begin up to the place that was asked for last.
    last: Cell<usize>,
}

/// How many statements after the last one are looked at before all are searched.
const NEAR: usize = 8;

impl Statements {
    pub(super) fn of(download: &Download) -> Self {
        let place = |at| download.origins.place(at).0;
        let online = download.online.iter().map(|online| {
            let does = match &online.action {
                Action::Assign(..) | Action::Defaults(..) => Does::Assigns,
                Action::Define(..) => Does::Defines,
                Action::Plc(_, set) => Does::Switches(Switched::default().and(*set)),
                Action::System(_)
                | Action::Write(..)
                | Action::Save
                | Action::DeletePlcc(_)
                | Action::Motion(_) => Does::Reads,
            };
            (place(online.at), does)
        });
        let statements = download.statements_of_buffers().map(|stmt| {
            let does = match stmt.kind {
                StmtKind::Assign(..) => Does::Assigns,
                StmtKind::Define(_) => Does::Defines,
                StmtKind::If(..) | StmtKind::While(..) => Does::Tests,
                StmtKind::Plc(_, set) => Does::Switches(Switched::default().and(set)),
                StmtKind::Text(text, _) => Does::Commands(commanded(download, text)),
                StmtKind::Jump(_)
                | StmtKind::EndWhile(_)
                | StmtKind::Address(..)
                | StmtKind::AddressBy(..)
                | StmtKind::Word(..)
                | StmtKind::Save
                | StmtKind::Motion(..)
                | StmtKind::Loop(..) => Does::Reads,
            };
            (place(stmt.at), does)
        });
        let mut found: Vec<(Span, Does)> = online.chain(statements).collect();
        found.sort_by_key(|(span, _)| (span.file, span.start, std::cmp::Reverse(span.end)));
        Self { list: found, last: Cell::new(0) }
    }

    /// The places of all, in their order.
    pub(super) fn places(&self) -> impl Iterator<Item = Span> {
        self.list.iter().map(|(span, _)| *span)
    }

    /// The statement at a place: where it begins, and what it does.
    pub(super) fn at(&self, file: FileId, offset: u32) -> Option<(Span, Does)> {
        let next = self.up_to(file, offset);
        // The shortest of those that begin at the same place comes last.
        let mut earlier = self.list.get(..next)?.iter().rev().take(4);
        earlier.find(|(span, _)| span.file == file && span.end > offset).copied()
    }
}

impl Statements {
    /// How many begin up to a place. Most often that is a little after the one that was asked for last.
    fn up_to(&self, file: FileId, offset: u32) -> usize {
        let begins = |(span, _): &(Span, Does)| (span.file, span.start) <= (file, offset);
        let last = self.last.get();
        let is_after = last.checked_sub(1).is_none_or(|it| self.list.get(it).is_some_and(begins));
        let near = self.list.get(last..).unwrap_or_default().iter().take(NEAR);
        let more = near.take_while(|it| begins(it)).count();
        let next = match is_after && more < NEAR {
            true => last + more,
            false => self.list.partition_point(begins),
        };
        self.last.set(next);
        next
    }
}

/// The programs that a text switches, if it is that of a COMMAND.
fn commanded(download: &Download, text: u32) -> Switched {
    let Some(Text::Command { steps, .. }) = download.texts.get(text as usize) else {
        return Switched::default();
    };
    let tasks = steps.iter().filter_map(|step| match *step {
        CommandStep::Task(task) => download.commands.get(task as usize),
        CommandStep::Motion(_) => None,
    });
    tasks.flatten().fold(Switched::default(), |switched, stmt| match stmt.kind {
        StmtKind::Plc(_, set) => switched.and(set),
        _ => switched,
    })
}
