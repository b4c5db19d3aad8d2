//! The statements of a download.

use plcc_diag::SourceMap;

use crate::common::Words;
use crate::presentation::{Block, Piece, Row, StatementPlaces, Wording, rows};

/// The lines of a program with these words.
pub(super) fn text(sources: &SourceMap, words: &Words, places: &StatementPlaces) -> Vec<Row> {
    let opens_plc = |row: &Row| row.text().trim_start().to_uppercase().starts_with("OPEN");
    let wording = Wording {
        continued_by: None,
        statements_are_tokens: false,
        lines: &|_| {},
        block: &block,
        begins_part: &opens_plc,
    };
    rows(sources, words, places, &wording)
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
    use plcc_abi::Dialect;

    use crate::presentation::testing::shown;

    #[test]
    fn files_are_included_in_their_place() {
        let main = "#include \"IO.H\"\nOPEN PLC 1 CLEAR\nP1=2 ; no\nSEND\"a;b\"//c\nCLOSE\n";
        let found = shown(Dialect::Pmac, main, &[("IO.H", "M1->X:0,0")]);
        let rows = [
            ["1.1", "M1->X:0,0", ""],
            ["2", "OPEN PLC 1 CLEAR", ""],
            ["3", "P1=2", "no"],
            ["4", "SEND\"a;b\"", "c"],
            ["5", "CLOSE", ""],
        ];
        assert_eq!(found, rows.map(|row| row.map(str::to_owned)));
    }
}
