//! The statements of a program, as PMI 5.1 displays them: "Specification statements are not displayed".

use std::collections::HashMap;

use plcc_abi::pmi::{PmiTables, Role as PmiRole, Type};
use plcc_diag::SourceMap;

use crate::presentation::lines::{self, SourceLine, without_line_comments};
use crate::presentation::tokens::{Raw, mark_target, raw};
use crate::presentation::{Block, Piece, Role, Row, StatementPlaces, rows};

/// What each name is.
type Names<'t> = HashMap<&'t str, (PmiRole, Type)>;

/// The lines of a program with these tables.
pub(super) fn text(tables: &PmiTables, sources: &SourceMap, places: &StatementPlaces) -> Vec<Row> {
    let symbols = tables.symbols.iter();
    let names: Names<'_> =
        symbols.map(|symbol| (symbol.name.as_str(), (symbol.role, symbol.ty))).collect();
    let cut = |line: &SourceLine, _: &[u32]| pieces(&line.text, &names);
    rows(statements(sources), places, cut, block, Row::begins_with_label)
}

/// The lines behind the specification section, which ends with $END.
fn statements(sources: &SourceMap) -> Vec<SourceLine> {
    let without_comments = |text: &str| without_line_comments(text, &["?"]);
    let mut found = lines::lines(sources, &without_comments, Some("$include"));
    let is_directive = |line: &SourceLine| line.text.trim_start().starts_with('$');
    let first = found.iter().rposition(is_directive).map_or(0, |at| at + 1);
    found.drain(..first);
    join_continued(&mut found);
    found
}

/// Joins continued lines: `#` at the end of a line continues the statement on the next one.
fn join_continued(lines: &mut Vec<SourceLine>) {
    let mut joined: Vec<SourceLine> = vec![];
    for line in lines.drain(..) {
        match joined.last_mut() {
            Some(last) if last.text.ends_with('#') && last.file == line.file => {
                last.text.pop();
                let kept = last.text.trim_end().len();
                last.text.truncate(kept);
                last.text.push_str(line.text.trim_start());
                last.end_line = line.end_line;
                if !line.comment.is_empty() {
                    last.comment = format!("{} {}", last.comment, line.comment).trim().to_owned();
                }
            }
            _ => joined.push(line),
        }
    }
    for line in &mut joined {
        if line.text.ends_with('#') {
            line.text.pop();
        }
    }
    *lines = joined;
}

/// The tokens of a line.
fn pieces(line: &str, names: &Names<'_>) -> Vec<Piece> {
    const KEYWORDS: [&str; 6] = ["IF", "ELSE", "ELSEIF", "ENDIF", "GOTO", "END"];
    let raw = raw(line);
    let mut pieces: Vec<Piece> = vec![];
    let mut is_label_next = false;
    for (at, &token) in raw.iter().enumerate() {
        let next = raw.get(at + 1).copied();
        match token {
            Raw::Blank(text) => pieces.push(Piece::new(text, Role::Blank)),
            Raw::Text(text) => pieces.push(Piece::new(text, Role::Text)),
            Raw::Number(text) => pieces.push(Piece::new(text, Role::Constant)),
            Raw::Sign(text) => pieces.push(Piece::new(text, Role::Operator)),
            Raw::Word(text) if is_label_next || next == Some(Raw::Sign(":")) => {
                is_label_next = false;
                pieces.push(Piece::new(text, Role::Label));
            }
            Raw::Word(text) => {
                is_label_next = text == "GOTO";
                let Some(&(role, ty)) = names.get(text) else {
                    let is_keyword = KEYWORDS.contains(&text);
                    let role = if is_keyword { Role::Keyword } else { Role::Constant };
                    pieces.push(Piece::new(text, role));
                    continue;
                };
                if role == PmiRole::Constant && next != Some(Raw::Sign("[")) {
                    pieces.push(Piece::new(text, Role::Constant));
                    continue;
                }
                let mut variable = Piece::new(text, Role::Variable);
                variable.name = Some(text.into());
                // `/SOL1` is a unit (PMI 5.1).
                let is_single = ty == Type::Logical && next != Some(Raw::Sign("["));
                if is_single && pieces.last().is_some_and(|last| last.text == "/") {
                    pieces.pop();
                    variable.text = format!("/{text}");
                    variable.negated = true;
                }
                pieces.push(variable);
            }
        }
    }
    mark_target(&mut pieces);
    pieces
}

/// Whether a token begins or ends a condition.
fn block(piece: &Piece) -> Option<Block> {
    match piece.text.trim().to_uppercase().as_str() {
        "IF" => Some(Block::Opens),
        "ENDIF" => Some(Block::Closes),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presentation::lines::{shown, sources};

    fn pair(number: &str, text: &str) -> (String, String) {
        (number.into(), text.into())
    }

    #[test]
    fn statements_are_shown_without_specifications_and_comments() {
        let main =
            "$INPUT\nA 0.0 ? input\n$END\n? nothing\nB = A &  #\n  /C ? both\n$INCLUDE \"X.PMI\"\n";
        let found =
            shown(statements(&sources(&[("main.pmi", main), ("lib/x.pmi", "D=B\n? no\nE=B\n")])));
        // $INCLUDE is not a statement either, but what it includes is.
        assert_eq!(found, [pair("5", "B = A &/C"), pair("7.1", "D=B"), pair("7.3", "E=B")]);
    }
}
