//! Where the statements of a program stand in its sources.

use std::collections::BTreeMap;

use plcc_diag::{FileId, SourceMap};

use crate::CheckedProgram;

/// Where a statement stands: lines and columns from 1, columns in characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StatementPlace {
    /// The file.
    pub file: FileId,
    /// The line in which it begins.
    pub line: u32,
    /// The column at which it begins.
    pub column: u32,
    /// The line in which it ends.
    pub end_line: u32,
    /// The column after its last character.
    pub end_column: u32,
}

/// The places of a program's statements.
#[derive(Clone, Debug, Default)]
pub struct StatementPlaces {
    /// By the statement's number.
    statements: Vec<Option<StatementPlace>>,
    /// The numbers of the statements that begin in a line, in the order of their columns.
    lines: BTreeMap<(FileId, u32), Vec<u32>>,
}

impl StatementPlaces {
    /// The places of a program's statements in the sources that it was read from.
    pub fn new(program: &dyn CheckedProgram, sources: &SourceMap) -> Self {
        let place = |span: plcc_diag::Span| {
            let (line, column) = sources.line_col(span.file, span.start);
            let (end_line, end_column) = sources.line_col(span.file, span.end.max(span.start));
            StatementPlace { file: span.file, line, column, end_line, end_column }
        };
        let statements: Vec<_> =
            program.statements().into_iter().map(|span| span.map(place)).collect();
        let mut lines: BTreeMap<_, Vec<u32>> = BTreeMap::new();
        for (number, place) in (0..).zip(&statements) {
            if let Some(place) = place {
                lines.entry((place.file, place.line)).or_default().push(number);
            }
        }
        for numbers in lines.values_mut() {
            let column = |&number: &u32| {
                statements.get(number as usize).copied().flatten().map(|place| place.column)
            };
            numbers.sort_by_key(column);
        }
        Self { statements, lines }
    }

    /// The place of a statement; `None` for a statement that the compiler has added.
    pub fn place(&self, statement: u32) -> Option<StatementPlace> {
        self.statements.get(statement as usize).copied().flatten()
    }

    /// By a statement's number: whether it has a place in the source.
    pub fn placed(&self) -> Vec<bool> {
        self.statements.iter().map(Option::is_some).collect()
    }

    /// The first line from `line` (from 1) on in which statements begin, and the numbers of these statements.
    /// `None` if there is no such line.
    pub fn statements_from(&self, file: FileId, line: u32) -> Option<(u32, &[u32])> {
        let mut rest = self.lines.range((file, line)..(FileId(file.0.saturating_add(1)), 0));
        rest.next().map(|(&(_, line), numbers)| (line, numbers.as_slice()))
    }

    /// All statements that begin between two lines, the last one included.
    pub fn statements_between(&self, file: FileId, first: u32, last: u32) -> Vec<StatementPlace> {
        let lines = self.lines.range((file, first)..=(file, last.max(first)));
        lines.flat_map(|(_, numbers)| numbers).filter_map(|&number| self.place(number)).collect()
    }

    /// The numbers of the statements at a place.
    pub fn statements_at(&self, place: &StatementPlace) -> Vec<u32> {
        let numbers = self.lines.get(&(place.file, place.line)).map_or(&[][..], Vec::as_slice);
        let is_there = |number: &&u32| self.place(**number).as_ref() == Some(place);
        numbers.iter().filter(is_there).copied().collect()
    }
}
