//! The text of a program as the manuals have it shown: without comments, a continued statement on one line, included
//! files in their place, each line cut into tokens.

use plcc_diag::FileId;
use serde::{Deserialize, Serialize};

use super::lines::SourceLine;
use super::places::StatementPlaces;
use super::tokens::name_of;

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// White space.
    Blank,
    /// A word of the language.
    Keyword,
    /// A label.
    Label,
    /// A variable, or a name that stands for one.
    Variable,
    /// A number, or a name that stands for one.
    Constant,
    /// A sign.
    Operator,
    /// A text in quotes.
    Text,
}

/// What a token does to the nesting of conditions and loops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Block {
    /// It begins one.
    Opens,
    /// It ends one.
    Closes,
}

/// A token of a line, before any value is known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    /// Its text.
    pub text: String,
    /// What it is.
    pub role: Role,
    /// The variable as traces spell it, where the piece is one. Of an element of an array this is the
    /// array.
    pub name: Option<String>,
    /// Whether a NOT belongs to the piece, which is true when the variable is false.
    pub negated: bool,
    /// Whether the piece is what an assignment writes.
    pub target: bool,
    /// The statement that the piece is the whole of, in languages in which each statement is a token.
    pub statement: Option<u32>,
    /// Whether it begins or ends a condition or loop.
    pub block: Option<Block>,
}

impl Piece {
    /// A piece of which nothing but its text is known, and what it is.
    pub fn new(text: impl Into<String>, role: Role) -> Self {
        Self {
            text: text.into(),
            role,
            name: None,
            negated: false,
            target: false,
            statement: None,
            block: None,
        }
    }
}

/// A line of the program.
#[derive(Clone, Debug)]
pub struct Row {
    /// The file that it stands in.
    pub file: FileId,
    /// The line of the file in which it begins.
    pub line: u32,
    /// The number as it is shown: `12`, or `7.3` for line 3 of the file that line 7 includes.
    pub number: String,
    /// Its tokens, which together are its text.
    pub pieces: Vec<Piece>,
    /// The statements that begin in it, by rising number.
    pub statements: Vec<u32>,
    /// The name of its target, its label or its keyword (PMI 5.1).
    pub name: String,
    /// The comment that stands beside it in the source; empty without one.
    pub comment: String,
    /// Whether a part of the program begins in it, to which users go from the part before: a label, a module, a PLC.
    pub begins_part: bool,
}

impl Row {
    /// The text alone.
    pub fn text(&self) -> String {
        self.pieces.iter().map(|piece| piece.text.as_str()).collect()
    }

    /// Whether the first token is a label.
    pub fn begins_with_label(&self) -> bool {
        let first = self.pieces.iter().find(|piece| piece.role != Role::Blank);
        first.is_some_and(|piece| piece.role == Role::Label)
    }
}

/// The lines that are not blank as rows: `cut` makes the tokens of one, of which it gets the statements that begin in it,
/// `block` says what a token does to the nesting, and `begins_part` whether a row begins a part of the program.
pub fn rows(
    lines: Vec<SourceLine>,
    places: &StatementPlaces,
    mut cut: impl FnMut(&SourceLine, &[u32]) -> Vec<Piece>,
    block: impl Fn(&Piece) -> Option<Block>,
    begins_part: impl Fn(&Row) -> bool,
) -> Vec<Row> {
    let lines = lines.into_iter().filter(|line| !line.text.trim().is_empty());
    let row = |line: SourceLine| {
        let mut statements: Vec<u32> = places
            .statements_between(line.file, line.line, line.end_line)
            .iter()
            .flat_map(|place| places.statements_at(place))
            .collect();
        statements.sort_unstable();
        statements.dedup();
        let mut pieces = cut(&line, &statements);
        for piece in &mut pieces {
            piece.block = block(piece);
        }
        let (name, SourceLine { file, line, number, comment, .. }) = (name_of(&pieces), line);
        let mut row =
            Row { file, line, number, pieces, statements, name, comment, begins_part: false };
        row.begins_part = begins_part(&row);
        row
    };
    lines.map(row).collect()
}
