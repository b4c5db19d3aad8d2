//! The kinematic programs of Turbo PMAC (OPEN FORWARD and OPEN INVERSE): they consist of the statements of PLCs that calculate.

use super::cursor::{ParseError, syntax_help};
use super::download::{DownloadReader, Open};
use crate::pmac::ast::StmtKind;
use crate::pmac::origin::TextRange;

/// What users call a kinematic program, by its coordinate system and whether it is the inverse one.
pub(crate) fn kinematics_name((system, inverse): (u8, bool)) -> String {
    let which = if inverse { "inverse" } else { "forward" };
    format!("the {which} kinematic program of coordinate system {system}")
}

impl DownloadReader<'_> {
    /// Opens a kinematic program. What is in it already stays in front.
    pub(crate) fn open_kinematics(&mut self, system: u8, inverse: bool, at: TextRange) {
        self.reader.l_used = None;
        self.open = Some(Open {
            kinematics: Some((system, inverse)),
            // No PLC has this number, so that the rules of PLC 0 do not hold.
            number: u8::MAX,
            first_diagnostic: self.diagnostics.len(),
            ..Open::default()
        });
        if let Some(buffer) = self.buffer() {
            buffer.opened = Some(at);
        }
    }

    /// In a kinematic program, removes statements from `first` on that do something else than to calculate, with an error.
    pub(crate) fn only_calculates(&mut self, first: u32, start: usize) {
        if self.open.as_ref().is_none_or(|open| open.kinematics.is_none()) {
            return;
        }
        let Some(buffer) = self.buffer() else { return };
        let calculates = |kind: &StmtKind| {
            matches!(
                kind,
                StmtKind::Assign(..)
                    | StmtKind::If(..)
                    | StmtKind::Jump(_)
                    | StmtKind::While(..)
                    | StmtKind::EndWhile(_)
            )
        };
        let first = first as usize;
        let new = buffer.code.get(first..).unwrap_or_default();
        if new.iter().all(|stmt| calculates(&stmt.kind)) {
            return;
        }
        buffer.code.truncate(first);
        let at = self.reader.cur.since(start);
        let message = "a kinematic program only calculates";
        let help = "it consists of assignments, IF and WHILE; a PLC does the rest";
        let error: Result<(), ParseError> = syntax_help(at, message, help);
        if let Err(error) = error {
            self.report(error);
        }
    }
}
