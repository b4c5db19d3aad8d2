//! The text of a program as the manuals have it shown: without comments, a PMI statement that is
//! continued on one line, included files in their place, each line cut into tokens.

mod lines;
mod tokens;

use std::collections::BTreeMap;

use plcc_abi::Dialect;
use plcc_debugger::DebuggedProgram;
use plcc_diag::FileId;

use crate::view::Role;
use lines::SourceLine;

/// A piece of a line, before any value is known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Piece {
    pub(crate) text: String,
    pub(crate) role: Role,
    /// The variable as traces spell it, where the piece is one. Of an element of an array this is the
    /// array.
    pub(crate) name: Option<String>,
    /// Whether a NOT belongs to the piece, which is true when the variable is false.
    pub(crate) negated: bool,
    /// Whether the piece is what an assignment writes.
    pub(crate) target: bool,
    /// The statement that the piece is the whole of (NCT).
    pub(crate) statement: Option<u32>,
}

/// A line of the program.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub(crate) file: FileId,
    /// The line of the file in which it begins.
    pub(crate) line: u32,
    /// The number as it is shown.
    pub(crate) number: String,
    pub(crate) pieces: Vec<Piece>,
    /// The statements that begin in it, by rising number.
    pub(crate) statements: Vec<u32>,
    /// The name of the target, the label or the keyword (PMI 5.1).
    pub(crate) name: String,
}

impl Row {
    /// The text alone.
    pub(crate) fn text(&self) -> String {
        self.pieces.iter().map(|piece| piece.text.as_str()).collect()
    }
}

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
        let dialect = program.tables().dialect();
        let mut cutter = tokens::Cutter::new(program);
        let mut rows = vec![];
        for line in lines::lines(program.sources(), dialect) {
            let SourceLine { file, line, end_line, number, text } = line;
            let mut statements: Vec<u32> = program
                .statements_between(file, line, end_line)
                .iter()
                .flat_map(|place| program.statements_at(place))
                .collect();
            statements.sort_unstable();
            statements.dedup();
            let pieces = match dialect {
                Dialect::Nct => cutter.nct(&text, file, line, &statements),
                Dialect::Pmi => cutter.pmi(&text),
                Dialect::Pmac => cutter.pmac(&text),
            };
            let name = tokens::name_of(&pieces);
            rows.push(Row { file, line, number, pieces, statements, name });
        }
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
