//! The text of a program as the manuals have it shown: without comments, a continued statement on one line, included
//! files in their place, each line cut into tokens.

use plcc_diag::{FileId, SourceMap};
use serde::{Deserialize, Serialize};

use super::lines::{Line, lines};
use super::places::StatementPlaces;
use crate::common::Words;

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

/// How a language has the lines of a program shown.
pub struct Wording<'w> {
    /// The sign at the end of a line whose statement goes on in the next one.
    pub continued_by: Option<&'w str>,
    /// Whether each statement is one token.
    pub statements_are_tokens: bool,
    /// What is done with the lines before they are shown.
    pub lines: &'w dyn Fn(&mut Vec<Line>),
    /// What a token does to the nesting.
    pub block: &'w dyn Fn(&Piece) -> Option<Block>,
    /// Whether a row begins a part of the program.
    pub begins_part: &'w dyn Fn(&Row) -> bool,
}

/// The lines that are not blank as rows, made of the words of the program's sources.
pub fn rows(
    sources: &SourceMap,
    words: &Words,
    places: &StatementPlaces,
    wording: &Wording<'_>,
) -> Vec<Row> {
    let mut lines = lines(sources, words);
    (wording.lines)(&mut lines);
    if let Some(sign) = wording.continued_by {
        join_continued(&mut lines, sign);
    }
    let is_blank = |line: &Line| line.pieces.iter().all(|piece| piece.role == Role::Blank);
    let row = |line: Line| {
        let mut statements: Vec<u32> = places
            .statements_between(line.file, line.line, line.end_line)
            .iter()
            .flat_map(|place| places.statements_at(place))
            .collect();
        statements.sort_unstable();
        statements.dedup();
        let Line { file, line, number, mut pieces, columns, comment, .. } = line;
        if wording.statements_are_tokens {
            pieces = joined_by_statement(pieces, &columns, &statements, places);
        }
        for piece in &mut pieces {
            piece.block = (wording.block)(piece);
        }
        let name = name_of(&pieces);
        let mut row =
            Row { file, line, number, pieces, statements, name, comment, begins_part: false };
        row.begins_part = (wording.begins_part)(&row);
        row
    };
    lines.into_iter().filter(|line| !is_blank(line)).map(row).collect()
}

/// Joins lines whose statement goes on in the next one with it.
fn join_continued(lines: &mut Vec<Line>, sign: &str) {
    let mut joined: Vec<Line> = vec![];
    for mut line in lines.drain(..) {
        let goes_on = line.pieces.pop_if(|last| last.text == sign).is_some();
        while goes_on && line.pieces.pop_if(|last| last.role == Role::Blank).is_some() {}
        line.goes_on = goes_on;
        match joined.last_mut() {
            Some(last) if last.goes_on && last.file == line.file => {
                last.pieces.extend(line.pieces.into_iter().skip_while(|p| p.role == Role::Blank));
                (last.end_line, last.goes_on) = (line.end_line, goes_on);
                if !line.comment.is_empty() {
                    last.comment = format!("{} {}", last.comment, line.comment).trim().to_owned();
                }
            }
            _ => joined.push(line),
        }
    }
    *lines = joined;
}

/// Makes one token of all the tokens of a statement.
fn joined_by_statement(
    pieces: Vec<Piece>,
    columns: &[u32],
    statements: &[u32],
    places: &StatementPlaces,
) -> Vec<Piece> {
    let statement_at = |column: u32| {
        let is_within = |statement: &&u32| {
            places.place(**statement).is_some_and(|place| {
                place.column <= column && (column < place.end_column || place.end_line > place.line)
            })
        };
        statements.iter().find(is_within).copied()
    };
    let mut joined: Vec<Piece> = vec![];
    for (piece, &column) in pieces.into_iter().zip(columns) {
        let statement = statement_at(column);
        match joined.last_mut() {
            Some(last) if statement.is_some() && last.statement == statement => {
                last.text.push_str(&piece.text);
            }
            _ if statement.is_some() => {
                joined.push(Piece { statement, ..Piece::new(piece.text, Role::Variable) });
            }
            _ => joined.push(piece),
        }
    }
    joined
}

/// The name by which the directory lists a line: its target, its label or its keyword (PMI 5.1).
fn name_of(pieces: &[Piece]) -> String {
    let visible = || pieces.iter().filter(|piece| piece.role != Role::Blank);
    if let Some(label) = visible().next().filter(|piece| piece.role == Role::Label) {
        let colon = if label.text.starts_with(':') { "" } else { ":" };
        return format!("{}{colon}", label.text);
    }
    let target = visible().find(|piece| piece.target);
    let first = visible().next();
    let named = match first {
        Some(first) if first.role == Role::Keyword => Some(first),
        _ => target.or(first),
    };
    named.map_or_else(String::new, |piece| piece.text.clone())
}
