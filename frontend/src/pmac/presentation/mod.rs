//! What is shown of a PMAC program: the names of its variables, and their classes.

mod classes;
mod text;

use plcc_abi::pmac::PmacName;
use plcc_diag::SourceMap;

use super::{Program, access};
use crate::common::Accessed;
use crate::presentation::{Presentation, Row, StatementPlaces};

pub(super) use classes::{CLASSES, title};

impl Presentation for Program {
    fn name(&self, accessed: Accessed) -> Option<String> {
        access::name(accessed).map(|name| name.to_string())
    }

    /// Statements enable and disable PLCs, but no observer is told that as a write.
    fn accessed(&self, name: &str) -> Option<Accessed> {
        let name = PmacName::parse(name, &self.loaded.layout).ok()?;
        (!matches!(name, PmacName::Plc { .. })).then(|| access::accessed(name))
    }

    fn is_outside_image(&self, accessed: Accessed) -> bool {
        access::is_memory(accessed)
    }

    fn text(&self, sources: &SourceMap, places: &StatementPlaces) -> Vec<Row> {
        text::text(self, sources, places)
    }

    /// A Q-variable has its coordinate system in front of it.
    fn is_written_as(&self, accessed: &str, piece: &str) -> bool {
        let in_system = |rest: &str| rest.trim_start_matches(char::is_numeric) == piece;
        accessed == piece || accessed.strip_prefix('&').is_some_and(in_system)
    }

    fn waits_in(&self, rows: &[Row], row: usize) -> usize {
        text::open_while(rows, row).unwrap_or(row)
    }

    /// The PLC whose OPEN stands before the row.
    fn task_of(&self, rows: &[Row], row: usize) -> Option<String> {
        rows.get(..=row)?.iter().rev().find_map(|row| text::opened_plc(&row.text()))
    }
}
