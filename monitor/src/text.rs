//! The text of a program, with the row of each statement.

use std::collections::BTreeMap;

use plcc_diag::FileId;
use plcc_frontend::presentation::Row;
use plcc_replay::DebuggedProgram;

/// The lines of a program.
#[derive(Clone, Debug, Default)]
pub(crate) struct ProgramText {
    pub(crate) rows: Vec<Row>,
    /// The row of each statement, by its number.
    by_statement: BTreeMap<u32, usize>,
}

impl ProgramText {
    /// The text of a program.
    pub(crate) fn new(program: &DebuggedProgram) -> Self {
        let rows = program.checked().text(program.sources(), program.places());
        let pairs = rows.iter().enumerate().flat_map(|(row, content)| {
            content.statements.iter().map(move |&statement| (statement, row))
        });
        let by_statement = pairs.collect();
        Self { rows, by_statement }
    }

    /// The row in which a statement begins.
    pub(crate) fn row_of(&self, statement: u32) -> Option<usize> {
        self.by_statement.get(&statement).copied()
    }

    /// The row that holds a line of a file.
    pub(crate) fn row_at(&self, file: FileId, line: u32) -> Option<usize> {
        self.rows.iter().rposition(|row| row.file == file && row.line <= line)
    }
}
