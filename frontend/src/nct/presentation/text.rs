//! The statements of a program, each of which is a token of its line.

use plcc_diag::SourceMap;

use crate::common::Words;
use crate::presentation::{Block, Piece, Row, StatementPlaces, Wording, rows};

/// The lines of a program with these words.
pub(super) fn text(sources: &SourceMap, words: &Words, places: &StatementPlaces) -> Vec<Row> {
    let wording = Wording {
        continued_by: None,
        statements_are_tokens: true,
        lines: &|_| {},
        block: &block,
        // A label of three digits begins a module, a subroutine or a text.
        begins_part: &Row::begins_with_label,
    };
    rows(sources, words, places, &wording)
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
    use plcc_abi::Dialect;

    use crate::presentation::testing::shown;

    #[test]
    fn columns_stay_what_they_were() {
        let found = shown(Dialect::Nct, ":000 J0\n:001 /* a\nb */ U001 ;c\n\nJ1\n", &[]);
        let rows =
            [["1", ":000 J0", ""], ["2", ":001", "a"], ["3", "     U001", "b c"], ["5", "J1", ""]];
        assert_eq!(found, rows.map(|row| row.map(str::to_owned)));
    }
}
