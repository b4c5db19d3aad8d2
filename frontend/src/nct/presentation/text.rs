//! The statements of a program, each of which is a token of its line.

use plcc_diag::{FileId, SourceMap};

use crate::presentation::lines;
use crate::presentation::tokens::{Raw, raw};
use crate::presentation::{Block, Piece, Role, Row, StatementPlaces, rows};

/// The lines of a program.
pub(super) fn text(sources: &SourceMap, places: &StatementPlaces) -> Vec<Row> {
    let lines = lines::lines(sources, &without_comments, None);
    let cut = |line: &lines::SourceLine, statements: &[u32]| {
        pieces(&line.text, line.file, line.line, statements, places)
    };
    // A label of three digits begins a module, a subroutine or a text.
    rows(lines, places, cut, block, Row::begins_with_label)
}

/// A text with blanks in the place of comments: `;` to the end of a line, `/* */`.
fn without_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text.chars().peekable();
    let (mut in_block, mut in_line) = (false, false);
    while let Some(c) = rest.next() {
        if c == '\n' {
            in_line = false;
            out.push('\n');
        } else if in_block {
            out.push(' ');
            if c == '*' && rest.peek() == Some(&'/') {
                rest.next();
                out.push(' ');
                in_block = false;
            }
        } else if in_line {
            out.push(' ');
        } else if c == ';' {
            in_line = true;
            out.push(' ');
        } else if c == '/' && rest.peek() == Some(&'*') {
            rest.next();
            out.push_str("  ");
            in_block = true;
        } else {
            out.push(c);
        }
    }
    out
}

/// The tokens of a line.
fn pieces(
    line: &str,
    file: FileId,
    number: u32,
    statements: &[u32],
    places: &StatementPlaces,
) -> Vec<Piece> {
    let chars: Vec<char> = line.chars().collect();
    let text = |from: usize, to: usize| -> String {
        chars.get(from..to.min(chars.len())).unwrap_or_default().iter().collect()
    };
    let mut spans: Vec<(usize, usize, u32)> = statements
        .iter()
        .filter_map(|&statement| {
            let place = places.place(statement)?;
            let from = (place.column as usize).checked_sub(1)?;
            let to = match place.end_line == number {
                true => (place.end_column as usize).saturating_sub(1),
                false => chars.len(),
            };
            (place.file == file && from < to).then_some((from, to, statement))
        })
        .collect();
    spans.sort_unstable();
    let mut pieces = vec![];
    let mut at = 0;
    for (from, to, statement) in spans {
        if from < at {
            continue;
        }
        between(&text(at, from), &mut pieces);
        let mut token = Piece::new(text(from, to), Role::Variable);
        token.statement = Some(statement);
        pieces.push(token);
        at = to;
    }
    between(&text(at, chars.len()), &mut pieces);
    pieces
}

/// What stands between the statements of NCT: blanks, labels, the signs of conditions.
fn between(text: &str, pieces: &mut Vec<Piece>) {
    for token in raw(text) {
        let text = token.text();
        match token {
            Raw::Blank(_) => pieces.push(Piece::new(text, Role::Blank)),
            Raw::Text(_) => pieces.push(Piece::new(text, Role::Text)),
            Raw::Number(_) if pieces.last().is_some_and(|last| last.text == ":") => {
                pieces.pop();
                pieces.push(Piece::new(format!(":{text}"), Role::Label));
            }
            Raw::Number(_) => pieces.push(Piece::new(text, Role::Constant)),
            Raw::Word(_) => pieces.push(Piece::new(text, Role::Keyword)),
            Raw::Sign(_) => pieces.push(Piece::new(text, Role::Operator)),
        }
    }
}

/// Whether a token begins or ends a condition. One begins with a test: a bit, a relation, or a parenthesis.
fn block(piece: &Piece) -> Option<Block> {
    let text = piece.text.trim().to_uppercase();
    if text == "Z" {
        return Some(Block::Closes);
    }
    piece.statement?;
    let tests = ["I", "Y", "F", "V", "P", "O", "NI", "NY", "NF", "NV", "NP", "NO"];
    let letters: String = text.chars().take_while(char::is_ascii_alphabetic).collect();
    let is_test = text.starts_with(['=', '<', '>', '(']) || tests.contains(&letters.as_str());
    is_test.then_some(Block::Opens)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presentation::lines::{shown, sources};

    #[test]
    fn columns_stay_what_they_were() {
        let sources = sources(&[("a.plc", ":001 /* a\nb */ U001 ;c\n\nJ1")]);
        let found = shown(lines::lines(&sources, &without_comments, None));
        let pair = |number: &str, text: &str| (number.to_owned(), text.to_owned());
        assert_eq!(found, [pair("1", ":001"), pair("2", "     U001"), pair("4", "J1")]);
    }
}
