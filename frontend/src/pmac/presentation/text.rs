//! The statements of a download.

use std::collections::HashMap;

use plcc_abi::pmac::PmacName;
use plcc_diag::SourceMap;

use crate::CheckedProgram;
use crate::pmac::{COMMENT_MARKS, Program};
use crate::presentation::lines::{self, SourceLine, without_line_comments};
use crate::presentation::tokens::{Raw, mark_target, raw};
use crate::presentation::{Block, Piece, Role, Row, StatementPlaces, rows};

/// The lines of a program.
pub(super) fn text(program: &Program, sources: &SourceMap, places: &StatementPlaces) -> Vec<Row> {
    let mut cutter = Cutter { program, words: HashMap::new() };
    let opens_plc = |row: &Row| row.text().trim_start().to_uppercase().starts_with("OPEN");
    rows(lines(sources), places, |line, _| cutter.pieces(&line.text), block, opens_plc)
}

fn lines(sources: &SourceMap) -> Vec<SourceLine> {
    let without_comments = |text: &str| without_line_comments(text, &COMMENT_MARKS);
    lines::lines(sources, &without_comments, Some("#include"))
}

/// Cuts the lines of one program.
struct Cutter<'a> {
    program: &'a Program,
    /// What each word was found to be.
    words: HashMap<String, (Role, Option<String>)>,
}

impl Cutter<'_> {
    /// The tokens of a line.
    fn pieces(&mut self, line: &str) -> Vec<Piece> {
        let mut pieces = vec![];
        for token in raw(line) {
            match token {
                Raw::Blank(text) => pieces.push(Piece::new(text, Role::Blank)),
                Raw::Text(text) => pieces.push(Piece::new(text, Role::Text)),
                Raw::Sign(text) => pieces.push(Piece::new(text, Role::Operator)),
                Raw::Number(text) => {
                    let end = text.find(|c: char| !(c.is_ascii_digit() || c == '.' || c == '$'));
                    let (number, word) = match end {
                        // A name may begin with a digit, and glued statements with what looks so.
                        Some(end) if !text.starts_with('$') && self.word(text).1.is_none() => {
                            text.split_at_checked(end).unwrap_or((text, ""))
                        }
                        Some(_) if !text.starts_with('$') => ("", text),
                        _ => (text, ""),
                    };
                    if !number.is_empty() {
                        pieces.push(Piece::new(number, Role::Constant));
                    }
                    if !word.is_empty() {
                        pieces.push(self.word_piece(word));
                    }
                }
                Raw::Word(text) => pieces.push(self.word_piece(text)),
            }
        }
        mark_target(&mut pieces);
        pieces
    }

    fn word_piece(&mut self, text: &str) -> Piece {
        let (role, name) = self.word(text);
        Piece { name, ..Piece::new(text, role) }
    }

    /// What a word is: a variable by its own name or by a name that the program defined.
    fn word(&mut self, text: &str) -> (Role, Option<String>) {
        if let Some(known) = self.words.get(text) {
            return known.clone();
        }
        let found = self.look_up(text);
        self.words.insert(text.into(), found.clone());
        found
    }

    fn look_up(&self, text: &str) -> (Role, Option<String>) {
        if let Ok(name) = PmacName::parse(text, &self.program.loaded.layout) {
            return (Role::Variable, Some(name.to_string()));
        }
        match self.program.expression(text) {
            Ok(expression) => match expression.variables() {
                [] => (Role::Constant, None),
                [name] => (Role::Variable, Some(name.clone())),
                _ => (Role::Variable, None),
            },
            Err(_) => (Role::Keyword, None),
        }
    }
}

/// Whether a token begins or ends a condition or loop.
fn block(piece: &Piece) -> Option<Block> {
    match piece.text.trim().to_uppercase().as_str() {
        "IF" | "WHILE" => Some(Block::Opens),
        "ENDIF" | "ENDI" | "ENDWHILE" | "ENDW" => Some(Block::Closes),
        _ => None,
    }
}

/// The row of the WHILE in whose loop a row lies; `None` if it lies in none.
pub(super) fn open_while(rows: &[Row], row: usize) -> Option<usize> {
    let mut depth = 0;
    for at in (0..=row).rev() {
        let text = rows.get(at)?.text().to_uppercase();
        let closes = text.matches("ENDWHILE").count() + text.matches("ENDW ").count();
        let opens = text.matches("WHILE").count().saturating_sub(text.matches("ENDWHILE").count());
        if text.contains("OPEN PLC") {
            return None;
        }
        if at != row {
            depth += closes;
        }
        if opens > depth {
            return Some(at);
        }
        depth -= opens;
    }
    None
}

/// The PLC that a line opens, `PLC3` or `PLCC3`; `None` if it opens none.
pub(in crate::pmac) fn opened_plc(line: &str) -> Option<String> {
    let text = line.to_uppercase().replace(char::is_whitespace, "");
    let rest = text.strip_prefix("OPENPLC")?;
    let (letters, rest) = match rest.strip_prefix('C') {
        Some(rest) if !rest.starts_with('L') => ("PLCC", rest),
        _ => ("PLC", rest),
    };
    let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
    Some(format!("{letters}{digits}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presentation::lines::{shown, sources};

    #[test]
    fn files_are_included_in_their_place() {
        let main = "#include <IO.H>\nP1=2 ; no\nSEND\"a;b\"//c";
        let found = shown(lines(&sources(&[("m.pmc", main), ("io.h", "M1->X:0,0")])));
        let pair = |number: &str, text: &str| (number.to_owned(), text.to_owned());
        assert_eq!(found, [pair("1.1", "M1->X:0,0"), pair("2", "P1=2"), pair("3", "SEND\"a;b\"")]);
    }
}
