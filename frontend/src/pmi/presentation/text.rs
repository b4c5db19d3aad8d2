//! The statements of a program, as PMI 5.1 displays them: "Specification statements are not displayed".

use std::collections::HashSet;

use plcc_abi::pmi::{PmiTables, Type};
use plcc_diag::SourceMap;

use crate::common::Words;
use crate::presentation::{Block, Line, Piece, Role, Row, StatementPlaces, Wording, rows};

/// The lines of a program with these tables and words.
pub(super) fn text(
    tables: &PmiTables,
    sources: &SourceMap,
    words: &Words,
    places: &StatementPlaces,
) -> Vec<Row> {
    let symbols = tables.symbols.iter().filter(|symbol| symbol.ty == Type::Logical);
    let logical: HashSet<&str> = symbols.map(|symbol| symbol.name.as_str()).collect();
    let wording = Wording {
        continued_by: Some("#"),
        statements_are_tokens: false,
        lines: &|lines| {
            // The specification section ends with $END.
            let first = lines.iter().rposition(|line| line.is_directive).map_or(0, |at| at + 1);
            lines.drain(..first);
            lines.iter_mut().for_each(|line| join_negations(line, &logical));
        },
        block: &block,
        begins_part: &Row::begins_with_label,
    };
    rows(sources, words, places, &wording)
}

/// Makes one token of `/SOL1`, which is a unit (PMI 5.1).
fn join_negations(line: &mut Line, logical: &HashSet<&str>) {
    let mut at = 1;
    while let (Some(sign), Some(variable)) = (line.pieces.get(at - 1), line.pieces.get(at)) {
        let is_element = line.pieces.get(at + 1).is_some_and(|next| next.text == "[");
        let negates = sign.text == "/" && variable.role == Role::Variable && !is_element;
        if negates && variable.name.as_deref().is_some_and(|name| logical.contains(name)) {
            let Piece { text, .. } = line.pieces.remove(at - 1);
            if let Some(variable) = line.pieces.get_mut(at - 1) {
                variable.text.insert_str(0, &text);
                variable.negated = true;
            }
        }
        at += 1;
    }
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
    use plcc_abi::Dialect;

    use crate::presentation::testing::shown;

    #[test]
    fn statements_are_shown_without_specifications_and_comments() {
        let main = "$INPUT\nA = 0/0 ? input\nC = 0/1\n$OUTPUT\nB = 1/0\nD = 1/1\nE = 1/2\n$END\n? nothing\nB = A &  #\n  /C ? both\n$INCLUDE X.PMI\n";
        let found = shown(Dialect::Pmi, main, &[("X.PMI", "D=B\n? no\nE=B\n")]);
        // $INCLUDE is not a statement either, but what it includes is.
        assert_eq!(
            found,
            [("10", "B = A &/C", "both"), ("12.1", "D=B", ""), ("12.3", "E=B", "")]
                .map(|(number, text, comment)| [number, text, comment].map(str::to_owned))
        );
    }
}
